// SPDX-License-Identifier: Apache-2.0
/// Memory and time of a very long run: a recording is passed to the system again and again, forth
/// and back, as one recording. Printed after each tenth of the frames: resident memory, tracking
/// time (median and 95th percentile), keyframes, landmarks and views of the map, size of the
/// journal, events, lost and dropped frames; at the end the ATE if there is a true trajectory.
#include "stillmap/base/statistics.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/pipeline/paced_source.hpp"
#include "stillmap/pipeline/run_journal.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <array>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <unistd.h>

#include "commands.hpp"
#include <fmt/format.h>

namespace stillmap::lab {
namespace {

constexpr std::size_t kParts = 10;

struct Arguments {
  std::string sequence, out;
  std::size_t frames = 100000;
  bool realtime = false;
  double faster = 1;  ///< Factor on the frame rate in real time.
};

/// Returns the resident memory of this process [MiB].
double resident_mib() {
  std::ifstream file("/proc/self/statm");
  double total = 0, resident = 0;
  file >> total >> resident;
  return resident * static_cast<double>(::sysconf(_SC_PAGESIZE)) / (1 << 20);
}

/// The frames of a recording forth and back, as one recording; all images are kept in memory.
class ForthAndBack final : public FrameSource {
 public:
  ForthAndBack(FrameSource& recording, std::size_t frames)
      : camera_(recording.camera()), frames_(frames) {
    while (auto frame = recording.next()) recorded_.push_back(std::move(frame));
  }
  const Camera& camera() const override { return camera_; }
  std::optional<std::size_t> size() const override { return frames_; }
  const std::vector<SkippedFrame>& skipped() const override { return skipped_; }
  RgbdFramePtr next() override {
    if (index_ == frames_) return nullptr;
    auto frame = std::make_shared<RgbdFrame>(*recorded_[source_of(index_)]);
    frame->timestamp = timestamp(index_);
    frame->index = index_++;
    return frame;
  }

  double timestamp(std::size_t index) const { return static_cast<double>(index) / camera_.fps; }
  /// Returns the true trajectory, from that of the recording.
  Trajectory truth(const Trajectory& recorded) const {
    Trajectory truth;
    for (std::size_t i = 0; i < frames_; ++i) {
      const double stamp = recorded_[source_of(i)]->timestamp;
      const auto pose = std::find_if(recorded.begin(), recorded.end(), [&](const StampedPose& p) {
        return std::abs(p.timestamp - stamp) < 0.01;
      });
      if (pose != recorded.end()) truth.push_back({timestamp(i), pose->T_world_camera});
    }
    return truth;
  }

 private:
  std::size_t source_of(std::size_t index) const {
    const std::size_t last = recorded_.size() - 1, place = index % (2 * last);
    return place <= last ? place : 2 * last - place;
  }

