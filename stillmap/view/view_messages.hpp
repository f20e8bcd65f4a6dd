// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/semantic_files.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/pipeline/slam_system.hpp"
#include "stillmap/slam.hpp"
#include "stillmap/view/cloud_chunks.hpp"
#include "stillmap/view/ground.hpp"
#include "stillmap/warn/rules.hpp"

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>

/// The messages of the view; docs/view.md has their formats. World frame of the trajectory, meters,
/// seconds.
namespace stillmap {

/// State of the camera in a frame, as the page shows it.
enum class ViewedState : std::uint8_t { kTracked = 0, kLost = 1, kRelocalized = 2, kOdometry = 3 };

/// Returns the state that the page shows for a frame.
ViewedState viewed_state(const FrameRecord& record);

/// A frame on the camera's path.
struct PathFrame {
  double timestamp = 0;  ///< [s]
  ViewedState state = ViewedState::kTracked;
  Pose T_world_camera;  ///< The last known pose while the camera is lost.
};

/// Returns the camera's path: frames of `states` with the poses of `trajectory` that have the same
/// timestamp; both by ascending timestamps. Frames before the first pose, and frames with a state
/// other than kLost but without a pose, are left out.
std::vector<PathFrame> camera_path(const std::vector<PathFrame>& states,
                                   const Trajectory& trajectory);

/// Returns the path as a binary message.
std::string path_message(const std::vector<PathFrame>& path);

/// Returns an image of the frame with masks and keypoints as a binary message with a JPEG file.
std::string image_message(const TrackedFrame& tracked);

/// What a page shows.
enum class Viewed : std::uint8_t { kRunInProgress, kFinishedRun, kSavedMap, kCloud, kMapChanges };

/// Returns what is constant while something is shown: type "run".
nlohmann::json run_message(const std::string& name, const Camera& camera,
                           std::optional<std::size_t> frames, Viewed viewed);

/// Returns the result of one frame: type "frame".
/// @param tracked  number of frames with a pose so far
nlohmann::json frame_message(const FrameRecord& record, const std::optional<Pose>& T_world_camera,
                             const LoadShedding& shedding, std::size_t tracked);

/// Returns the moving objects at one time: type "movers".
nlohmann::json movers_message(const std::vector<Mover>& movers);

/// Returns the tracks of the moving objects of a whole run: type "tracks".
nlohmann::json tracks_message(const std::vector<MoverTrack>& tracks);

/// Returns keyframes, loops and ground: type "map".
nlohmann::json map_message(const std::vector<Pose>& keyframes, const std::vector<MapEvent>& events,
                           const Ground& ground);

/// Returns the points that move with the camera, with the distances of their rules: type "points".
nlohmann::json points_message(const WarningRules& rules);

/// Returns the message that follows the chunks of a cloud: type "cloud".
nlohmann::json cloud_message(std::size_t points, const MapCost& cost);

/// Returns the static objects: type "objects".
nlohmann::json objects_message(const std::vector<StaticObject>& objects);

/// Returns names and colors of the classes 1, 2, 3 ...: type "palette".
nlohmann::json palette_message(const std::vector<ClassColor>& classes);

/// Returns colors of classes that stay the same when further classes are added.
std::vector<ClassColor> lasting_colors(const std::vector<std::string>& classes);

}  // namespace stillmap
