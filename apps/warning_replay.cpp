// SPDX-License-Identifier: Apache-2.0
#include "warning_replay.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/evaluate/mover_error.hpp"
#include "stillmap/report/live_trajectory.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/segment/coco.hpp"

#include <cmath>
#include <fstream>
#include <map>
#include <optional>
#include <set>
#include <utility>

#include "warning_options.hpp"
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

/// Returns a timestamp in microseconds: the files of a run have six to nine decimals.
std::int64_t microseconds(double timestamp) { return std::llround(timestamp * 1e6); }

/// Returns the confidence of the class of each mover by time and id, as movers.jsonl has them; none
/// without the file.
std::map<std::pair<std::int64_t, int>, double> class_confidences(const fs::path& file) {
  std::map<std::pair<std::int64_t, int>, double> confidences;
  std::ifstream lines(file);
  with_json_of(file, "run `stillmap run` again", [&] {
    for (std::string line; std::getline(lines, line);) {
      const auto frame = nlohmann::json::parse(line);
      const std::int64_t time = microseconds(frame.value("timestamp", 0.0));
      for (const auto& mover : frame.value("movers", nlohmann::json::array()))
        confidences[{time, mover.value("id", 0)}] = mover.value("class_confidence", 0.0);
    }
  });
  return confidences;
}

/// Whether the summary of a run says that it had neither a network nor masks.
bool had_no_detector(const fs::path& summary_file) {
  if (!fs::exists(summary_file)) return false;
  const auto summary = nlohmann::json::parse(read_file(summary_file), nullptr,
                                             /*allow_exceptions=*/false);
  return summary.is_object() && summary.contains("detector") && summary["detector"].is_null();
}

/// Returns the classes that movers of a finished run can have: those of COCO and those that its
/// movers have. None if it had neither a network nor masks.
std::optional<std::vector<std::string>> classes_of(const fs::path& run) {
  std::set<std::string> found;
  for (const MoverPosition& mover : read_movers(run / "movers.csv")) found.insert(mover.class_name);
  found.erase(kNoClass);
  if (found.empty() && had_no_detector(run / kRunSummary)) return std::nullopt;
  found.insert(coco_class_names().begin(), coco_class_names().end());
  return std::vector(found.begin(), found.end());
}

}  // namespace

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

WarningRules rules_for(const fs::path& run, const std::string& zones,
                       const std::vector<double>& hook_offset) {
  if (!fs::exists(run / "trajectory.txt"))
    throw Error("is no folder of results: it has no trajectory.txt", run.string(),
                "name the folder that `stillmap run --out` wrote");
  const fs::path kept = run / kRunRules;
  if (zones.empty() && !fs::exists(kept))
    throw Error("has no rules: it was made without --zones", run.string(),
                "name a file of rules: --zones FILE.yaml");
  const fs::path file = zones.empty() ? kept : fs::path(zones);
  WarningRules rules = read_warning_rules(file, hook_at(hook_offset));
  if (!zones.empty()) check_rule_classes(rules, classes_of(run), zones);
  return rules;
}

std::vector<WarningEvent> replayed_events(const WarningRules& rules, const fs::path& run) {
  WarningMonitor monitor(rules);
  std::vector<WarningEvent> events;
  for (const WatchedFrame& frame : watched_frames(run)) {
    for (WarningEvent& event : monitor.update(frame)) events.push_back(std::move(event));
  }
  return events;
}

}  // namespace stillmap
