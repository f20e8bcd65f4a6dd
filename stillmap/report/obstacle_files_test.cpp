// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/obstacle_files.hpp"

#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

FloorPlan plan() {
  StaticObstacle table;
  table.id = 1;
  table.box = {Eigen::Vector3d(1, -0.5, 0.1), Eigen::Vector3d(2, 0.5, 0.8)};
  return {.grid = {}, .obstacles = {table}};
}

// A camera's world (y down) 1.2 m above the floor.
Pose T_map_world() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  return {R, {0, 0, 1.2}};
}

Trajectory two_and_a_half_seconds() {
  Trajectory trajectory;
  for (int i = 0; i < 25; ++i) trajectory.push_back({100.05 + 0.1 * i, Pose()});
  return trajectory;
}

std::vector<nlohmann::json> lines_of(const std::string& text) {
  std::vector<nlohmann::json> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(nlohmann::json::parse(line));
  return lines;
}

/// Returns a person who is observed at 101.35 s and 101.45 s.
std::vector<MoverTrack> one_person() {
  MoverTrack person;
  person.id = 7;
  person.class_name = "person";
  for (const double timestamp : {101.35, 101.45}) {
    MoverSample sample;
    sample.timestamp = timestamp;
    sample.centroid = {0.5 + 10 * (timestamp - 101.35), 0.2, 3};
    sample.velocity = {0.1, 0, -0.4};
    sample.box = {Eigen::Vector3d(0.2, -0.6, 2.8), Eigen::Vector3d(0.8, 1.2, 3.2)};
    person.samples.push_back(sample);
  }
  return {person};
}

TEST(ObstacleFiles, ListStaticAndMovingObstaclesOncePerSecond) {
  const auto lines =
      lines_of(obstacles_by_second(plan(), T_map_world(), two_and_a_half_seconds(), one_person()));
  ASSERT_EQ(lines.size(), 3U);
  for (const auto& line : lines) {
    EXPECT_EQ(line["static"][0]["box"]["max"], (nlohmann::json{2.0, 0.5, 0.8}));
    EXPECT_EQ(line["camera"], (nlohmann::json{0.0, 0.0, 1.2}));
  }
  EXPECT_TRUE(lines[0]["movers"].empty());
  ASSERT_EQ(lines[1]["movers"].size(), 1U);
  const auto& person = lines[1]["movers"][0];
  EXPECT_EQ(person["id"], 7);
  EXPECT_EQ(person["centroid"], (nlohmann::json{3.0, -0.5, 1.0}));
  EXPECT_EQ(person["velocity"], (nlohmann::json{-0.4, -0.1, 0.0}));
  EXPECT_EQ(person["box"]["min"], (nlohmann::json{2.8, -0.8, 0.0}));
  EXPECT_EQ(person["box"]["max"], (nlohmann::json{3.2, -0.2, 1.8}));
}

TEST(ObstacleFiles, NeedNoMovers) {
  const auto lines =
      lines_of(obstacles_by_second(plan(), T_map_world(), two_and_a_half_seconds(), {}));
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_TRUE(lines[2]["movers"].empty());
  EXPECT_EQ(obstacles_json(plan(), T_map_world())["obstacles"].size(), 1U);
}

}  // namespace
}  // namespace stillmap
