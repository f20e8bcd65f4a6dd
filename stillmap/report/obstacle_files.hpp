// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/floor.hpp"
#include "stillmap/dense/obstacles.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/report/live_lines.hpp"
#include "stillmap/report/run_sink.hpp"

#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// The frame of the files for planners.
struct PlannerFrame {
  std::string name;  ///< "map" (z up from the floor), or "first camera" if the floor is unknown.
  Pose T_map_world;
};

/// Returns a pose as [tx, ty, tz, qx, qy, qz, qw].
nlohmann::json pose_json(const Pose& pose);

/// Returns the static obstacles: {"frame": name, "T_map_world": pose, "obstacles": [{"id",
/// "center", "size", "piece", "yaw"}]}, see StaticObstacle; meters and radians.
nlohmann::json obstacles_json(const std::vector<StaticObstacle>& obstacles,
                              const PlannerFrame& frame);

/// Returns the static obstacles and, for every frame, the moving ones: one JSON object per line.
/// The first is {"frame", "T_map_world", "static": [as in obstacles_json()]}, the others are
/// {"timestamp", "camera": [x, y, z], "movers": [{"id", "class", "state" (as state_of()),
/// "centroid", "velocity", "box": {"min", "max"}}]}; meters and m/s. Frames without a pose have no
/// line. The box of a mover is the bounding box of its rotated
/// box in the world.
/// @param movers  tracks in the trajectory's world; may be empty
std::string obstacles_by_frame(const std::vector<StaticObstacle>& obstacles,
                               const PlannerFrame& frame, const Trajectory& trajectory,
                               const std::vector<MoverTrack>& movers);

/// Name of the file of LiveObstacles.
constexpr const char* kLiveObstacles = "obstacles_live.jsonl";

/// The movers during a run, for planners: one JSON object per line, each written with its frame.
/// The first is {"frame", "T_map_world"}, the others are those of obstacles_by_frame(), from the
/// first frame with a pose on; frames without a pose have the camera null and no movers. The frame
/// is "map" if the floor, or both the upward direction and the height of the camera, were given;
/// otherwise that of the first camera, since a floor is only found in the whole map. Poses are
/// those of tracking, before later corrections.
class LiveObstacles final : public RunSink {
 public:
  /// Starts the file. A problem is kept for ResultFolder::require_all().
  LiveObstacles(ResultFolder& folder, const FloorHints& hints);
  void on_frame(SlamSystem& slam) override;
  /// @param movers  as known now, in the world of the pose
  /// @param movers_time  of the frame that they are of [s], "movers_time": in realtime an earlier
  /// one
  void add(double timestamp, const std::optional<Pose>& T_world_camera,
           const std::vector<Mover>& movers, std::optional<double> movers_time);

 private:
  void begin(const Pose& T_world_camera);

  LiveLines lines_;
  FloorHints hints_;
  std::optional<PlannerFrame> frame_;  // none before the first pose
};

}  // namespace stillmap
