// SPDX-License-Identifier: Apache-2.0
#include "preset_runs.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/config/write_options.hpp"
#include "stillmap/motion/make_cues.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/report/doubts.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "interrupt.hpp"
#include "progress.hpp"
#include "run_request.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

/// Returns the network of a preset; empty without one.
std::string model_of(const ReproduceArguments& arguments, const std::string& preset) {
  std::string for_all;
  for (const std::string& model : arguments.models) {
    const auto equals = model.find('=');
    if (equals == std::string::npos) for_all = model;
    if (model.substr(0, equals) == preset) return model.substr(equals + 1);
  }
  return for_all;
}

RunRequest request_of(const ReproduceArguments& arguments, const BenchmarkSequence& sequence,
                      const std::string& preset, int first) {
  RunRequest request;
  request.sequence = sequence.folder.string();
  request.camera = sequence.camera;
  request.truth_frame = sequence.truth_frame;
  request.preset = preset;
  request.model = model_of(arguments, preset);
  const fs::path masks = sequence.folder / "mask";
  if (arguments.true_masks && fs::is_directory(masks)) {
    request.masks = masks.string();
    request.model.clear();
  }
  request.first = first;
  request.count = arguments.frames;
  request.settings = {"dense.enabled=false", "movers.enabled=false"};
  request.out =
      (fs::path(arguments.out) / "runs" / fmt::format("{}_{}_{}", sequence.name, preset, first))
          .string();
  request.force = arguments.force;
  request.quiet = true;
  return request;
}

/// Returns the summary of a run that an earlier start left complete; null if there is none: it was
/// cut off, made with other options, or older than this program or its network.
nlohmann::json complete_summary(const RunRequest& request, const Options& options) {
  const fs::path file = fs::path(request.out) / kRunSummary;
  std::error_code failed;
  const auto made = fs::last_write_time(file, failed);
  if (failed) return nullptr;
  const auto older_than = [&](const fs::path& other) {
    std::error_code none;
    const auto time = fs::last_write_time(other, none);
    return !none && made < time;
  };
  if (older_than("/proc/self/exe") || older_than(options.network.model)) return nullptr;
  const auto json = nlohmann::json::parse(read_file(file), nullptr, false);
  const auto is = [&](const char* key, const nlohmann::json& value) {
    return json.is_object() && json.value(key, nlohmann::json()) == value;
  };
  const bool same = is("options", options_json(options)) && is("recording", recording_of(request));
  return same && is("interrupted", false) ? json : nullptr;
}

/// Returns the figures of the run that is complete in its folder.
FinishedRun read_run(const RunRequest& request, const BenchmarkSequence& sequence,
                     const nlohmann::json& summary) {
  const auto truth = truth_of(request);
  if (!truth) throw Error("has no ground truth", request.sequence, "add groundtruth.txt");
  FinishedRun run;
  const std::size_t frames = summary.at("frames").at("total");
  run.path = {request.preset, sequence.name,
              read_trajectory(fs::path(request.out) / "trajectory.txt"), *truth, frames};
  run.figures.evaluation =
      evaluate_trajectory(*truth, run.path.estimate, {.total_frames = frames, .per_frame = true});
  for (const auto& stage : summary.at("timing_ms")) {
    if (stage.at("name") == "tracking") run.figures.tracking_ms = stage.at("mean_ms");
  }
  run.figures.total_ms = 1000 / summary.at("frames_per_second").get<double>();
  if (!summary.at("detector").is_null()) run.figures.detector = summary.at("detector");
  run.doubts = summary.at("doubts");
  return run;
}

/// Returns a run, which is made unless an earlier start left it complete.
FinishedRun finished_run(const RunRequest& request, const BenchmarkSequence& sequence) {
  FinishedRun run;
  try {
    const Options options = options_of(request);
    nlohmann::json summary = complete_summary(request, options);
    const bool kept = !summary.is_null();
    if (!kept) summary = run_summary_json(run_session(session_of(request, options)));
    if (!interrupted()) {
      run = with_json_of(fs::path(request.out) / kRunSummary, "remove it",
                         [&] { return read_run(request, sequence, summary); });
    }
    run.kept = kept;
  } catch (const Error& error) {
    run.figures.problem = error.what();
  }
  run.figures.preset = request.preset;
  run.figures.sequence = sequence.name;
  run.figures.first = request.first.value_or(0);
  return run;
}

void print_run(const PaperRun& run) {
  print_out("{}, {}, from frame {}: ", run.sequence, run.preset, run.first);
  if (!run.evaluation) {
    print_out("{}", run.problem);
    return;
  }
  const Coverage& coverage = run.evaluation->coverage;
  print_out("ATE RMSE {:.4f} m, {}/{} frames, {:.1f} ms", run.evaluation->ate.translation.rmse,
            coverage.tracked, coverage.total, run.tracking_ms);
}

/// A run to be done.
struct SequenceRequest {
  const BenchmarkSequence* sequence;
  RunRequest request;
};

/// Returns the runs of these presets on all sequences.
std::vector<SequenceRequest> requests_of(const ReproduceArguments& arguments,
                                         std::span<const BenchmarkSequence> sequences,
                                         std::span<const std::string> presets) {
  std::vector<SequenceRequest> requests;
  for (const BenchmarkSequence& sequence : sequences) {
    for (const std::string& preset : presets) {
      if (!can_run(arguments, sequence, preset)) continue;
      for (int first = 0; first < arguments.runs; ++first)
        requests.push_back({&sequence, request_of(arguments, sequence, preset, first)});
    }
  }
  return requests;
}

}  // namespace

