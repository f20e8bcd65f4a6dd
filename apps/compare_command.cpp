// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/finding_json.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/evaluate/truth_findings.hpp"
#include "stillmap/report/comparison_chart.hpp"
#include "stillmap/report/comparison_page.hpp"
#include "stillmap/report/result_folder.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cctype>
#include <set>
#include <string>
#include <vector>

#include "commands.hpp"
#include "terminal.hpp"
#include "truth.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

// Files of the output folder.
constexpr const char* kPage = "comparison.html";
const std::vector<std::string> kFiles{"comparison.html", "comparison.md",   "comparison.tex",
                                      "comparison.csv",  "comparison.json", "comparison.svg",
                                      "errors.svg"};

struct CompareArguments {
  std::vector<std::string> runs;
  std::string truth, truth_frame, out = "comparison";
  bool force = false;
};

/// Returns the folder of the run that wrote a trajectory, to which path may also point itself.
fs::path run_folder_of(const fs::path& path) {
  if (fs::is_directory(path)) return path;
  const bool is_of_run = path.filename().string().starts_with("trajectory");
  return is_of_run && fs::exists(path.parent_path() / kRunSummary) ? path.parent_path() : path;
}

/// Name and file or folder of a compared run.
struct NamedPath {
  std::string name;
  fs::path path;
};

/// Reads "name=path" or "path".
NamedPath named_path(const std::string& argument) {
  const auto equals = argument.find('=');
  const fs::path path = equals == std::string::npos ? argument : argument.substr(equals + 1);
  return {equals == std::string::npos ? path.lexically_normal().filename().string()
                                      : argument.substr(0, equals),
          path};
}

/// Returns the images of the maps of the runs that have one.
std::vector<CaptionedImage> maps_of(const std::vector<std::string>& arguments) {
  std::vector<CaptionedImage> maps;
  for (const std::string& argument : arguments) {
    const auto [name, path] = named_path(argument);
    const fs::path file = run_folder_of(path) / "cloud.png";
    if (fs::exists(file)) maps.push_back({read_stored_image(file).image, name});
  }
  return maps;
}

/// Reads "name=path" or "path": a trajectory, or a folder written by `stillmap run`. All runs are
/// of the sequence with this truth, so that the first is the baseline of all others.
/// @param sequences  gets the name of the run's sequence, if it is known
RecordedRun read_run(const std::string& argument, const Trajectory& truth,
                     const CompareArguments& arguments, std::set<std::string>& sequences) {
  const auto [name, path] = named_path(argument);
  RecordedRun run;
  run.name = name;
  if (run.name.empty()) throw Error("has no name before '='", argument, "name the run: NAME=PATH");
  if (std::any_of(run.name.begin(), run.name.end(),
                  [](unsigned char c) { return std::iscntrl(c) != 0; }))
    throw Error("has a line break or another control character in its name", argument,
                "name the run: NAME=PATH");
  if (fs::is_directory(path)) require_ended_run(path);
  const fs::path file = fs::is_directory(path) ? path / "trajectory.txt" : path;
  run.estimate = read_trajectory(file);
  run.truth = truth;
  const fs::path summary = run_folder_of(path) / kRunSummary;
  if (fs::exists(summary)) {
    run.total_frames = with_json_of(summary, "name the trajectory instead of the folder", [&] {
      const auto json = nlohmann::json::parse(read_file(summary));
      sequences.insert(json.at("sequence").get<std::string>());
      run.findings = findings_on_trajectory(json.value("findings", std::vector<Finding>()));
      return json.at("frames").at("total").get<std::size_t>();
    });
  }
  auto unlike = truth_findings(
      truth, run.estimate,
      {arguments.truth, file.string(), truth_frame_of(arguments.truth, arguments.truth_frame)});
  for (Finding& finding : unlike) finding.severity = Severity::kUntrusted;
  append(std::move(unlike), run.findings);
  return run;
}

/// Throws Error for two runs of one name, which tables and charts would not tell apart.
void require_different_names(const std::vector<RecordedRun>& runs) {
  std::set<std::string> names;
  for (const RecordedRun& run : runs) {
    if (!names.insert(run.name).second)
      throw Error("is the name of two runs", run.name, "name them: NAME=PATH");
  }
}

int run(const CompareArguments& arguments) {
  ResultFolder folder(arguments.out, arguments.force ? ResultFolder::Foreign::kOverwrite
                                                     : ResultFolder::Foreign::kKeep);
  folder.require_free(kFiles);
  std::vector<RecordedRun> runs;
  const Trajectory truth = true_camera_trajectory(
      arguments.truth, truth_frame_of(arguments.truth, arguments.truth_frame));
  std::set<std::string> sequences;
  for (const std::string& argument : arguments.runs)
    runs.push_back(read_run(argument, truth, arguments, sequences));
  require_different_names(runs);
  if (sequences.size() > 1) {
    warn(fmt::format("the runs are of sequences with different names: {}",
                     fmt::join(sequences, ", ")),
         "compare runs of one recording, that of --truth");
  }
  const Comparison comparison = compare_runs(runs);
  const std::vector<FigureTable> tables = comparison_tables(comparison);
  for (const std::string& note : tables.front().notes)
    warn(note, "compare runs that have poses for nearly all frames");
  const std::string table = comparison_markdown(comparison);
  print_out("{}", table);
  folder.write_text("comparison.md", table);
  folder.write_text("comparison.tex", comparison_latex(comparison));
  folder.write_text("comparison.csv", comparison_csv(comparison));
  folder.write_text("comparison.json", json_text(comparison, 2) + "\n");
  folder.write_text("comparison.svg", comparison_chart(comparison).file());
  folder.write_text("errors.svg", error_distribution_chart(comparison).file());
  folder.write_text(kPage, comparison_page(comparison, {kFiles.begin() + 1, kFiles.end()},
                                           maps_of(arguments.runs)));
  folder.require_all();
  print_out("{}{}", folder.written_text(), open_line(folder.path() / kPage));
  return print_findings(findings_of(comparison));
}

}  // namespace

void add_compare_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command =
      app.add_subcommand("compare", "compare several runs of one sequence with the ground truth");
  command->add_option("--truth", arguments->truth, "ground truth trajectory, TUM format")
      ->required();
  add_truth_frame_option(*command, arguments->truth_frame);
  command
      ->add_option("runs", arguments->runs,
                   "result folders or trajectories, NAME=PATH or PATH; the first is the baseline")
      ->required();
  command
      ->add_option("--out", arguments->out,
                   "output folder: page, tables (Markdown, LaTeX, CSV, JSON) and charts")
      ->capture_default_str();
  add_force_option(*command, arguments->force);
  command->footer(
      "Example:\n"
      "  stillmap compare --truth seq/groundtruth.txt static=out_static seg-mask=out_masks "
      "orbslam3=CameraTrajectory.txt");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
