// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/recorded_view.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/pipeline/map_description.hpp"
#include "stillmap/report/live_trajectory.hpp"
#include "stillmap/report/mover_files.hpp"
#include "stillmap/report/planner_files.hpp"
#include "stillmap/report/run_folder.hpp"
#include "stillmap/view/changes_message.hpp"
#include "stillmap/view/cloud_chunks.hpp"
#include "stillmap/view/message_bytes.hpp"
#include "stillmap/view/planner_message.hpp"
#include "stillmap/view/run_images.hpp"
#include "stillmap/view/view_messages.hpp"
#include "stillmap/warn/warning_monitor.hpp"

#include <algorithm>
#include <array>
#include <map>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

void publish_cloud(TopicBoard& board, const Cloud& cloud,
                   std::span<const std::uint16_t> labels = {}) {
  CloudChunks none;
  board.publish(cloud_message(cloud.size(), publish_changes(board, none, cloud, labels)));
}

constexpr const char* kRunAgain = "run `stillmap run` again";

/// Calls a function with the content of a JSON file and returns what it returns; see
/// with_json_of().
template <typename Read>
auto with_content_of(const fs::path& file, Read&& read) {
  return with_json_of(file, kRunAgain,
                      [&] { return read(nlohmann::json::parse(read_file(file))); });
}

/// The values of a run's summary that are drawn.
struct DrawnSummary {
  nlohmann::json all = nlohmann::json::object();
  std::string sequence = {}, recording = {};
  Camera camera = {};
  std::set<double> relocalized = {};  // timestamps
  std::vector<MapEvent> events = {};
};

/// Returns the camera of a summary, as far as it is drawn.
Camera drawn_camera(const nlohmann::json& summary) {
  Camera camera;
  const auto json = summary.find("camera");
  if (json == summary.end() || !json->contains("focal_lengths")) return camera;
  camera.width = json->at("size").at(0);
  camera.height = json->at("size").at(1);
  camera.fx = json->at("focal_lengths").at(0);
  camera.fy = json->at("focal_lengths").at(1);
  camera.cx = json->at("principal_point").at(0);
  camera.cy = json->at("principal_point").at(1);
  return camera;
}

DrawnSummary drawn_summary(const fs::path& run) {
  DrawnSummary drawn{.sequence = run.filename().string()};
  const fs::path file = run / kRunSummary;
  if (!fs::exists(file)) return drawn;
  with_content_of(file, [&](const nlohmann::json& summary) {
    drawn.all = summary;
    drawn.sequence = summary.value("sequence", drawn.sequence);
    if (summary.contains("recording") && summary["recording"].is_string())
      drawn.recording = summary["recording"];
    drawn.camera = drawn_camera(summary);
    for (const auto& event : summary.value("relocalizations", nlohmann::json::array()))
      drawn.relocalized.insert(event.value("timestamp", 0.0));
    const auto add = [&](const char* list, MapEvent::Kind kind) {
      for (const auto& event : summary.value(list, nlohmann::json::array())) {
        drawn.events.push_back({.kind = kind,
                                .frame_index = event.value("frame", std::size_t{0}),
                                .timestamp = event.value("timestamp", 0.0),
                                .seen_in = event.value("seen_in", std::size_t{0})});
      }
    };
    add("loops", MapEvent::Kind::kLoop);
    add("merges", MapEvent::Kind::kMerge);
  });
  return drawn;
}

