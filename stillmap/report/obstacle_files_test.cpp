// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/obstacle_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

std::vector<StaticObstacle> table() {
  return {{.id = 1, .center = {1.5, 0, 0.45}, .size = {1, 2, 0.7}, .piece = 3, .yaw = 0.5}};
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
  for (const int frame : {13, 14}) {
    MoverSample sample;
    sample.timestamp = two_and_a_half_seconds()[static_cast<std::size_t>(frame)].timestamp;
    sample.centroid = {0.5 + frame - 13, 0.2, 3};
    sample.velocity = {0.1, 0, -0.4};
    sample.box = {Eigen::Vector3d(0.2, -0.6, 2.8), Eigen::Vector3d(0.8, 1.2, 3.2)};
    person.samples.push_back(sample);
  }
  return {person};
}

TEST(ObstacleFiles, ListStaticObstaclesOnceAndMovingOnesInEveryFrame) {
  const auto lines = lines_of(
      obstacles_by_frame(table(), {"map", T_map_world()}, two_and_a_half_seconds(), one_person()));
  ASSERT_EQ(lines.size(), 26U);
  EXPECT_EQ(lines[0]["static"][0]["size"], (nlohmann::json{1.0, 2.0, 0.7}));
  EXPECT_EQ(lines[0]["static"][0]["yaw"], 0.5);
  EXPECT_EQ(lines[0]["static"][0]["piece"], 3);
  EXPECT_EQ(lines[0]["frame"], "map");
  EXPECT_EQ(lines[0]["T_map_world"][2], 1.2);
  int with_movers = 0;
  for (std::size_t i = 1; i < lines.size(); ++i) {
    EXPECT_EQ(lines[i]["camera"], (nlohmann::json{0.0, 0.0, 1.2}));
    with_movers += lines[i]["movers"].size() == 1;
  }
  EXPECT_EQ(with_movers, 2);
  EXPECT_DOUBLE_EQ(lines[14]["timestamp"], 101.35);
  const auto& person = lines[14]["movers"][0];
  EXPECT_EQ(person["id"], 7);
  EXPECT_EQ(person["centroid"], (nlohmann::json{3.0, -0.5, 1.0}));
  EXPECT_EQ(person["velocity"], (nlohmann::json{-0.4, -0.1, 0.0}));
  EXPECT_EQ(person["box"]["min"], (nlohmann::json{2.8, -0.8, 0.0}));
  EXPECT_EQ(person["box"]["max"], (nlohmann::json{3.2, -0.2, 1.8}));
}

/// Returns the lines of a run with a lost frame between two with the same person.
std::vector<nlohmann::json> live_lines(const FloorHints& hints) {
  const std::filesystem::path folder = test::own_path("live_obstacles");
  {
    ResultFolder results(folder);
    LiveObstacles live(results, hints);
    Mover person;
    person.id = 7;
    person.now = one_person().front().samples.front();
    live.add(1.0, std::nullopt, {}, std::nullopt);
    live.add(1.1, Pose(), {person}, 1.1);
    live.add(1.2, std::nullopt, {person}, 1.1);
    live.add(1.3, Pose(Eigen::Quaterniond::Identity(), {0, 0, 2}), {person}, 1.2);
    results.require_all();
  }
  const auto lines = lines_of(read_file(folder / kLiveObstacles));
  std::filesystem::remove_all(folder);
  return lines;
}

TEST(LiveObstacles, AreInTheFrameOfAGivenFloor) {
  const auto lines = live_lines({.up = Eigen::Vector3d(0, -2, 0), .camera_height = 1.2});
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0]["frame"], "map");
  EXPECT_EQ(lines[1]["movers"][0]["centroid"], (nlohmann::json{3.0, -0.5, 1.0}));
  EXPECT_EQ(lines[1]["movers"][0]["state"], "predicted");
  EXPECT_TRUE(lines[2]["camera"].is_null());
  EXPECT_TRUE(lines[2]["movers"].empty());
  EXPECT_EQ(lines[3]["camera"], (nlohmann::json{2.0, 0.0, 1.2}));
  EXPECT_EQ(lines[3]["movers_time"], 1.2);
}

TEST(LiveObstacles, AreInTheFrameOfTheFirstCameraWithoutAFloor) {
  const auto lines = live_lines({});
  ASSERT_EQ(lines.size(), 4U);
  EXPECT_EQ(lines[0]["frame"], "first camera");
  EXPECT_EQ(lines[1]["movers"][0]["centroid"], (nlohmann::json{0.5, 0.2, 3.0}));
}

TEST(ObstacleFiles, NeedNoMovers) {
  const auto lines =
      lines_of(obstacles_by_frame(table(), {"map", T_map_world()}, two_and_a_half_seconds(), {}));
  ASSERT_EQ(lines.size(), 26U);
  EXPECT_TRUE(lines[2]["movers"].empty());
  EXPECT_EQ(obstacles_json(table(), {"map", T_map_world()})["obstacles"].size(), 1U);
}

}  // namespace
}  // namespace stillmap
