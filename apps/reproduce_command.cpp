// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/benchmark_sequences.hpp"
#include "stillmap/evaluate/compare.hpp"
#include "stillmap/evaluate/paper_tables.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/report/machine.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <algorithm>
#include <map>
#include <memory>

#include "commands.hpp"
#include "interrupt.hpp"
#include "run_request.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kAll = "all";

struct ReproduceArguments {
  std::string paper, data, out = "reproduced";
  std::vector<std::string> models, sequences;
  int runs = 3, frames = 0;
  bool true_masks = false, force = false;

  ResultFolder::Foreign foreign() const {
    return force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep;
  }
};

/// Networks by preset; that of the empty name is for all others.
using Models = std::map<std::string, std::string>;

Models models_of(const ReproduceArguments& arguments) {
  Models models;
  for (const std::string& model : arguments.models) {
    const auto equals = model.find('=');
    if (equals == std::string::npos) {
      models[""] = model;
    } else {
      models[model.substr(0, equals)] = model.substr(equals + 1);
    }
  }
  return models;
}

std::vector<Paper> papers_of(const ReproduceArguments& arguments) {
  if (arguments.paper == kAll) return papers();
  return {find_paper(arguments.paper)};
}

/// The experiment: which presets map which sequences.
struct Experiment {
  std::vector<BenchmarkSequence> sequences;
  std::vector<std::string> presets;
  std::vector<std::string> left_out;  ///< Presets that detect nothing without a network.
};

