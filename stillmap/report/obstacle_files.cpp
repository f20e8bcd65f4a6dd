// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/obstacle_files.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
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

nlohmann::json statics(const FloorPlan& plan) {
  nlohmann::json list = nlohmann::json::array();
  for (const StaticObstacle& obstacle : plan.obstacles) {
    list.push_back({{"id", obstacle.id}, {"box", box_json(obstacle.box)}});
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

long second_of(double timestamp) { return static_cast<long>(std::floor(timestamp)); }

/// Returns the movers of the first frame with movers in each second, in order of their ids.
std::map<long, nlohmann::json> movers_by_second(const std::vector<MoverTrack>& tracks,
                                                const Pose& T_map_world) {
  std::map<long, double> first;  // time stamp of the first frame with movers, by second
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& sample : track.samples) {
      double& stamp = first.emplace(second_of(sample.timestamp), sample.timestamp).first->second;
      stamp = std::min(stamp, sample.timestamp);
    }
  }
  std::map<long, nlohmann::json> movers;
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& sample : track.samples) {
      const long second = second_of(sample.timestamp);
      if (sample.timestamp == first.at(second))
        movers[second].push_back(mover_in_map(track, sample, T_map_world));
    }
  }
  return movers;
}

}  // namespace

nlohmann::json obstacles_json(const FloorPlan& plan, const Pose& T_map_world) {
  const Eigen::Vector3d& t = T_map_world.translation();
  const Eigen::Quaterniond& q = T_map_world.quaternion();
  return {{"T_map_world", {t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()}},
          {"obstacles", statics(plan)}};
}

std::string obstacles_by_second(const FloorPlan& plan, const Pose& T_map_world,
                                const Trajectory& trajectory,
                                const std::vector<MoverTrack>& tracks) {
  const auto movers = movers_by_second(tracks, T_map_world);
  const nlohmann::json still = statics(plan);
  std::string lines;
  long last = std::numeric_limits<long>::min();
  for (const auto& [timestamp, T_world_camera] : trajectory) {
    const long second = second_of(timestamp);
    if (second == last) continue;
    last = second;
    const auto found = movers.find(second);
    const nlohmann::json line = {
        {"timestamp", timestamp},
        {"camera", triple(T_map_world * T_world_camera.translation())},
        {"static", still},
        {"movers", found != movers.end() ? found->second : nlohmann::json::array()}};
    lines += line.dump() + "\n";
  }
  return lines;
}

}  // namespace stillmap
