// SPDX-License-Identifier: Apache-2.0
#include "preset_runs.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/finding_json.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/base/machine.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/config/write_options.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/motion/make_cues.hpp"
#include "stillmap/pipeline/run_findings.hpp"
#include "stillmap/pipeline/slam_parameters.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/tum_folder.hpp"

#include <algorithm>
#include <filesystem>
#include <map>
#include <optional>
#include <set>
#include <sstream>
#include <utility>

#include "interrupt.hpp"
#include "progress.hpp"
#include "run_request.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

/// Returns the two parts of "KEY=VALUE". Throws Error if one is missing.
std::pair<std::string, std::string> key_and_value(const std::string& text, const char* option,
                                                  const char* form) {
  const auto equals = text.find('=');
  if (equals == std::string::npos || equals == 0 || equals + 1 == text.size())
    throw Error(fmt::format("'{}' is not of the form {}", text, form), option,
                fmt::format("write {} {}", option, form));
  return {text.substr(0, equals), text.substr(equals + 1)};
}

constexpr const char* kVariantForm = "NAME=PRESET[:OPTION=VALUE]...";

Variant variant_of(const std::string& text) {
  auto [name, rest] = key_and_value(text, "--variant", kVariantForm);
  Variant variant{std::move(name), "", {}};
  std::istringstream parts(rest);
  std::getline(parts, variant.preset, ':');
  for (std::string setting; std::getline(parts, setting, ':');) variant.settings.push_back(setting);
  return variant;
}

std::set<std::string> preset_names() {
  std::set<std::string> names;
  for (const Preset& preset : presets()) names.insert(preset.name);
  return names;
}

/// Adds the name of a column. Throws Error if another column has it.
void add_column(const std::string& name, const char* option, std::set<std::string>& names) {
  if (names.insert(name).second) return;
  throw Error(fmt::format("there is another column '{}'", name), option, "choose another name");
}

/// Returns the variant of this name, or the preset of this name with its own options.
Variant column_of(const ReproduceArguments& arguments, const std::string& name) {
  for (Variant& variant : variants_of(arguments)) {
    if (variant.name == name) return variant;
  }
  return {name, name, {}};
}

/// Returns the network given for this column, otherwise for its preset, otherwise for all; empty if
/// there is none.
std::string model_of(const ReproduceArguments& arguments, const Variant& column) {
  std::string for_preset, for_all;
  for (const std::string& model : arguments.models) {
    const auto equals = model.find('=');
    if (equals == std::string::npos) for_all = model;
    if (model.substr(0, equals) == column.name) return model.substr(equals + 1);
    if (model.substr(0, equals) == column.preset) for_preset = model.substr(equals + 1);
  }
  return for_preset.empty() ? for_all : for_preset;
}

/// Index of the frame for which --maps draws the figures of the methods.
constexpr int kDrawnFrame = 30;

/// @param name  preset or variant
RunRequest request_of(const ReproduceArguments& arguments, const BenchmarkSequence& sequence,
                      const std::string& name, int first) {
  const Variant column = column_of(arguments, name);
  RunRequest request;
  request.sequence = sequence.folder.string();
  request.camera = sequence.camera;
  request.truth_frame = sequence.truth_frame;
  request.preset = column.preset;
  request.model = model_of(arguments, column);
  request.schedule = arguments.schedule;
  const fs::path masks = sequence.folder / "mask";
  if (arguments.true_masks && fs::is_directory(masks)) {
    request.masks = masks.string();
    request.model.clear();
  }
  request.first = first;
  request.count = arguments.frames;
  request.settings = column.settings;
  request.settings.emplace_back("movers.enabled=false");
  if (arguments.maps) {
    request.outputs.figures = {arguments.frames > 0 ? std::min(kDrawnFrame, arguments.frames - 1)
                                                    : kDrawnFrame};
  } else {
    request.settings.emplace_back("dense.enabled=false");
  }
  request.out =
      (fs::path(arguments.out) / "runs" / fmt::format("{}_{}_{}", sequence.name, name, first))
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

/// Returns the mean time of a stage [ms]; 0 if the stage did not run.
double mean_ms(const nlohmann::json& summary, const char* name) {
  for (const auto& stage : summary.at("timing_ms")) {
    if (stage.at("name") == name) return stage.at("mean_ms");
  }
  return 0;
}

/// Returns the figures of the run that is complete in its folder.
/// @param name  column of the tables
FinishedRun read_run(const RunRequest& request, const BenchmarkSequence& sequence,
                     const std::string& name, const nlohmann::json& summary) {
  const auto truth = truth_of(request);
  if (!truth) throw Error("has no ground truth", request.sequence, "add groundtruth.txt");
  FinishedRun run;
  const std::size_t frames = summary.at("frames").at("total");
  run.path = {name, sequence.name, read_trajectory(fs::path(request.out) / "trajectory.txt"),
              *truth, frames};
  run.figures.evaluation =
      evaluate_trajectory(*truth, run.path.estimate, {.total_frames = frames, .per_frame = true});
  run.figures.tracking_ms = mean_ms(summary, "tracking");
  run.figures.waiting_ms = mean_ms(summary, "waiting for network and map");
  const auto& dynamic = summary.at("frames").at("highly_dynamic");
  if (!dynamic.is_null() && frames > 0)
    run.figures.highly_dynamic = dynamic.get<double>() / static_cast<double>(frames);
  run.figures.total_ms = 1000 / summary.at("frames_per_second").get<double>();
  if (!summary.at("detector").is_null()) run.figures.detector = summary.at("detector");
  run.findings = findings_on_trajectory(summary.at("findings").get<std::vector<Finding>>());
  return run;
}

/// Returns the figures of the dense map of a run; none without a map or without true masks.
std::optional<GhostFigures> map_figures(const FinishedRun& run, const fs::path& folder,
                                        const GhostReference* reference) {
  if (reference == nullptr || !fs::exists(folder / "cloud.ply")) return std::nullopt;
  return count_ghosts(*reference, read_ply(folder / "cloud.ply").points,
                      require_alignment(run.figures.evaluation->world));
}

/// Returns a run, which is made unless an earlier start left it complete.
FinishedRun finished_run(const RunRequest& request, const BenchmarkSequence& sequence,
                         const std::string& name) {
  FinishedRun run;
  try {
    const Options options = options_of(request);
    nlohmann::json summary = complete_summary(request, options);
    const bool kept = !summary.is_null();
    if (!kept) {
      const double begun = seconds_since_start();
      Session session = session_of(request, options);
      session.begun = begun;
      summary = run_summary_json(run_session(std::move(session)));
    }
    if (!interrupted()) {
      run = with_json_of(fs::path(request.out) / kRunSummary, "remove it",
                         [&] { return read_run(request, sequence, name, summary); });
    }
    run.kept = kept;
  } catch (const Error& error) {
    run.figures.problem = error.what();
  }
  run.figures.preset = name;
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
  std::string name;  // preset or variant
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
        requests.push_back({&sequence, preset, request_of(arguments, sequence, preset, first)});
    }
  }
  return requests;
}