RunRequest request_of(const ReproduceArguments& arguments, const Models& models,
                      const BenchmarkSequence& sequence, const std::string& preset, int first) {
  RunRequest request;
  request.sequence = sequence.folder.string();
  request.camera = sequence.camera;
  request.truth_frame = sequence.truth_frame;
  request.preset = preset;
  const bool own = models.contains(preset);
  if (own || models.contains("")) request.model = models.at(own ? preset : "");
  const fs::path masks = sequence.folder / "mask";
  if (arguments.true_masks && fs::is_directory(masks)) request.masks = masks.string();
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

/// Returns whether a preset has what it needs on a sequence: a network or masks, unless it detects
/// motion without them.
bool can_run(const RunRequest& request) {
  const Options options = options_of(request);
  return !needs_instances(options) || !options.network.model.empty() ||
         !options.network.masks.empty();
}

Experiment experiment_of(const ReproduceArguments& arguments, const Models& models,
                         const std::vector<Paper>& papers) {
  Experiment experiment;
  experiment.sequences = find_benchmark_sequences(arguments.data, arguments.sequences);
  experiment.presets = {kPaperBaseline};
  for (const Paper& paper : papers) experiment.presets.push_back(paper.preset);
  experiment.presets.emplace_back(kOwnSystem);
  const auto runs_nowhere = [&](const std::string& preset) {
    return std::none_of(experiment.sequences.begin(), experiment.sequences.end(),
                        [&](const BenchmarkSequence& sequence) {
                          return can_run(request_of(arguments, models, sequence, preset, 0));
                        });
  };
  std::copy_if(experiment.presets.begin(), experiment.presets.end(),
               std::back_inserter(experiment.left_out), runs_nowhere);
  std::erase_if(experiment.presets, runs_nowhere);
  return experiment;
}

/// Returns the sequences of the papers that were not found.
std::vector<std::string> missing_sequences(const std::vector<Paper>& papers,
                                           const Experiment& experiment) {
  std::vector<std::string> missing;
  for (const Paper& paper : papers) {
    for (const std::string& name : paper.sequences) {
      const auto is_it = [&](const BenchmarkSequence& sequence) { return sequence.name == name; };
      if (std::none_of(experiment.sequences.begin(), experiment.sequences.end(), is_it) &&
          std::find(missing.begin(), missing.end(), name) == missing.end())
        missing.push_back(name);
    }
  }
  return missing;
}

std::string missing_text(const std::vector<std::string>& missing) {
  if (missing.empty()) return "";
  std::string text = "Sequences of the papers that were not found, and where they come from:\n\n";
  for (const std::string& name : missing)
    text += fmt::format("- {}: {}\n", name, download_hint(name));
  return text;
}

std::string left_out_text(const Experiment& experiment) {
  if (experiment.left_out.empty()) return "";
  return fmt::format(
      "Left out, since they detect moving objects with a network only and none was named (--model "
      "FILE.onnx, or --model PRESET=FILE.onnx): {}\n",
      fmt::join(experiment.left_out, ", "));
}

/// A run with its path, for the figure of trajectories.
struct FinishedRun {
  PaperRun figures;
  RecordedRun path;
};

FinishedRun map_sequence(const RunRequest& request, const BenchmarkSequence& sequence) {
  FinishedRun run;
  run.figures.preset = request.preset;
  run.figures.sequence = sequence.name;
  run.figures.first = request.first.value_or(0);
  try {
    RunRecord record = run_session(session_of(request, options_of(request)));
    if (!record.truth) throw Error("has no ground truth", request.sequence, "add groundtruth.txt");
    run.path = {request.preset, sequence.name, record.result.trajectory, *record.truth,
                record.total_frames()};
    run.figures.evaluation =
        evaluate_trajectory(*record.truth, record.result.trajectory,
                            {.total_frames = record.total_frames(), .per_frame = true});
    for (const StageTiming& stage : record.result.timing.stages()) {
      if (stage.name == "tracking") run.figures.tracking_ms = stage.mean;
    }
  } catch (const Error& error) {
    run.figures.problem = error.what();
  }
  return run;
}

void print_run(const FinishedRun& run, std::size_t number, std::size_t total) {
  const PaperRun& figures = run.figures;
  fmt::print("[{}/{}] {}, {}, from frame {}: ", number, total, figures.sequence, figures.preset,
             figures.first);
  if (!figures.evaluation) {
    fmt::print("{}\n", figures.problem);
  } else {
    const Coverage& coverage = figures.evaluation->coverage;
    fmt::print("ATE RMSE {:.4f} m, {}/{} frames, {:.1f} ms\n",
               figures.evaluation->ate.translation.rmse, coverage.tracked, coverage.total,
               figures.tracking_ms);
  }
  std::fflush(stdout);
}

/// Maps every sequence with every preset, as often as wanted. An interrupt ends it early.
std::vector<FinishedRun> run_all(const ReproduceArguments& arguments, const Models& models,
                                 const Experiment& experiment) {
  std::vector<RunRequest> requests;
  std::vector<const BenchmarkSequence*> sequences;
  for (const BenchmarkSequence& sequence : experiment.sequences) {
    for (const std::string& preset : experiment.presets) {
      for (int first = 0; first < arguments.runs; ++first) {
        requests.push_back(request_of(arguments, models, sequence, preset, first));
        if (can_run(requests.back())) {
          sequences.push_back(&sequence);
        } else {
          requests.pop_back();
        }
      }
    }
  }
  std::vector<FinishedRun> runs;
  for (std::size_t i = 0; i < requests.size() && !interrupted(); ++i) {
    runs.push_back(map_sequence(requests[i], *sequences[i]));
    print_run(runs.back(), i + 1, requests.size());
  }
  return runs;
}

/// Returns the paths of the paper's figure: the first run of each of its systems per sequence.
Comparison paths_of(const Paper& paper, const std::vector<FinishedRun>& runs) {
  std::vector<RecordedRun> paths;
  for (const FinishedRun& run : runs) {
    const std::string& preset = run.figures.preset;
    const bool shown = preset == kPaperBaseline || preset == paper.preset || preset == kOwnSystem;
    if (shown && run.figures.first == 0 && run.figures.evaluation) paths.push_back(run.path);
  }
  return compare_runs(paths);
}

/// What is written about a paper.
struct PaperReport {
  std::string heading, protocol;
  std::vector<FigureTable> tables;
};

PaperReport report_of(const Paper& paper, const ReproduceArguments& arguments,
                      const std::vector<PaperRun>& runs) {
  PaperReport report;
  report.heading =
      fmt::format("{} ({} {}): {}", paper.preset, paper.authors, paper.year, paper.title);
  report.protocol = fmt::format(
      "Mean of {} runs per preset and sequence, which begin at frames 0 to {}; {}. Lockstep, "
      "without dense map and movers. {}. Published figures: {}.",
      arguments.runs, arguments.runs - 1,
      arguments.frames > 0 ? fmt::format("the first {} frames of each", arguments.frames)
                           : "all frames",
      machine_description(), paper.source);
  report.tables = paper_tables(paper, runs);
  return report;
}

std::string markdown_of(const PaperReport& report, const std::string& remarks) {
  std::string text = fmt::format("# {}\n\n{}\n", report.heading, report.protocol);
  for (const FigureTable& table : report.tables) text += "\n" + table_markdown(table);
  return remarks.empty() ? text : text + "\n" + remarks;
}

std::string latex_of(const PaperReport& report) {
  std::string text = fmt::format("% {}\n% {}\n", report.heading, report.protocol);
  for (const FigureTable& table : report.tables) text += "\n" + table_latex(table);
  return text;
}

std::vector<std::string> files_of(const Paper& paper) {
  return {paper.preset + ".md", paper.preset + ".tex", paper.preset + ".json",
          paper.preset + "_trajectories.png", paper.preset + "_trajectories.svg"};
}

/// Prints the tables of a paper and writes its files.
void write_paper(const Paper& paper, const ReproduceArguments& arguments,
                 const std::vector<FinishedRun>& finished, const Experiment& experiment,
                 ResultFolder& folder) {
  std::vector<PaperRun> runs;
  for (const FinishedRun& run : finished) runs.push_back(run.figures);
  const PaperReport report = report_of(paper, arguments, runs);
  const std::vector<std::string> missing = missing_sequences({paper}, experiment);
  const std::string left_out = left_out_text(experiment);
  const std::string text = markdown_of(
      report, left_out + (left_out.empty() || missing.empty() ? "" : "\n") + missing_text(missing));
  fmt::print("\n{}\n", text);
  nlohmann::json json{{"stillmap", STILLMAP_VERSION},
                      {"paper", paper.preset},
                      {"title", paper.title},
                      {"source", paper.source},
                      {"tables", report.tables},
                      {"missing_sequences", missing},
                      {"presets_left_out", experiment.left_out}};
  json["runs"] = nlohmann::json::array();
  for (const PaperRun& run : runs) {
    if (run.preset == paper.preset || run.preset == kPaperBaseline || run.preset == kOwnSystem)
      json["runs"].push_back(run);
  }
  folder.write_text(paper.preset + ".md", text);
  folder.write_text(paper.preset + ".tex", latex_of(report));
  folder.write_text(paper.preset + ".json", json.dump(2) + "\n");
  const Comparison paths = paths_of(paper, finished);
  if (paths.runs.empty()) return;
  folder.write(paper.preset + "_trajectories.png",
               [&](const fs::path& file) { write_png(file, comparison_image(paths)); });
  folder.write_text(paper.preset + "_trajectories.svg", comparison_chart(paths).file());
}

int run(const ReproduceArguments& arguments) {
  if (arguments.runs < 1) throw Error("must be 1 or more", "--runs", "take 3, as the papers did");
  const std::vector<Paper> chosen = papers_of(arguments);
  const Models models = models_of(arguments);
  const Experiment experiment = experiment_of(arguments, models, chosen);
  const std::string missing = missing_text(missing_sequences(chosen, experiment));
  if (experiment.sequences.empty()) {
    throw Error("contains no sequence of the papers with ground truth", arguments.data,
                "name others with --sequences, or get those of the papers.\n" + missing);
  }
  fmt::print("{}{}", left_out_text(experiment), missing);
  ResultFolder folder(arguments.out, arguments.foreign());
  for (const Paper& paper : chosen) folder.require_free(files_of(paper));
  catch_interrupt();
  const std::vector<FinishedRun> runs = run_all(arguments, models, experiment);
  for (const Paper& paper : chosen) write_paper(paper, arguments, runs, experiment, folder);
  folder.require_all();
  fmt::print("{}", folder.written_text());
  return interrupted() ? kInterrupted : kSuccess;
}

}  // namespace

