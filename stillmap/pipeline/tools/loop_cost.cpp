// SPDX-License-Identifier: Apache-2.0
/// What closing loops gains, and what it costs:
///
///     ninja -C build/release stillmap_loop_cost
///     build/release/rooms/pipeline/stillmap_loop_cost SEQUENCE [--lockstep N] [--realtime N]
///                                                     [--out DIR]
///
/// A sequence with ground truth is mapped without and with loop closing, by turns: N times (1) in
/// lockstep, which is as fast as it goes, and N times (3) as if it came from a camera. Printed: ATE
/// and coverage; for every loop or merge what was moved, and the milliseconds for the pose graph,
/// for all that the map's thread did then, and for the adjustment of the whole in its own thread;
/// and the 95th percentile of tracking's milliseconds in the frames that came while that went on,
/// beside the same frames' without loops. DIR gets the trajectories of the last runs.
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/pipeline/paced_source.hpp"
#include "stillmap/pipeline/prefetch.hpp"
#include "stillmap/pipeline/slam.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <numbers>

#include <fmt/format.h>

namespace stillmap {
namespace {

struct Arguments {
  std::string sequence, out;
  int lockstep = 1, realtime = 3;  ///< runs
};

struct Run {
  SlamResult result;
  std::size_t dropped = 0;
  double ate = 0;
  double fps = 30;
};

Run run(const Arguments& arguments, bool loops, bool realtime) {
  const SequencePaths paths = find_sequence(arguments.sequence);
  std::unique_ptr<FrameSource> source = std::make_unique<Prefetch>(
      std::make_unique<TumFolder>(paths, load_camera(paths.camera.string())));
  PacedSource* paced = nullptr;
  if (realtime) {
    auto wrapped = std::make_unique<PacedSource>(std::move(source));
    paced = wrapped.get();
    source = std::move(wrapped);
  }
  SlamOptions options;
  options.places.loops = loops;
  options.schedule.mode = realtime ? "realtime" : "lockstep";
  Slam slam(source->camera(), options);
  while (const auto frame = source->next()) slam.push(frame);
  Run made{slam.finish()};
  made.dropped = paced != nullptr ? paced->dropped() : 0;
  made.fps = source->camera().fps;
  made.ate = absolute_trajectory_error(read_trajectory(paths.ground_truth), made.result.trajectory)
                 .translation.rmse;
  return made;
}

/// What happened at each loop, with the adjustment that followed it.
struct Closing {
  MapEvent event;
  double adjustment_ms = 0;
};

std::vector<Closing> closings(const SlamResult& result) {
  const auto adjustments = result.timing.samples("global adjustment");
  std::vector<Closing> made;
  for (const MapEvent& event : result.events) {
    if (event.kind == MapEvent::Kind::kDropped) continue;
    made.push_back({event, made.size() < adjustments.size() ? adjustments[made.size()] : 0});
  }
  return made;
}

void print(const char* what, const Run& run) {
  fmt::print("{}: ATE {:.4f} m, {} of {} frames tracked, {} dropped late, {} keyframes, {} maps\n",
             what, run.ate, run.result.tracked(), run.result.frames.size() + run.dropped,
             run.dropped, run.result.keyframes.size(), run.result.maps);
  for (const Closing& c : closings(run.result)) {
    const MapEvent& e = c.event;
    fmt::print(
        "  {}: frame {} shows the place of frame {}: {} landmarks agree, {} fused, moved by "
        "{:.3f} m and {:.2f} degrees; {} keyframes: pose graph {:.0f} ms, in all {:.0f} ms, "
        "adjustment of the whole {:.0f} ms\n",
        e.kind == MapEvent::Kind::kLoop ? "loop" : "merge", e.frame_index, e.seen_in, e.inliers,
        e.fused, e.metres, e.radians * 180 / std::numbers::pi, e.keyframes, e.graph_ms,
        e.milliseconds, c.adjustment_ms);
  }
}

/// The frames from a loop's keyframe until the adjustment was done, or in lockstep taken in.
bool was_beside(const Closing& c, std::size_t frame, double fps, bool realtime) {
  constexpr double kRefining = 150;  // ms from the keyframe to the loop, and from there to the copy
  if (frame < c.event.frame_index) return false;
  const auto since = static_cast<double>(frame - c.event.frame_index);
  if (!realtime) return since <= ScheduleOptions{}.global_delay;
  return since <= (kRefining + c.event.milliseconds + c.adjustment_ms) / 1000 * fps;
}

/// Tracking's milliseconds in the frames that came while loops were closed in the run `closed`.
std::vector<double> tracking_beside(const Run& closed, const Run& measured, bool realtime) {
  const auto all = closings(closed.result);
  std::vector<double> milliseconds;
  for (const FrameRecord& frame : measured.result.frames) {
    const auto beside = [&](const Closing& c) {
      return was_beside(c, frame.index, closed.fps, realtime);
    };
    if (std::any_of(all.begin(), all.end(), beside)) milliseconds.push_back(frame.milliseconds);
  }
  return milliseconds;
}

void save(const Arguments& arguments, const char* name, const Run& run) {
  if (!arguments.out.empty())
    write_trajectory(std::filesystem::path(arguments.out) / name, run.result.trajectory);
}

void compare(const Arguments& arguments, bool realtime) {
  std::vector<double> beside, alone;
  const auto add = [](std::vector<double>& to, const std::vector<double>& more) {
    to.insert(to.end(), more.begin(), more.end());
  };
  for (int i = 0; i < (realtime ? arguments.realtime : arguments.lockstep); ++i) {
    const Run without = run(arguments, false, realtime);
    print("without loops", without);
    save(arguments, "without_loops.txt", without);
    const Run with = run(arguments, true, realtime);
    print("with loops", with);
    save(arguments, "with_loops.txt", with);
    add(beside, tracking_beside(with, with, realtime));
    add(alone, tracking_beside(with, without, realtime));
  }
  if (alone.empty()) return;
  const double p95 = quantile(beside, 0.95), p95_alone = quantile(alone, 0.95);
  fmt::print(
      "  tracking beside it: median {:.2f} ms, 95th percentile {:.2f} ms in {} frames; the same "
      "without loops {:.2f} ms, {:.2f} ms in {} frames ({:+.0f} %)\n",
      quantile(beside, 0.5), p95, beside.size(), quantile(alone, 0.5), p95_alone, alone.size(),
      100 * (p95 / p95_alone - 1));
}

void measure(const Arguments& arguments) {
  if (!arguments.out.empty()) make_output_folder(arguments.out);
  if (arguments.realtime > 0) fmt::print("realtime\n");
  compare(arguments, true);
  if (arguments.lockstep > 0) fmt::print("lockstep\n");
  compare(arguments, false);
}

Arguments parse(int argc, char** argv) {
  Arguments arguments;
  for (int i = 1; i < argc; ++i) {
    const std::string word = argv[i];
    if (word == "--lockstep" && i + 1 < argc) {
      arguments.lockstep = std::stoi(argv[++i]);
    } else if (word == "--realtime" && i + 1 < argc) {
      arguments.realtime = std::stoi(argv[++i]);
    } else if (word == "--out" && i + 1 < argc) {
      arguments.out = argv[++i];
    } else {
      arguments.sequence = word;
    }
  }
  if (arguments.sequence.empty())
    throw Error("no sequence was named", "", "name a folder with groundtruth.txt");
  return arguments;
}

}  // namespace
}  // namespace stillmap

int main(int argc, char** argv) {
  try {
    stillmap::measure(stillmap::parse(argc, argv));
  } catch (const std::exception& e) {
    fmt::print(stderr, "{}\n", e.what());
    return 1;
  }
  return 0;
}