bool can_run(const ReproduceArguments& arguments, const BenchmarkSequence& sequence,
             const std::string& preset) {
  const Options options = options_of(request_of(arguments, sequence, preset, 0));
  return !needs_instances(options) || !options.network.model.empty() ||
         !options.network.masks.empty();
}

PresetRunner::PresetRunner(const ReproduceArguments& arguments,
                           std::span<const BenchmarkSequence> sequences,
                           std::span<const std::string> presets)
    : arguments_(arguments),
      sequences_(sequences),
      total_(requests_of(arguments, sequences, presets).size()) {}

void PresetRunner::run(std::span<const std::string> presets) {
  for (const auto& [sequence, request] : requests_of(arguments_, sequences_, presets)) {
    if (interrupted()) return;
    FinishedRun run = finished_run(request, *sequence);
    if (interrupted()) return;
    if (!run.kept) ++made_;
    finished_.push_back(std::move(run));
    print_run(finished_.back().figures);
    print_out(" [{}/{}{}]\n", finished_.size(), total_,
              finished_.back().kept ? ", of an earlier start" : time_left());
    std::fflush(stdout);
  }
}

std::string PresetRunner::time_left() const {
  const std::size_t left = total_ - finished_.size();
  if (left == 0) return "";
  const double seconds_per_run = watch_.milliseconds() / 1000 / static_cast<double>(made_);
  return ", about " + duration_text(seconds_per_run * static_cast<double>(left)) + " left";
}

void check_models(const ReproduceArguments& arguments, std::span<const BenchmarkSequence> sequences,
                  std::span<const std::string> presets) {
  for (const std::string& model : arguments.models) {
    const auto equals = model.find('=');
    if (equals == std::string::npos || fs::exists(model)) continue;
    const std::string preset = model.substr(0, equals);
    if (std::find(presets.begin(), presets.end(), preset) != presets.end()) continue;
    throw Error(fmt::format("'{}' is no preset of this experiment", preset), "--model " + model,
                suggestion(preset, {presets.begin(), presets.end()}));
  }
  std::set<std::string> opened;  // presets and their networks
  for (const auto& [sequence, request] : requests_of(arguments, sequences, presets)) {
    if (request.model.empty() || !opened.insert(request.preset + " " + request.model).second)
      continue;
    const SlamParameters parameters = parameters_of(options_of(request));
    if (!use_instances(make_cues(parameters.motion))) continue;
    const auto detector = make_detector(parameters.segment);
    if (needs_masks(request.preset) && !detector->gives_masks()) {
      throw Error(
          fmt::format("preset {} needs masks, and this network gives boxes only", request.preset),
          request.model,
          fmt::format("name a segmentation network: --model {}=yolov8n-seg.onnx", request.preset));
    }
  }
}

std::vector<PaperRun> figures_of(std::span<const FinishedRun> runs) {
  std::vector<PaperRun> figures;
  for (const FinishedRun& run : runs) figures.push_back(run.figures);
  return figures;
}

std::vector<std::string> problems_of(std::span<const FinishedRun> runs) {
  std::vector<std::string> problems;
  for (const FinishedRun& finished : runs) {
    const PaperRun& run = finished.figures;
    if (!run.evaluation) {
      problems.push_back(
          fmt::format("the tables lack {} on {}, since the run from frame {} failed: {}",
                      run.preset, run.sequence, run.first, run.problem));
    }
  }
  return problems;
}

std::vector<std::string> doubts_of(std::span<const FinishedRun> runs,
                                   std::span<const std::string> presets) {
  std::vector<std::string> doubts;
  for (const FinishedRun& run : runs) {
    if (std::find(presets.begin(), presets.end(), run.figures.preset) == presets.end()) continue;
    for (const std::string& doubt : run.doubts)
      doubts.push_back(fmt::format("{} on {} from frame {}: {}", run.figures.preset,
                                   run.figures.sequence, run.figures.first, doubt));
  }
  return doubts;
}

Comparison first_paths(std::span<const FinishedRun> runs, std::span<const std::string> presets) {
  std::vector<RecordedRun> paths;
  for (const std::string& preset : presets) {
    for (const FinishedRun& run : runs) {
      if (run.figures.preset == preset && run.figures.first == 0 && run.figures.evaluation)
        paths.push_back(run.path);
    }
  }
  return compare_runs(paths);
}

void write_paths(const Comparison& paths, const std::string& name, ResultFolder& folder) {
  if (paths.runs.empty()) return;
  folder.write(name + "_trajectories.png",
               [&](const fs::path& file) { write_png(file, comparison_image(paths)); });
  folder.write_text(name + "_trajectories.svg", comparison_chart(paths).file());
}

std::string protocol_of(const ReproduceArguments& arguments, std::span<const FinishedRun> runs,
                        std::span<const std::string> presets) {
  std::vector<std::string> detectors;
  for (const std::string& preset : presets) {
    for (const FinishedRun& run : runs) {
      const std::string& detector = run.figures.detector;
      if (run.figures.preset != preset || detector.empty()) continue;
      std::string text = preset + ": " + detector.substr(0, detector.find(','));
      if (std::find(detectors.begin(), detectors.end(), text) == detectors.end())
        detectors.push_back(std::move(text));
    }
  }
  return fmt::format(
      "{} per preset and sequence; {}. Lockstep, without dense map and movers. {}. Detectors: {}.",
      arguments.runs == 1 ? "One run from frame 0"
                          : fmt::format("Mean of {} runs, which begin at frames 0 to {},",
                                        arguments.runs, arguments.runs - 1),
      arguments.frames > 0 ? fmt::format("the first {} frames of each", arguments.frames)
                           : "all frames",
      machine_description(),
      detectors.empty() ? "none" : fmt::format("{}", fmt::join(detectors, "; ")));
}

}  // namespace stillmap