/// Returns the states of all frames, by ascending timestamps.
std::vector<PathFrame> states_of(const fs::path& run, const Trajectory& trajectory,
                                 const std::set<double>& relocalized) {
  const auto is_relocalized = [&](double timestamp) {  // the files have six to nine decimals
    const auto next = relocalized.lower_bound(timestamp - 1e-5);
    return next != relocalized.end() && *next < timestamp + 1e-5;
  };
  std::vector<PathFrame> states;
  for (const StampedPose& pose : trajectory) {
    states.push_back(
        {pose.timestamp,
         is_relocalized(pose.timestamp) ? ViewedState::kRelocalized : ViewedState::kTracked,
         {}});
  }
  for (const auto& [timestamp, has_pose] : read_live_frames(run / kLiveTrajectory)) {
    if (has_pose) continue;
    const bool tracked_late = std::any_of(
        trajectory.begin(), trajectory.end(),
        [time = timestamp](const auto& p) { return std::abs(p.timestamp - time) < 1e-5; });
    if (!tracked_late) states.push_back({timestamp, ViewedState::kLost, {}});
  }
  std::sort(states.begin(), states.end(),
            [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return states;
}

/// Returns the classes of the objects of a run, in the colors of its clouds.
std::vector<ClassColor> classes_of(const nlohmann::json& objects) {
  SemanticMap semantics;
  for (const auto& object : objects) {
    semantics.objects.emplace_back();
    semantics.objects.back().class_name = object.value("class", "");
  }
  return class_colors(semantics);
}

/// Returns the class of each point of a cloud that is colored by class; 0 for none.
std::vector<std::uint16_t> labels_by_color(const Cloud& cloud,
                                           const std::vector<ClassColor>& classes) {
  std::map<Rgb, std::uint16_t> label_of;
  for (const ClassColor& entry : classes)
    label_of.emplace(entry.color, static_cast<std::uint16_t>(label_of.size() + 1));
  std::vector<std::uint16_t> labels;
  labels.reserve(cloud.size());
  for (const Rgb& color : cloud.colors) {
    const auto found = label_of.find(color);
    labels.push_back(found == label_of.end() ? std::uint16_t{0} : found->second);
  }
  return labels;
}

/// Returns the content of objects.json; empty without the file.
nlohmann::json publish_objects_of(const fs::path& run, TopicBoard& board) {
  nlohmann::json objects = nlohmann::json::array();
  if (!fs::exists(run / "objects.json")) return objects;
  objects = with_content_of(run / "objects.json", [&](const nlohmann::json& json) {
    return json.value("objects", objects);
  });
  board.publish({{"type", "objects"}, {"objects", objects}});
  return objects;
}

void publish_mesh_of(const fs::path& run, TopicBoard& board) {
  if (!fs::exists(run / "mesh.glb")) return;
  MessageBytes bytes(BinaryMessage::kMesh);
  bytes.add_bytes(read_file(run / "mesh.glb"));
  board.publish("mesh", bytes.take(), true);
}

/// Publishes objects, cloud and mesh of a folder; returns the cloud.
Cloud publish_surfaces_of(const fs::path& run, TopicBoard& board) {
  const nlohmann::json objects = publish_objects_of(run, board);
  publish_mesh_of(run, board);
  if (!fs::exists(run / "cloud.ply")) return {};
  Cloud cloud = read_ply(run / "cloud.ply");
  std::vector<std::uint16_t> labels;
  if (fs::exists(run / "semantic_classes.ply")) {
    const std::vector<ClassColor> classes =
        with_json_of(run / "objects.json", kRunAgain, [&] { return classes_of(objects); });
    labels = labels_by_color(read_ply(run / "semantic_classes.ply"), classes);
    if (labels.size() != cloud.size()) labels.clear();
    if (!labels.empty()) board.publish(palette_message(classes));
  }
  publish_cloud(board, cloud, labels);
  return cloud;
}

/// Returns the id of the track that was nearest to a position at a time; 0 if none was within half
/// a meter.
int track_at(const std::vector<MoverTrack>& tracks, double timestamp,
             const Eigen::Vector3d& position) {
  constexpr double kSameTime = 0.05;  // [s]
  int nearest = 0;
  double least = 0.5;  // [m]
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& sample : track.samples) {
      if (std::abs(sample.timestamp - timestamp) > kSameTime) continue;
      const double distance = (sample.centroid - position).norm();
      if (distance < least) least = distance, nearest = track.id;
    }
  }
  return nearest;
}

/// Publishes the warnings of a run. Movers have the numbers of their final tracks, as on the map:
/// those during the run may differ, since tracks of one mover are joined at the end. Movers without
/// a final track have negative numbers, which only distinguish them.
void publish_events_of(const fs::path& file, const std::vector<MoverTrack>& tracks,
                       TopicBoard& board) {
  std::istringstream text(read_file(file));
  with_json_of(file, "make it again with `stillmap warn`", [&] {
    std::vector<WarningEvent> events;
    for (std::string line; std::getline(text, line);)
      events.push_back(warning_of(nlohmann::json::parse(line)));
    std::vector<Warning> warnings = warnings_of(events);
    for (auto& [begin, end] : warnings) {
      if (begin.mover == 0) continue;
      const int track = track_at(tracks, begin.timestamp, begin.position);
      begin.mover = track != 0 ? track : -begin.mover;
    }
    board.publish(events_message(warnings));
  });
}

/// Returns what the files of a run tell of the ground.
/// @param first  the first camera
FloorHints floor_of(const fs::path& run, const Pose& first) {
  FloorHints hints;
  const fs::path file = run / "floor.json";
  if (!fs::exists(file)) return hints;
  with_content_of(file, [&](const nlohmann::json& json) {
    if (json.contains("floor") && json["floor"].is_object()) {
      hints.floor = read_floor(file);
    } else if (const auto up = json.find("up"); up != json.end() && up->is_array()) {
      const auto values = up->get<std::vector<double>>();
      if (values.size() == 3)
        hints.up = first.quaternion().conjugate() * Eigen::Vector3d(values.data());
    }
  });
  return hints;
}

/// Returns what is known of the ground of a run.
GroundHints ground_hints(const fs::path& run, const Trajectory& trajectory,
                         const std::optional<WarningRules>& rules) {
  GroundHints hints;
  if (rules && rules->up_is_given) hints.rules_up = rules->up;
  if (!trajectory.empty()) hints.floor = floor_of(run, trajectory.front().T_world_camera);
  return hints;
}

