// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/obstacle_files.hpp"

#include "stillmap/base/error.hpp"

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

TEST(ObstacleFiles, TellOfStaticsAndMoversOncePerSecond) {
  const std::string movers =
      R"({"timestamp":101.35,"movers":[{"id":7,"class":"person","centroid":[0.5,0.2,3],)"
      R"("velocity":[0.1,0,-0.4],"box":[[0.2,-0.6,2.8],[0.8,1.2,3.2]]}]})"
      "\n"
      R"({"timestamp":101.45,"movers":[]})"
      "\n";
  const auto lines =
      lines_of(obstacles_by_second(plan(), T_map_world(), two_and_a_half_seconds(), movers));
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

TEST(ObstacleFiles, DoWithoutMovers) {
  const auto lines =
      lines_of(obstacles_by_second(plan(), T_map_world(), two_and_a_half_seconds(), ""));
  ASSERT_EQ(lines.size(), 3U);
  EXPECT_TRUE(lines[2]["movers"].empty());
  EXPECT_EQ(obstacles_json(plan(), T_map_world())["obstacles"].size(), 1U);
}

TEST(ObstacleFiles, RefuseMoversThatAreNone) {
  EXPECT_THROW(obstacles_by_second(plan(), T_map_world(), {}, "{\"timestamp\":"), Error);
}

}  // namespace
}  // namespace stillmap
