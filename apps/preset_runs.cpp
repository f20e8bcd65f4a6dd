// SPDX-License-Identifier: Apache-2.0
#include "preset_runs.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>

#include "interrupt.hpp"
#include "progress.hpp"
#include "run_request.hpp"
#include <fmt/format.h>

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

FinishedRun finished_run(const RunRequest& request, const BenchmarkSequence& sequence) {
  FinishedRun run;
  run.figures.preset = request.preset;
  run.figures.sequence = sequence.name;
  run.figures.first = request.first.value_or(0);
  try {
    const RunRecord record = run_session(session_of(request, options_of(request)));
    if (!record.truth) throw Error("has no ground truth", request.sequence, "add groundtruth.txt");
    run.path = {request.preset, sequence.name, record.result.trajectory, *record.truth,
                record.total_frames()};
    run.figures.evaluation =
        evaluate_trajectory(*record.truth, record.result.trajectory,
                            {.total_frames = record.total_frames(), .per_frame = true});
    for (const StageTiming& stage : record.result.timing.stages()) {
      if (stage.name == "tracking") run.figures.tracking_ms = stage.mean;
    }
    run.figures.total_ms = 1000 / record.frames_per_second();
  } catch (const Error& error) {
    run.figures.problem = error.what();
  }
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
    finished_.push_back(std::move(run));
    print_run(finished_.back().figures);
    const std::size_t left = total_ - finished_.size();
    const double seconds_per_run =
        watch_.milliseconds() / 1000 / static_cast<double>(finished_.size());
    print_out(
        " [{}/{}{}]\n", finished_.size(), total_,
        left > 0 ? ", about " + duration_text(seconds_per_run * static_cast<double>(left)) + " left"
                 : "");
    std::fflush(stdout);
  }
}

std::vector<PaperRun> figures_of(std::span<const FinishedRun> runs) {
  std::vector<PaperRun> figures;
  for (const FinishedRun& run : runs) figures.push_back(run.figures);
  return figures;
}

std::vector<std::string> problems_of(std::span<const FinishedRun> runs) {
  std::vector<std::string> problems;
  for (const auto& [run, path] : runs) {
    if (!run.evaluation) {
      problems.push_back(fmt::format("the tables lack {} on {} from frame {}: {}", run.preset,
                                     run.sequence, run.first, run.problem));
    }
  }
  return problems;
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

std::string protocol_of(const ReproduceArguments& arguments) {
  return fmt::format(
      "Mean of {} runs per preset and sequence, which begin at frames 0 to {}; {}. Lockstep, "
      "without dense map and movers. {}.",
      arguments.runs, arguments.runs - 1,
      arguments.frames > 0 ? fmt::format("the first {} frames of each", arguments.frames)
                           : "all frames",
      machine_description());
}

}  // namespace stillmap
