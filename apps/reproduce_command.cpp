// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/finding_json.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"

#include <algorithm>
#include <iterator>
#include <memory>

#include "commands.hpp"
#include "crane_experiment.hpp"
#include "interrupt.hpp"
#include "preset_runs.hpp"
#include <fmt/format.h>
#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr const char* kCrane = "crane";
constexpr const char* kAll = "all";

std::vector<Paper> papers_of(const ReproduceArguments& arguments) {
  if (arguments.paper == kAll) return papers();
  if (arguments.paper == kCrane) return {};
  return {find_paper(arguments.paper)};
}

/// The experiment: which presets map which sequences.
struct Experiment {
  std::vector<BenchmarkSequence> sequences;
  std::vector<std::string> presets;   ///< Presets and variants.
  std::vector<std::string> left_out;  ///< Presets that detect nothing without a network.
  std::vector<FinishedRun> foreign;   ///< Runs of other systems.
  Comparands comparands;
};

/// Returns the presets of papers.
std::vector<std::string> presets_of(const std::vector<Paper>& papers) {
  std::vector<std::string> presets;
  for (const Paper& paper : papers) presets.push_back(paper.preset);
  return presets;
}

Experiment experiment_of(const ReproduceArguments& arguments, const std::vector<Paper>& papers) {
  Experiment experiment;
  experiment.sequences = find_benchmark_sequences(arguments.data, arguments.sequences);
  experiment.presets = {kPaperBaseline};
  std::ranges::copy(presets_of(papers), std::back_inserter(experiment.presets));
  experiment.presets.emplace_back(kOwnSystem);
  for (const Variant& variant : variants_of(arguments)) {
    experiment.presets.push_back(variant.name);
    experiment.comparands.others.push_back(variant.name);
  }
  if (!experiment.sequences.empty()) {
    std::vector<std::string> names;
    for (const BenchmarkSequence& sequence : experiment.sequences) names.push_back(sequence.name);
    require_foreign_runs(arguments, names);
    experiment.foreign = read_foreign_runs(arguments, experiment.sequences);
  }
  std::ranges::copy(systems_of(experiment.foreign),
                    std::back_inserter(experiment.comparands.others));
  if (!experiment.foreign.empty())
    experiment.comparands.reference = experiment.foreign.front().figures.preset;
  const auto runs_nowhere = [&](const std::string& preset) {
    return std::none_of(
        experiment.sequences.begin(), experiment.sequences.end(),
        [&](const BenchmarkSequence& sequence) { return can_run(arguments, sequence, preset); });
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

/// Bibliographic data and published results of a paper.
struct PaperReport {
  std::string heading, protocol;
  std::vector<FigureTable> tables;
};

/// Returns the columns of the tables of a paper.
std::vector<std::string> columns_of(const Paper& paper, const Experiment& experiment) {
  std::vector<std::string> columns{kPaperBaseline, paper.preset, kOwnSystem};
  const auto& others = experiment.comparands.others;
  columns.insert(columns.end(), others.begin(), others.end());
  return columns;
}

PaperReport report_of(const Paper& paper, const ReproduceArguments& arguments,
                      const Experiment& experiment, const std::vector<FinishedRun>& runs) {
  PaperReport report;
  report.heading =
      fmt::format("{} ({} {}): {}", paper.preset, paper.authors, paper.year, paper.title);
  report.protocol = fmt::format("{} Improvement rates are over {}. Published figures: {}.",
                                protocol_of(arguments, runs, columns_of(paper, experiment)),
                                experiment.comparands.reference, paper.source);
  report.tables = paper_tables(paper, figures_of(runs), experiment.comparands);
  return report;
}

std::string markdown_of(const PaperReport& report, const std::string& remarks) {
  std::string text = fmt::format("# {}\n\n{}\n", report.heading, report.protocol);
  for (const FigureTable& table : report.tables) text += "\n" + table_markdown(table);
  return remarks.empty() ? text : text + "\n" + remarks;
}

/// Returns the reasons not to trust some of the runs, as a list.
std::string untrusted_text(const std::vector<Finding>& findings) {
  if (findings.empty()) return "";
  std::string text = "Runs that should not be trusted:\n\n";
  for (const Finding& finding : findings) text += "- " + finding.text() + "\n";
  return text;
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
  const std::vector<PaperRun> runs = figures_of(finished);
  const PaperReport report = report_of(paper, arguments, experiment, finished);
  const std::vector<std::string> columns = columns_of(paper, experiment);
  const std::vector<std::string> missing = missing_sequences({paper}, experiment);
  const std::vector<Finding> findings = findings_of(finished, columns);
  std::vector<std::string> remarks{left_out_text(experiment), untrusted_text(findings),
                                   missing_text(missing)};
  std::erase(remarks, "");
  const std::string text = markdown_of(report, fmt::format("{}", fmt::join(remarks, "\n")));
  print_out("\n{}\n", text);
  nlohmann::json json{{"stillmap", STILLMAP_VERSION},
                      {"paper", paper.preset},
                      {"title", paper.title},
                      {"source", paper.source},
                      {"tables", report.tables},
                      {"protocol", report.protocol},
                      {"findings", findings},
                      {"missing_sequences", missing},
                      {"presets_left_out", experiment.left_out}};
  json["runs"] = nlohmann::json::array();
  for (const PaperRun& run : runs) {
    if (std::find(columns.begin(), columns.end(), run.preset) != columns.end())
      json["runs"].push_back(run);
  }
  folder.write_text(paper.preset + ".md", text);
  folder.write_text(paper.preset + ".tex", latex_of(report));
  folder.write_text(paper.preset + ".json", json_text(json, 2) + "\n");
  write_paths(first_paths(finished, columns), paper.preset, folder);
}

constexpr const char* kSummary = "summary.md";

/// Writes the tables of all systems, each between the markers of `lab paper_docs`.
void write_summary(const ReproduceArguments& arguments, const std::vector<FinishedRun>& finished,
                   const Experiment& experiment, ResultFolder& folder) {
  std::vector<std::string> systems;
  for (const FinishedRun& run : finished) {
    if (std::find(systems.begin(), systems.end(), run.figures.preset) == systems.end())
      systems.push_back(run.figures.preset);
  }
  const auto tables =
      summary_tables(figures_of(finished), systems, experiment.comparands.reference);
  std::string text = fmt::format("{}\n", protocol_of(arguments, finished, systems));
  for (const auto& [name, table] : tables) {
    text += fmt::format("\n<!-- table: {} -->\n\n{}\n<!-- end of table -->\n", name,
                        table_markdown(table));
  }
  folder.write_text(kSummary, text);
}

/// Returns those of the presets that are not left out.
std::vector<std::string> runnable(const Experiment& experiment, std::vector<std::string> presets) {
  std::erase_if(presets, [&](const std::string& preset) {
    return std::find(experiment.presets.begin(), experiment.presets.end(), preset) ==
           experiment.presets.end();
  });
  return presets;
}

/// Repeats the experiments of these papers on the sequences of the data folder, and prints the
/// tables of each paper as soon as its runs are done. Returns the problems of the runs.
std::vector<std::string> reproduce(const std::vector<Paper>& chosen,
                                   const ReproduceArguments& arguments, ResultFolder& folder) {
  if (arguments.data.empty()) {
    throw Error("the folder with the sequences is missing", "reproduce", "add --data DIR");
  }
  const Experiment experiment = experiment_of(arguments, chosen);
  const std::string missing = missing_text(missing_sequences(chosen, experiment));
  if (experiment.sequences.empty()) {
    throw Error(
        "contains no sequence of the papers with ground truth", arguments.data,
        "get those of the papers, or name other folders in it with --sequences.\n" + missing);
  }
  std::vector<std::string> presets = experiment.presets;
  presets.insert(presets.end(), experiment.left_out.begin(), experiment.left_out.end());
  check_models(arguments, experiment.sequences, presets);
  print_out("{}{}", left_out_text(experiment), missing);
  PresetRunner runner(arguments, experiment.sequences, experiment.presets);
  std::vector<std::string> in_all_tables{kPaperBaseline, kOwnSystem};
  for (const Variant& variant : variants_of(arguments)) in_all_tables.push_back(variant.name);
  runner.run(runnable(experiment, in_all_tables));
  const auto finished = [&] {
    std::vector<FinishedRun> runs = runner.finished();
    runs.insert(runs.end(), experiment.foreign.begin(), experiment.foreign.end());
    return runs;
  };
  for (const Paper& paper : chosen) {
    runner.run(runnable(experiment, {paper.preset}));
    if (interrupted()) break;  // tables of some of the runs would compare different starts
    write_paper(paper, arguments, finished(), experiment, folder);
  }
  if (!interrupted()) write_summary(arguments, finished(), experiment, folder);
  std::vector<std::string> problems = problems_of(runner.finished());
  if (runnable(experiment, presets_of(chosen)).empty())
    problems.push_back(fmt::format("no preset of a paper was run: {}", left_out_text(experiment)));
  return problems;
}

int run(const ReproduceArguments& arguments) {
  if (arguments.runs < 1)
    throw Error("must be 1 or more", "--runs", "take 3, as the paper of seg-mask did");
  const bool of_crane = arguments.paper == kCrane;
  if (of_crane && !arguments.sequences.empty())
    throw Error("the crane has its own sequences, the yards", "--sequences", "leave it out");
  if (of_crane && arguments.frames > 0)
    throw Error("the closure error needs the whole round", "--frames", "leave it out");
  if (!arguments.baselines.empty() && arguments.frames > 0)
    throw Error("the trajectories of other systems cover whole sequences", "--frames",
                "leave out --frames or --baseline");
  const std::vector<Paper> chosen = papers_of(arguments);
  ResultFolder folder(arguments.out, arguments.foreign());
  for (const Paper& paper : chosen) folder.require_free(files_of(paper));
  if (!chosen.empty()) folder.require_free(std::vector<std::string>{kSummary});
  if (of_crane) folder.require_free(crane_files());
  catch_interrupt();
  const std::vector<std::string> problems =
      of_crane ? reproduce_crane(arguments, folder) : reproduce(chosen, arguments, folder);
  folder.require_all();
  print_out("{}", folder.written_text());
  if (!problems.empty()) print_error("stillmap: incomplete tables\n");
  for (const std::string& problem : problems) print_error("  {}\n", problem);
  if (interrupted()) {
    print_out("interrupted; the same command goes on with the runs that are left\n");
    return kInterrupted;
  }
  return problems.empty() ? kSuccess : kDoubtful;
}

}  // namespace

void add_reproduce_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<ReproduceArguments>();
  CLI::App* command = app.add_subcommand(
      "reproduce", "repeat the experiments of the four papers and print their tables");
  std::vector<std::string> names;
  for (const Paper& paper : papers()) names.push_back(paper.preset);
  names.insert(names.end(), {kCrane, kAll});
  command
      ->add_option("paper", arguments->paper,
                   "preset of a paper; all: the four papers; crane: the crane of seg-mask's paper")
      ->required()
      ->type_name("PAPER")
      ->check(CLI::IsMember(names));
  command->add_option(
      "--data", arguments->data,
      "folder with the sequences: TUM freiburg3 (rgbd_dataset_freiburg3_walking_xyz, "
      "fr3_w_xyz, walking_xyz, ...), fr1_rpy, bonn_*, kitchen_*, yard_*; "
      "crane renders its sequences if they are not there");
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
  command
      ->add_option("--variant", arguments->variants,
                   "additional column: a preset (name or file) with changed options, "
                   "NAME=PRESET[:OPTION=VALUE]...; may be repeated")
      ->allow_extra_args(false);
  command
      ->add_option("--baseline", arguments->baselines,
                   "additional column: the trajectories of another system (TUM format) in "
                   "DIR/SEQUENCE.txt or DIR/SEQUENCE_RUN.txt, NAME=DIR; improvement rates compare "
                   "with the first one instead of orb-rgbd; may be repeated")
      ->allow_extra_args(false);
  command->add_option("--schedule", arguments->schedule, "lockstep (default) or realtime")
      ->check(CLI::IsMember({"lockstep", "realtime"}));
  command->add_flag("--maps", arguments->maps,
                    "also write dense maps and the figures of the methods to the folders of the "
                    "runs, and count ghosts in sequences with true masks");
  command->add_option("--width", arguments->width, "crane: width of the rendered images [pixels]")
      ->capture_default_str();
  command->add_option("--out", arguments->out, "output folder: tables, figures and runs")
      ->capture_default_str();
  add_force_option(*command, arguments->force);
  add_quiet_option(*command);
  command->footer(
      "Every sequence is mapped with the baseline orb-rgbd, with fused, and with the preset of the "
      "paper,\n"
      "whose tables are printed as soon as its runs are done. crane takes the presets of all "
      "papers.\n"
      "After an interrupt the same command goes on: complete runs are not repeated, unless the "
      "program,\n"
      "a network or an option has changed.\n"
      "Files: PAPER.md, PAPER.tex, PAPER.json, PAPER_trajectories.png and .svg, summary.md of all "
      "systems,\n"
      "and a folder per run in runs/\n"
      "Examples:\n"
      "  stillmap reproduce crane\n"
      "  stillmap reproduce seg-mask --data tum --model yolov8n-seg.onnx\n"
      "  stillmap reproduce all --data tum --model yolo11n-seg.onnx --model "
      "seg-mask=yolov8n-seg.onnx --model gated-seg=yolov8n-seg.onnx --model box-flow=yolo11n.onnx\n"
      "  stillmap reproduce gated-seg --data tum --model yolov8n-seg.onnx --variant "
      "no-eq9=gated-seg:map.landmark_rules=[] --baseline ORB-SLAM3=trajectories");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