/// Returns the trajectory files of a sequence in a folder, sorted by name.
std::vector<fs::path> trajectories_of(const fs::path& folder, const std::string& sequence) {
  std::vector<fs::path> files;
  for (const auto& entry : fs::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    if (!name.starts_with(sequence) || !name.ends_with(".txt")) continue;
    const std::string rest = entry.path().stem().string().substr(sequence.size());
    const bool numbered =
        rest.starts_with('_') && rest.find_first_not_of("0123456789", 1) == std::string::npos;
    if (rest.empty() || numbered) files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

/// @param number  index of the run, stored in place of its first frame
FinishedRun foreign_run(const std::string& name, const fs::path& file,
                        const BenchmarkSequence& sequence, int number) {
  RunRequest request;
  request.sequence = sequence.folder.string();
  request.truth_frame = sequence.truth_frame;
  const auto truth = truth_of(request);
  if (!truth) throw Error("has no ground truth", request.sequence, "add groundtruth.txt");
  FinishedRun run;
  run.path = {name, sequence.name, read_trajectory(file), *truth, 0};
  try {
    run.figures.evaluation = evaluate_trajectory(*truth, run.path.estimate, {.per_frame = true});
  } catch (const Error& error) {
    throw Error(fmt::format("cannot be evaluated on {}: {}", sequence.name, error.problem()),
                file.string(), error.fix());
  }
  run.figures.preset = name;
  run.figures.sequence = sequence.name;
  run.figures.first = number;
  run.figures.timed = false;
  return run;
}

}  // namespace

std::vector<Variant> variants_of(const ReproduceArguments& arguments) {
  std::vector<Variant> variants;
  std::set<std::string> names = preset_names();
  for (const std::string& text : arguments.variants) {
    variants.push_back(variant_of(text));
    const std::string& name = variants.back().name;
    if (name.find_first_not_of(
            "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_.") !=
        std::string::npos)
      throw Error(fmt::format("'{}' cannot be part of a file's name", name), "--variant",
                  "use letters, digits and hyphens");
    add_column(name, "--variant", names);
  }
  return variants;
}

std::vector<std::string> systems_of(std::span<const FinishedRun> runs) {
  std::vector<std::string> systems;
  for (const FinishedRun& run : runs) {
    if (std::find(systems.begin(), systems.end(), run.figures.preset) == systems.end())
      systems.push_back(run.figures.preset);
  }
  return systems;
}

void require_foreign_runs(const ReproduceArguments& arguments,
                          std::span<const std::string> sequences) {
  std::set<std::string> names = preset_names();
  for (const Variant& variant : variants_of(arguments)) names.insert(variant.name);
  for (const std::string& text : arguments.baselines) {
    const auto [name, folder] = key_and_value(text, "--baseline", "NAME=DIR");
    add_column(name, "--baseline", names);
    if (!fs::is_directory(folder))
      throw Error("there is no such folder", folder, "name the folder with the trajectories");
    std::vector<std::string> missing;
    for (const std::string& sequence : sequences) {
      if (trajectories_of(folder, sequence).empty()) missing.push_back(sequence);
    }
    if (missing.size() == sequences.size()) {
      throw Error("contains no trajectory of these sequences", folder,
                  fmt::format("name the files SEQUENCE.txt, or SEQUENCE_1.txt, SEQUENCE_2.txt, ... "
                              "with the sequences' names in the tables, such as {}.txt",
                              sequences.front()));
    }
    if (missing.empty()) continue;
    print_out("{} has no trajectory of {} in {}: these cells and the means over them stay empty\n",
              name, fmt::join(missing, ", "), folder);
  }
}

std::vector<FinishedRun> read_foreign_runs(const ReproduceArguments& arguments,
                                           std::span<const BenchmarkSequence> sequences) {
  std::vector<FinishedRun> runs;
  for (const std::string& text : arguments.baselines) {
    const auto [name, folder] = key_and_value(text, "--baseline", "NAME=DIR");
    for (const BenchmarkSequence& sequence : sequences) {
      int number = 0;
      for (const fs::path& file : trajectories_of(folder, sequence.name))
        runs.push_back(foreign_run(name, file, sequence, number++));
    }
  }
  return runs;
}

bool can_run(const ReproduceArguments& arguments, const BenchmarkSequence& sequence,
             const std::string& preset) {
  const Options options = options_of(request_of(arguments, sequence, preset, 0));
  return !needs_instances(options) || !options.network.model.empty() ||
         !options.network.masks.empty();
}

const GhostReference* GhostReferences::of(const BenchmarkSequence& sequence) {
  const auto [entry, added] = made_.try_emplace(sequence.folder);
  const SequencePaths paths = find_sequence(sequence.folder.string());
  if (added && !paths.masks.empty()) {
    RunRequest request;
    request.sequence = sequence.folder.string();
    request.truth_frame = sequence.truth_frame;
    SourceOptions options;
    options.camera = sequence.camera;
    TumFolder source(paths, recorded_camera(request.sequence, options));
    entry->second = std::make_unique<const GhostReference>(make_ghost_reference(
        frames_with_masks(source, paths.masks), truth_of(request).value(), source.camera()));
  }
  return entry->second.get();
}

PresetRunner::PresetRunner(const ReproduceArguments& arguments,
                           std::span<const BenchmarkSequence> sequences,
                           std::span<const std::string> presets)
    : arguments_(arguments),
      sequences_(sequences),
      total_(requests_of(arguments, sequences, presets).size()) {}

void PresetRunner::run(std::span<const std::string> presets) {
  for (const auto& [sequence, name, request] : requests_of(arguments_, sequences_, presets)) {
    if (interrupted()) return;
    FinishedRun run = finished_run(request, *sequence, name);
    if (interrupted()) return;
    if (arguments_.maps && run.figures.evaluation)
      run.figures.map = map_figures(run, request.out, ghost_references_.of(*sequence));
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
  for (const auto& [sequence, name, request] : requests_of(arguments, sequences, presets)) {
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

std::vector<Finding> findings_of(std::span<const FinishedRun> runs,
                                 std::span<const std::string> presets) {
  std::vector<Finding> findings;
  for (const FinishedRun& run : runs) {
    if (std::find(presets.begin(), presets.end(), run.figures.preset) == presets.end()) continue;
    for (Finding finding : run.findings) {
      finding.message = fmt::format("{} on {} from frame {}: {}", run.figures.preset,
                                    run.figures.sequence, run.figures.first, finding.message);
      findings.push_back(std::move(finding));
    }
  }
  return findings;
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
  const auto short_name = [](const std::string& detector) {
    return detector.starts_with("masks from") ? "masks of the sequences"
                                              : detector.substr(0, detector.find(" ("));
  };
  std::vector<std::string> detectors;
  for (const std::string& preset : presets) {
    for (const FinishedRun& run : runs) {
      const std::string& detector = run.figures.detector;
      if (run.figures.preset != preset || detector.empty()) continue;
      std::string text = preset + ": " + short_name(detector);
      if (std::find(detectors.begin(), detectors.end(), text) == detectors.end())
        detectors.push_back(std::move(text));
    }
  }
  return fmt::format(
      "{} per preset and sequence; {}. {}, {}. {}. Detectors: {}.",
      arguments.runs == 1 ? "One run from frame 0"
                          : fmt::format("Mean of {} runs, which begin at frames 0 to {},",
                                        arguments.runs, arguments.runs - 1),
      arguments.frames > 0 ? fmt::format("the first {} frames of each", arguments.frames)
                           : "all frames",
      arguments.schedule == "realtime" ? "Realtime" : "Lockstep",
      arguments.maps ? "with dense map, without movers" : "without dense map and movers",
      machine_description(),
      detectors.empty() ? "none" : fmt::format("{}", fmt::join(detectors, "; ")));
}

}  // namespace stillmap