void add_reproduce_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReproduceArguments>();
  CLI::App* command = app.add_subcommand(
      "reproduce", "repeat the experiments of the four papers and print their tables");
  std::vector<std::string> names;
  for (const Paper& paper : papers()) names.push_back(paper.preset);
  names.emplace_back(kAll);
  command->add_option("paper", arguments->paper, "paper, by its preset")
      ->required()
      ->type_name(fmt::format("{{{}}}", fmt::join(names, ",")))
      ->check(CLI::IsMember(names));
  command
      ->add_option("--data", arguments->data,
                   "folder with the sequences: TUM freiburg3 (rgbd_dataset_freiburg3_walking_xyz, "
                   "fr3_w_xyz, walking_xyz, ...), fr1_rpy, bonn_*, kitchen_*, yard_*")
      ->required();
  command
      ->add_option("--model", arguments->models,
                   "network (.onnx) for all presets, or PRESET=FILE for one; may be repeated")
      ->allow_extra_args(false);
  command->add_flag("--true-masks", arguments->true_masks,
                    "take the masks of SEQUENCE/mask, where there are any, instead of a network");
  command
      ->add_option("--sequences", arguments->sequences,
                   "only these sequences; folders of other names must be named here")
      ->delimiter(',');
  command
      ->add_option("--runs", arguments->runs,
                   "runs per preset and sequence; run n begins at frame n")
      ->capture_default_str();
  command->add_option("--frames", arguments->frames, "use only the first frames; 0: all")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  command->add_option("--out", arguments->out, "output folder: tables, figures and runs")
      ->capture_default_str();
  add_force_option(*command, arguments->force);
  command->footer(
      "Every sequence is mapped with the preset of the paper, with the baseline orb-rgbd, and with "
      "fused.\n"
      "Files: PAPER.md, PAPER.tex, PAPER.json, PAPER_trajectories.png and .svg, and a folder per "
      "run in runs/\n"
      "Examples:\n"
      "  stillmap reproduce seg-mask --data tum --model yolov8n-seg.onnx\n"
      "  stillmap reproduce all --data tum --model yolo11n-seg.onnx --model "
      "seg-mask=yolov8n-seg.onnx --model gated-seg=yolov8n-seg.onnx --model box-flow=yolo11n.onnx");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
