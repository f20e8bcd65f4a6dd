// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/evaluate/compare.hpp"

#include <fstream>

#include "commands.hpp"
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

struct CompareArguments {
  std::vector<std::string> runs;
  std::string truth, out = "comparison";
};

/// "name=path" or just "path"; the path is a trajectory, or a folder that `stillmap run` wrote.
RecordedRun read_run(const std::string& argument, const Trajectory& truth) {
  const auto equals = argument.find('=');
  const fs::path path = equals == std::string::npos ? argument : argument.substr(equals + 1);
  RecordedRun run;
  run.name = equals == std::string::npos ? path.lexically_normal().filename().string()
                                         : argument.substr(0, equals);
  run.estimate = read_trajectory(fs::is_directory(path) ? path / "trajectory.txt" : path);
  run.truth = truth;
  const fs::path summary = path / "summary.json";
  if (fs::exists(summary)) {
    const auto json = nlohmann::json::parse(read_file(summary), nullptr, false);
    if (!json.is_discarded() && json.contains("frames")) {
      run.sequence = json.value("sequence", "");
      run.total_frames = json["frames"].value("total", std::size_t{0});
    }
  }
  return run;
}

int run(const CompareArguments& arguments) {
  std::vector<RecordedRun> runs;
  const Trajectory truth = read_trajectory(arguments.truth);
  for (const std::string& argument : arguments.runs) runs.push_back(read_run(argument, truth));
  const Comparison comparison = compare_runs(runs);
  fmt::print("{}", comparison_text(comparison));
  make_output_folder(arguments.out);
  const fs::path out = arguments.out;
  write_comparison_picture(out / "comparison.png", comparison);
  write_file(out / "comparison.json", nlohmann::json(comparison).dump(2) + "\n");
  write_file(out / "comparison.txt", comparison_text(comparison));
  fmt::print("written:\n");
  for (const char* name : {"comparison.png", "comparison.json", "comparison.txt"}) {
    fmt::print("  {}\n", (out / name).string());
  }
  return kSuccess;
}

}  // namespace

void add_compare_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<CompareArguments>();
  CLI::App* command =
      app.add_subcommand("compare", "several runs of one sequence side by side, against the truth");
  command->add_option("--truth", arguments->truth, "true trajectory, TUM format")->required();
  command
      ->add_option("runs", arguments->runs,
                   "result folders or trajectories, NAME=PATH or PATH; the first is the baseline")
      ->required();
  command->add_option("--out", arguments->out, "folder for table and picture")
      ->capture_default_str();
  command->footer(
      "Example:\n"
      "  stillmap compare --truth seq/groundtruth.txt static=out_static seg-mask=out_masks "
      "orbslam3=CameraTrajectory.txt");
  command->callback([arguments, &exit_code] { exit_code = run(*arguments); });
}

}  // namespace stillmap
