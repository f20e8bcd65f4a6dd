// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/planner_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/dense/synthetic_room.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using test::error_of;
using ::testing::AllOf;
using ::testing::AnyOf;
using ::testing::HasSubstr;

/// Writes the planner's files of the rendered room, whose floor is 1.2 m below the camera.
class PlannerFilesOfARoom : public ::testing::Test {
 protected:
  std::string write(const FloorHints& hints) { return files(hints).problem; }
  PlannerFiles files(const FloorHints& hints) {
    DenseOptions options;
    options.back_projection.stride = 1;
    DenseMap map(testing_support::small_camera(), options);
    map.add(0,
            testing_support::frame_of(testing_support::small_camera(), testing_support::room_depth),
            {});
    const PlacedMap placed =
        map.place([](std::uint64_t) { return std::optional(testing_support::kRoomCamera); });
    ResultFolder folder(folder_, ResultFolder::Foreign::kKeep);
    PlannerFiles files = write_planner_files(
        {placed, search_floor(placed, hints), {{1.0, testing_support::kRoomCamera}}, {}}, {}, hints,
        folder);
    folder.require_all();
    return files;
  }
  nlohmann::json floor() const { return nlohmann::json::parse(read_file(folder_ / "floor.json")); }
  nlohmann::json obstacles() const {
    return nlohmann::json::parse(read_file(folder_ / "obstacles.json"));
  }

  const fs::path folder_ = test::own_path("planner_files");

 private:
  void SetUp() override { fs::remove_all(folder_); }
};

TEST_F(PlannerFilesOfARoom, AreInTheFrameOfTheMapOnAGivenFloor) {
  const Eigen::Vector3d up =
      testing_support::kRoomCamera.quaternion().conjugate() * Eigen::Vector3d(0, -1, 0);
  EXPECT_EQ(write({.up = up, .camera_height = 1.2}), "");
  EXPECT_EQ(floor()["frame"], "map");
  EXPECT_EQ(floor()["up_sigma_deg"], 0);
  EXPECT_NEAR(floor()["T_map_world"][2].get<double>(), 1.2, 1e-9);
  EXPECT_FALSE(obstacles()["obstacles"].empty());
  EXPECT_TRUE(fs::exists(folder_ / "grid.pgm"));
  const Floor again = read_floor(folder_ / "floor.json");
  EXPECT_NEAR(again.height, -1.2, 1e-9);
  EXPECT_LT((again.up - Eigen::Vector3d(0, -1, 0)).norm(), 1e-9);
}

TEST_F(PlannerFilesOfARoom, AreInTheFrameOfTheFirstCameraIfTheFloorIsUnknown) {
  // In the direction of the optical axis there is nothing horizontal.
  EXPECT_NE(write({.up = Eigen::Vector3d(0, 0, 1)}), "");
  EXPECT_EQ(floor()["frame"], "first camera");
  EXPECT_TRUE(floor()["floor"].is_null());
  EXPECT_FALSE(floor()["problem"].is_null());
  EXPECT_TRUE(obstacles()["obstacles"].empty());
  EXPECT_FALSE(fs::exists(folder_ / "grid.pgm"));
  EXPECT_TRUE(fs::exists(folder_ / "octomap.bt"));
  const Pose T(testing_support::kRoomCamera.inverse());
  EXPECT_NEAR(floor()["T_map_world"][3].get<double>(), T.quaternion().x(), 1e-9);
  EXPECT_THAT(error_of([&] { read_floor(folder_ / "floor.json"); }),
              HasSubstr("contains no floor"));
}

TEST_F(PlannerFilesOfARoom, AreShownInTheReportWithTheirFloor) {
  const Eigen::Vector3d up =
      testing_support::kRoomCamera.quaternion().conjugate() * Eigen::Vector3d(0, -1, 0);
  const CaptionedImage grid = files({.up = up, .camera_height = 1.2}).grid;
  EXPECT_FALSE(grid.image.empty());
  EXPECT_THAT(grid.caption, HasSubstr("the floor is 1.20 m below the first camera"));
  EXPECT_TRUE(files({.up = Eigen::Vector3d(0, 0, 1)}).grid.image.empty()) << "no floor, no grid";
}

TEST_F(PlannerFilesOfARoom, TheGridOfAnEarlierCallGoesWithTheFloor) {
  const Eigen::Vector3d up =
      testing_support::kRoomCamera.quaternion().conjugate() * Eigen::Vector3d(0, -1, 0);
  write({.up = up, .camera_height = 1.2});
  ASSERT_TRUE(fs::exists(folder_ / "grid.yaml"));
  write({.up = Eigen::Vector3d(0, 0, 1)});
  EXPECT_FALSE(fs::exists(folder_ / "grid.pgm"));
  EXPECT_FALSE(fs::exists(folder_ / "grid.yaml"));
}

TEST_F(PlannerFilesOfARoom, AGivenFloorThatContradictsTheSurfacesIsTold) {
  const Eigen::Vector3d up =
      testing_support::kRoomCamera.quaternion().conjugate() * Eigen::Vector3d(0, -1, 0);
  EXPECT_THAT(write({.up = -up, .camera_height = 1.2}), HasSubstr("180.0 degrees from"));
  EXPECT_EQ(floor()["frame"], "map") << "the user's floor is used nevertheless";
  EXPECT_THAT(floor()["problem"].get<std::string>(), HasSubstr("180.0 degrees from"));
  EXPECT_THAT(write({.up = -up}),
              AllOf(HasSubstr("the floor is unknown"), HasSubstr("180.0 degrees from")));
  const Pose tilt(so3_exp({0.07, 0, 0}), {0, 0, 0});  // 4 degrees
  EXPECT_THAT(write({.up = tilt.quaternion() * up, .camera_height = 1.2}),
              HasSubstr("4.0 degrees from"));
  EXPECT_THAT(
      write({.up = up, .camera_height = 0.5}),
      AnyOf(HasSubstr("lie more than 0.15 m below it"), HasSubstr("below the first camera")));
  const Floor upside_down{{0, 1, 0}, 0};
  EXPECT_THAT(write({.floor = upside_down}), HasSubstr("contradicts the recording"));
}

TEST_F(PlannerFilesOfARoom, AFloorThatIsNoneIsRefused) {
  fs::create_directories(folder_);
  const fs::path file = folder_ / "mine.json";
  for (const char* text :
       {"", "{", "[]", R"({"floor": 3})", R"({"floor": {"up": [0, 0, 1]}})",
        R"({"floor": {"up": [0, 1], "height": 1}})", R"({"floor": {"up": [0, 0, 3], "height": 1}})",
        R"({"floor": {"up": [0, 0, 1], "height": 1e999}})"}) {
    write_file(file, text);
    EXPECT_THAT(error_of([&] { read_floor(file); }), HasSubstr("mine.json")) << text;
  }
}

}  // namespace
}  // namespace stillmap