void publish_run_folder(const fs::path& run, const std::optional<WarningRules>& rules,
                        TopicBoard& board) {
  const DrawnSummary summary = drawn_summary(run);
  const Trajectory trajectory = read_trajectory(run / "trajectory.txt");
  board.publish(
      run_message(summary.sequence, summary.camera, trajectory.size(), Viewed::kFinishedRun));
  const auto path = camera_path(states_of(run, trajectory, summary.relocalized), trajectory);
  board.publish("path", path_message(path), true);
  std::vector<MoverTrack> tracks;
  if (fs::exists(run / "movers.csv")) {
    tracks = read_mover_tracks(run / "movers.csv");
    board.publish(tracks_message(tracks));
  }
  if (fs::exists(run / kRunWarnings)) publish_events_of(run / kRunWarnings, tracks, board);
  const Cloud cloud = publish_surfaces_of(run, board);
  std::vector<Pose> keyframes;
  if (fs::exists(run / "keyframes.txt")) {
    for (const StampedPose& keyframe : read_trajectory(run / "keyframes.txt"))
      keyframes.push_back(keyframe.T_world_camera);
  }
  board.publish(
      map_message(keyframes, summary.events,
                  displayed_ground(trajectory, cloud, ground_hints(run, trajectory, rules))));
  if (const auto planner = planner_message(run)) board.publish(*planner);
  board.publish({{"type", "summary"}, {"summary", summary.all}});
  const auto images = std::make_shared<RunImages>(summary.recording);
  board.publish({{"type", "images"}, {"problem", images->problem()}});
  board.set_images(images);
}

/// Publishes what `stillmap dense` made.
void publish_dense_folder(const fs::path& folder, const GroundHints& hints, TopicBoard& board) {
  board.publish(run_message(folder.filename().string(), Camera(), std::nullopt, Viewed::kCloud));
  const Cloud cloud = publish_surfaces_of(folder, board);
  board.publish(map_message({}, {}, displayed_ground({{}}, cloud, hints)));
  if (const auto planner = planner_message(folder)) board.publish(*planner);
}

void publish_saved_map(const fs::path& file, const GroundHints& hints, TopicBoard& board) {
  const SavedMap saved = read_saved_map(file.string());
  board.publish(
      run_message(file.filename().string(), saved.map.camera, std::nullopt, Viewed::kSavedMap));
  const Cloud cloud = saved.views.empty() ? landmark_cloud(saved) : dense_cloud(saved);
  publish_cloud(board, cloud);
  Trajectory all;
  std::vector<Pose> keyframes;
  for (const auto& [number, poses] : keyframe_trajectories(saved.map, main_component(saved))) {
    all.insert(all.end(), poses.begin(), poses.end());
    for (const StampedPose& pose : poses) keyframes.push_back(pose.T_world_camera);
  }
  board.publish(map_message(keyframes, {}, displayed_ground(all, cloud, hints)));
}

/// Publishes the map of the later visit and what changed since the earlier one.
void publish_map_changes(const fs::path& folder, const GroundHints& hints, TopicBoard& board) {
  const nlohmann::json changes = changes_message(folder);
  const std::string name = fmt::format("{} → {}", changes["before"].get<std::string>(),
                                       changes["after"].get<std::string>());
  board.publish(run_message(name, Camera(), std::nullopt, Viewed::kMapChanges));
  const Cloud cloud = read_ply(folder / "after.ply");
  publish_cloud(board, cloud);
  const Trajectory views = read_trajectory(folder / "after.txt");
  std::vector<Pose> poses;
  for (const StampedPose& view : views) poses.push_back(view.T_world_camera);
  board.publish(map_message(poses, {}, displayed_ground(views, cloud, hints)));
  board.publish(changes);
}

}  // namespace

void publish_recorded_run(const fs::path& run, const std::optional<WarningRules>& rules,
                          TopicBoard& board) {
  const GroundHints hints = ground_hints({}, {}, rules);
  if (fs::is_directory(run) && fs::exists(run / "trajectory.txt")) {
    publish_run_folder(run, rules, board);
  } else if (fs::is_directory(run) && fs::exists(run / kChangesFile)) {
    publish_map_changes(run, hints, board);
  } else if (fs::is_directory(run) && fs::exists(run / "cloud.ply")) {
    publish_dense_folder(run, hints, board);
  } else if (fs::is_regular_file(run) && run.extension() == ".ply") {
    const Cloud cloud = read_ply(run);
    board.publish(run_message(run.filename().string(), Camera(), std::nullopt, Viewed::kCloud));
    publish_cloud(board, cloud);
    board.publish(map_message({}, {}, displayed_ground({{}}, cloud, hints)));
  } else if (fs::is_regular_file(run)) {
    publish_saved_map(run, hints, board);
  } else {
    throw Error("is no folder of results, saved map or cloud", run.string(),
                "name the folder that `stillmap run`, `dense` or `map changes` wrote, FILE.map or "
                "FILE.ply");
  }
  if (!rules) return;
  board.publish(zones_message(*rules));
  board.publish(points_message(*rules));
}

}  // namespace stillmap
