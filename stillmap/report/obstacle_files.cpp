// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/obstacle_files.hpp"

#include "stillmap/base/json_text.hpp"
#include "stillmap/report/mover_files.hpp"

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

nlohmann::json mover_in_map(int id, const std::string& class_name, const MoverSample& sample,
                            const Pose& T_map_world) {
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    box.extend(T_map_world *
               sample.box.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  return {{"id", id},
          {"class", class_name},
          {"state", state_of(sample)},
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
      movers[sample.timestamp].push_back(
          mover_in_map(track.id, track.class_name, sample, T_map_world));
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

LiveObstacles::LiveObstacles(ResultFolder& folder, const FloorHints& hints)
    : lines_(folder, kLiveObstacles, ""), hints_(hints) {}

void LiveObstacles::on_frame(SlamSystem& slam) {
  const std::vector<Mover> movers = slam.movers();
  add(slam.newest_record().timestamp, slam.newest()->T_world_filtered(), movers,
      slam.movers_time());
}

void LiveObstacles::begin(const Pose& T_world_camera) {
  std::optional<Floor> known = hints_.floor;
  if (!known && hints_.up && hints_.camera_height) {
    const Eigen::Vector3d up = (T_world_camera.quaternion() * *hints_.up).normalized();
    known = {up, up.dot(T_world_camera.translation()) - *hints_.camera_height};
  }
  frame_ = known ? PlannerFrame{"map", map_frame(*known, T_world_camera)}
                 : PlannerFrame{"first camera", T_world_camera.inverse()};
  lines_.add(json_text({{"frame", frame_->name}, {"T_map_world", pose_json(frame_->T_map_world)}}) +
             "\n");
}

void LiveObstacles::add(double timestamp, const std::optional<Pose>& T_world_camera,
                        const std::vector<Mover>& movers, std::optional<double> movers_time) {
  if (!frame_ && T_world_camera) begin(*T_world_camera);
  nlohmann::json line = {
      {"timestamp", timestamp}, {"camera", nullptr}, {"movers", nlohmann::json::array()}};
  line["movers_time"] = movers_time ? nlohmann::json(*movers_time) : nlohmann::json();
  if (T_world_camera) {
    line["camera"] = triple(frame_->T_map_world * T_world_camera->translation());
    for (const Mover& mover : movers)
      line["movers"].push_back(
          mover_in_map(mover.id, mover.class_name, mover.now, frame_->T_map_world));
  }
  if (frame_) lines_.add(json_text(line) + "\n");
}

}  // namespace stillmap
