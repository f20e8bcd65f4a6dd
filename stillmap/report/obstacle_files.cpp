// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/obstacle_files.hpp"

#include "stillmap/base/json_text.hpp"

#include <cmath>
#include <map>

#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

nlohmann::json triple(const Eigen::Vector3d& v) {
  const auto rounded = [](double x) { return std::round(x * 1e3) / 1e3; };  // millimeters
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

nlohmann::json box_json(const Eigen::AlignedBox3d& box) {
  return {{"min", triple(box.min())}, {"max", triple(box.max())}};
}

nlohmann::json statics(const std::vector<StaticObstacle>& obstacles) {
  nlohmann::json list = nlohmann::json::array();
  for (const StaticObstacle& obstacle : obstacles) {
    list.push_back({{"id", obstacle.id},
                    {"center", triple(obstacle.center)},
                    {"size", triple(obstacle.size)},
                    {"piece", obstacle.piece},
                    {"yaw", std::round(obstacle.yaw * 1e4) / 1e4}});
  }
  return list;
}

nlohmann::json mover_in_map(const MoverTrack& track, const MoverSample& sample,
                            const Pose& T_map_world) {
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    box.extend(T_map_world *
               sample.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  return {{"id", track.id},
          {"class", track.class_name},
          {"centroid", triple(T_map_world * sample.centroid)},
          {"velocity", triple(T_map_world.quaternion() * sample.velocity)},
          {"box", box_json(box)}};
}

/// Returns the movers of each frame that has any, by timestamp, in order of their ids.
std::map<double, nlohmann::json> movers_by_frame(const std::vector<MoverTrack>& tracks,
                                                 const Pose& T_map_world) {
  std::map<double, nlohmann::json> movers;
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& sample : track.samples)
      movers[sample.timestamp].push_back(mover_in_map(track, sample, T_map_world));
  }
  return movers;
}

}  // namespace

nlohmann::json pose_json(const Pose& pose) {
  const Eigen::Vector3d& t = pose.translation();
  const Eigen::Quaterniond& q = pose.quaternion();
  return {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()};
}

nlohmann::json obstacles_json(const std::vector<StaticObstacle>& obstacles,
                              const PlannerFrame& frame) {
  return {{"frame", frame.name},
          {"T_map_world", pose_json(frame.T_map_world)},
          {"obstacles", statics(obstacles)}};
}

std::string obstacles_by_frame(const std::vector<StaticObstacle>& obstacles,
                               const PlannerFrame& frame, const Trajectory& trajectory,
                               const std::vector<MoverTrack>& tracks) {
  const auto movers = movers_by_frame(tracks, frame.T_map_world);
  const nlohmann::json first = {{"frame", frame.name},
                                {"T_map_world", pose_json(frame.T_map_world)},
                                {"static", statics(obstacles)}};
  std::string lines = json_text(first) + "\n";
  for (const auto& [timestamp, T_world_camera] : trajectory) {
    const auto found = movers.find(timestamp);
    const nlohmann::json line = {
        {"timestamp", timestamp},
        {"camera", triple(frame.T_map_world * T_world_camera.translation())},
        {"movers", found != movers.end() ? found->second : nlohmann::json::array()}};
    lines += json_text(line) + "\n";
  }
  return lines;
}

}  // namespace stillmap
