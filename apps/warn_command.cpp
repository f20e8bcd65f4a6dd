// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/print.hpp"
#include "stillmap/evaluate/mover_error.hpp"
#include "stillmap/report/live_trajectory.hpp"

#include <filesystem>
#include <fstream>
#include <map>
#include <utility>

#include "commands.hpp"
#include "warning_options.hpp"
#include "warning_recorder.hpp"

namespace stillmap {
namespace {
namespace fs = std::filesystem;

struct WarnArguments {
  std::string run, zones, out;
  std::vector<double> hook_offset;
  bool force = false;
};

/// Returns a timestamp in microseconds: the files of a run have six to nine decimals.
std::int64_t microseconds(double timestamp) { return std::llround(timestamp * 1e6); }

/// Returns the confidence of the class of each mover by time and id, as movers.jsonl has them; none
/// without the file.
std::map<std::pair<std::int64_t, int>, double> class_confidences(const fs::path& file) {
  std::map<std::pair<std::int64_t, int>, double> confidences;
  std::ifstream lines(file);
  for (std::string line; std::getline(lines, line);) {
    const auto frame = nlohmann::json::parse(line, nullptr, /*allow_exceptions=*/false);
    if (!frame.is_object())
      throw Error("has a line that is no JSON object", file.string(), "run `stillmap run` again");
    const std::int64_t time = microseconds(frame.value("timestamp", 0.0));
    for (const auto& mover : frame.value("movers", nlohmann::json::array()))
      confidences[{time, mover.value("id", 0)}] = mover.value("class_confidence", 0.0);
  }
  return confidences;
}

/// Returns the frames of a run folder by time, with camera and movers as its files have them.
std::vector<WatchedFrame> watched_frames(const fs::path& run) {
  std::map<std::int64_t, WatchedFrame> frames;
  for (const LiveFrame& frame : read_live_frames(run / kLiveTrajectory))
    frames[microseconds(frame.timestamp)].timestamp = frame.timestamp;
  for (const StampedPose& pose : read_trajectory(run / "trajectory.txt")) {
    WatchedFrame& frame = frames[microseconds(pose.timestamp)];
    frame.timestamp = pose.timestamp;
    frame.T_world_camera = pose.T_world_camera;
  }
  auto confidences = class_confidences(run / "movers.jsonl");
  for (const MoverPosition& mover : read_movers(run / "movers.csv")) {
    const std::int64_t time = microseconds(mover.timestamp);
    const auto frame = frames.find(time);
    if (frame == frames.end()) continue;
    frame->second.movers.push_back({.id = mover.id,
                                    .class_name = mover.class_name,
                                    .confidence = confidences[{time, mover.id}],
                                    .observed = mover.observed,
                                    .centroid = mover.centroid,
                                    .velocity = mover.velocity,
                                    .box = mover.box});
  }
  std::vector<WatchedFrame> list;
  for (auto& [time, frame] : frames) {
    frame.index = list.size();
    list.push_back(std::move(frame));
  }
  return list;
}

int warn(const WarnArguments& arguments) {
  const WarningRules rules = read_warning_rules(arguments.zones, hook_at(arguments.hook_offset));
  const auto frames = watched_frames(arguments.run);
  ResultFolder folder(
      arguments.out.empty() ? fs::path(arguments.run) : fs::path(arguments.out),
      arguments.force ? ResultFolder::Foreign::kOverwrite : ResultFolder::Foreign::kKeep);
  WarningRecorder recorder(rules, folder, {});
  for (const WatchedFrame& frame : frames) recorder.add(frame);
  folder.require_all();
  print_out("{} warnings in {} frames: {}\n", recorder.warnings(), frames.size(),
            (folder.path() / kRunWarnings).string());
  return kSuccess;
}

}  // namespace

void add_warn_command(CLI::App& app, int& exit_code) {
  auto arguments = std::make_shared<WarnArguments>();
  CLI::App* command = app.add_subcommand(
      "warn", "evaluate zones and distances of moving objects on a finished run");
  command->add_option("run", arguments->run, "folder of results of stillmap run")->required();
  command
      ->add_option("--zones", arguments->zones, "YAML file of zones and distances (docs/view.md)")
      ->required();
  add_hook_offset(*command, arguments->hook_offset);
  command->add_option("--out", arguments->out,
                      "folder of events.jsonl; default: the folder of the run");
  add_force_option(*command, arguments->force);
  command->footer(
      "Example:\n"
      "  stillmap warn results --zones zones.yaml\n"
      "`stillmap run --zones zones.yaml` warns during the run. An aid, no safety device.");
  command->callback([arguments, &exit_code] { exit_code = warn(*arguments); });
}

}  // namespace stillmap
