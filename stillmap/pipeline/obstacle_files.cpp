// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/obstacle_files.hpp"

#include "stillmap/base/error.hpp"

#include <cmath>
#include <limits>
#include <map>
#include <sstream>

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

Eigen::Vector3d vector_of(const nlohmann::json& json) {
  const auto v = json.get<std::array<double, 3>>();
  return {v[0], v[1], v[2]};
}

nlohmann::json statics(const FloorPlan& plan) {
  nlohmann::json list = nlohmann::json::array();
  for (const StaticObstacle& obstacle : plan.obstacles) {
    list.push_back({{"id", obstacle.id}, {"box", box_json(obstacle.box)}});
  }
  return list;
}

/// A mover of movers.jsonl, brought to frame `map`.
nlohmann::json mover_in_map(const nlohmann::json& mover, const Pose& T_map_world) {
  const auto& sides = mover.at("box");
  const Eigen::AlignedBox3d world(vector_of(sides.at(0)), vector_of(sides.at(1)));
  Eigen::AlignedBox3d box;
  for (int corner = 0; corner < 8; ++corner) {
    box.extend(T_map_world * world.corner(static_cast<Eigen::AlignedBox3d::CornerType>(corner)));
  }
  return {{"id", mover.at("id")},
          {"class", mover.at("class")},
          {"centroid", triple(T_map_world * vector_of(mover.at("centroid")))},
          {"velocity", triple(T_map_world.quaternion() * vector_of(mover.at("velocity")))},
          {"box", box_json(box)}};
}

/// Of each second, the movers of its first line.
std::map<long, nlohmann::json> movers_by_second(const std::string& text, const Pose& T_map_world) {
  std::map<long, nlohmann::json> movers;
  std::istringstream lines(text);
  try {
    for (std::string line; std::getline(lines, line);) {
      if (line.empty()) continue;
      const nlohmann::json json = nlohmann::json::parse(line);
      const auto second = static_cast<long>(std::floor(json.at("timestamp").get<double>()));
      if (movers.contains(second)) continue;
      nlohmann::json& list = movers[second] = nlohmann::json::array();
      for (const nlohmann::json& mover : json.at("movers")) {
        list.push_back(mover_in_map(mover, T_map_world));
      }
    }
  } catch (const nlohmann::json::exception& e) {
    throw Error(std::string("is broken: ") + e.what(), "movers.jsonl", "make the run again");
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
                                const Trajectory& trajectory, const std::string& movers_jsonl) {
  const auto movers = movers_by_second(movers_jsonl, T_map_world);
  const nlohmann::json still = statics(plan);
  std::string lines;
  long last = std::numeric_limits<long>::min();
  for (const auto& [timestamp, T_world_camera] : trajectory) {
    const auto second = static_cast<long>(std::floor(timestamp));
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