  const Camera camera_;
  const std::size_t frames_;
  std::vector<RgbdFramePtr> recorded_;
  std::vector<SkippedFrame> skipped_;
  std::size_t index_ = 0;
};

void print_part(SlamSystem& slam, const std::filesystem::path& journal, std::size_t first) {
  const auto& records = slam.records();
  std::vector<float> times;
  std::size_t lost = 0;
  for (std::size_t i = first; i < records.size(); ++i) {
    times.push_back(records[i].times.total());
    lost += records[i].has_pose() ? 0 : 1;
  }
  const auto quantile = [&](double share) {
    return value_of_rank(times,
                         static_cast<std::size_t>(share * static_cast<double>(times.size() - 1)));
  };
  std::size_t keyframes = 0, landmarks = 0, events = 0, views = 0;
  slam.ask_map([&](const MapMaker& maker) {
        keyframes = maker.map().keyframe_count();
        landmarks = maker.map().landmark_count();
        events = maker.events().size();
      })
      .get();
  slam.ask_views([&](const DenseStream& dense) { views = dense.views().size(); }).get();
  fmt::print("| {} | {:.0f} | {:.2f} | {:.2f} | {} | {} | {} | {:.1f} | {} | {} |\n",
             records.size(), resident_mib(), quantile(0.5), quantile(0.95), keyframes, landmarks,
             views, static_cast<double>(std::filesystem::file_size(journal)) / (1 << 20), events,
             lost);
  std::fflush(stdout);
}

/// Returns the RMSE of the position of each tenth of the poses [m].
std::vector<double> rmse_by_part(const AteResult& ate) {
  std::vector<double> parts;
  for (std::size_t part = 0; part < kParts; ++part) {
    double squares = 0;
    const std::size_t begin = part * ate.pairs.size() / kParts;
    const std::size_t end = (part + 1) * ate.pairs.size() / kParts;
    for (std::size_t i = begin; i < end; ++i) squares += ate.pairs[i].error * ate.pairs[i].error;
    parts.push_back(std::sqrt(squares / static_cast<double>(end - begin)));
  }
  return parts;
}

void measure(const Arguments& arguments) {
  const SequencePaths paths = find_sequence(arguments.sequence);
  TumFolder recording(paths, read_camera(paths.camera.string()));
  auto source = std::make_unique<ForthAndBack>(recording, arguments.frames);
  const ForthAndBack& frames = *source;
  std::optional<PacedSource> paced;
  FrameSource* next = source.get();
  if (arguments.realtime) next = &paced.emplace(std::move(source), 1 / arguments.faster);
  SlamParameters parameters = parameters_of(read_options());
  parameters.schedule.realtime = arguments.realtime;
  SlamSystem slam(next->camera(), parameters);
  const std::filesystem::path file = std::filesystem::path(arguments.out) / "run.journal";
  std::filesystem::create_directories(arguments.out);
  RunJournal journal(slam, file, {"lab", "long run", "", ""});
  fmt::print(
      "| frames | memory [MiB] | tracking, median [ms] | 95 % [ms] | keyframes | landmarks | "
      "views | journal [MiB] | events | without pose |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n");
  std::size_t part = 1, first = 0;
  while (const auto frame = next->next()) {
    slam.push(frame);
    journal.add_newest();
    if (frame->index + 1 < part * arguments.frames / kParts) continue;
    print_part(slam, file, first);
    first = slam.records().size();
    ++part;
  }
  journal.flush();
  const SlamResult result = slam.finish();
  fmt::print("with a pose: {} of {}; dropped: {}; memory after the end: {:.0f} MiB\n",
             result.tracked(), arguments.frames, paced ? paced->dropped().size() : 0,
             resident_mib());
  for (const MapEvent& e : result.events) {
    constexpr std::array<const char*, 3> kNames{"loop", "merge", "dropped"};
    fmt::print("frame {}: {}, seen in frame {}, {} inliers, {:.3f} m, {:.4f} rad\n", e.frame_index,
               kNames.at(static_cast<std::size_t>(e.kind)), e.seen_in, e.inliers, e.meters,
               e.radians);
  }
  if (paths.ground_truth.empty()) return;
  const Trajectory truth = frames.truth(read_trajectory(paths.ground_truth));
  const Evaluation evaluation = evaluate_trajectory(truth, result.trajectory, {});
  fmt::print("ATE RMSE {:.4f} m; by tenths:", evaluation.ate.translation.rmse);
  for (const double rmse : rmse_by_part(evaluation.ate)) fmt::print(" {:.4f}", rmse);
  fmt::print("\n");
}

}  // namespace

void add_long_run_command(CLI::App& app) {
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand(
      "long-run", "memory, tracking time, file sizes and errors of a very long run, by tenths");
  command->add_option("sequence", arguments->sequence, "folder in TUM layout; small images")
      ->required();
  command->add_option("--out", arguments->out, "folder for the journal")->required();
  command->add_option("--frames", arguments->frames, "number of frames")->capture_default_str();
  command->add_flag("--realtime", arguments->realtime, "at the rate of the camera");
  command->add_option("--faster", arguments->faster, "factor on that rate")->capture_default_str();
  command->callback([arguments] { measure(*arguments); });
}

}  // namespace stillmap::lab
