// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/scene_export.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/dense/synthetic_room.hpp"
#include "stillmap/geometry/pose.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

/// A camera 2 m above the origin that looks along the world's x axis, with its y axis downwards.
PosedImages one_image() {
  Eigen::Matrix3d R;
  R << 0, 0, 1, -1, 0, 0, 0, -1, 0;  // columns: right, down, forward
  return {testing_support::small_camera(), {{"00007.png", Pose(R, {0, 0, 2})}}};
}

Cloud two_points() {
  Cloud cloud;
  cloud.add({1, 0, 2}, {255, 128, 0});
  cloud.add({-1, 0.5, 3}, {1, 2, 3});
  return cloud;
}

TEST(ColmapModel, HasPixelCentersAtHalvesAndPosesOfTheWorldInTheCamera) {
  EXPECT_THAT(colmap_cameras(one_image(), ColmapFormat::kText),
              HasSubstr("\n1 PINHOLE 160 120 132 132 80 60\n"));
  const std::string text = colmap_images(one_image(), ColmapFormat::kText);
  std::istringstream line(text.substr(text.find('\n')));
  double id, w, x, y, z, tx, ty, tz;
  std::string camera, name;
  line >> id >> w >> x >> y >> z >> tx >> ty >> tz >> camera >> name;
  const Pose T_camera_world(Eigen::Quaterniond(w, x, y, z), {tx, ty, tz});
  EXPECT_NEAR((T_camera_world * Eigen::Vector3d(3, 0, 2) - Eigen::Vector3d(0, 0, 3)).norm(), 0,
              1e-9);
  EXPECT_EQ(name, "00007.png");
  EXPECT_THAT(colmap_points(two_points(), ColmapFormat::kText),
              HasSubstr("\n2 -1 0.5 3 1 2 3 0\n"));
}

TEST(ColmapModel, IsTheSameInItsBinaryFormat) {
  const PosedImages images = one_image();
  const std::string cameras = colmap_cameras(images, ColmapFormat::kBinary);
  ByteReader camera(cameras, "cameras", "");
  EXPECT_EQ(camera.get<std::uint64_t>(), 1U);
  EXPECT_EQ(camera.get<std::uint32_t>(), 1U);
  EXPECT_EQ(camera.get<std::int32_t>(), 1);  // pinhole
  EXPECT_EQ(camera.get_list<std::uint64_t>(2), (std::vector<std::uint64_t>{160, 120}));
  EXPECT_EQ(camera.get_list<double>(4), (std::vector<double>{132, 132, 80, 60}));
  camera.expect_end();
  // Bytes: number of images 8, id 4, pose 56, camera 4, "00007.png" and 0, number of keypoints 8.
  EXPECT_EQ(colmap_images(images, ColmapFormat::kBinary).size(), 8 + 4 + 56 + 4 + 10 + 8U);
  const std::string points = colmap_points(two_points(), ColmapFormat::kBinary);
  ByteReader point(points, "points", "");
  EXPECT_EQ(point.get<std::uint64_t>(), 2U);
  EXPECT_EQ(point.get<std::uint64_t>(), 1U);
  EXPECT_EQ(point.get_list<double>(3), (std::vector<double>{1, 0, 2}));
  EXPECT_EQ(point.get<Rgb>(), (Rgb{255, 128, 0}));
}

TEST(NerfstudioTransforms, HaveCamerasThatLookAlongMinusZ) {
  const nlohmann::json json = nerfstudio_transforms(one_image());
  EXPECT_EQ(json["cx"], 80);
  const nlohmann::json& frame = json["frames"][0];
  EXPECT_EQ(frame["mask_path"], "masks/00007.png.png");
  Eigen::Matrix4d T;
  for (int row = 0; row < 4; ++row) {
    for (int col = 0; col < 4; ++col) T(row, col) = frame["transform_matrix"][row][col];
  }
  EXPECT_NEAR((T * Eigen::Vector4d(0, 0, -3, 1) - Eigen::Vector4d(3, 0, 2, 1)).norm(), 0, 1e-9);
  EXPECT_NEAR((T * Eigen::Vector4d(0, 1, 0, 1) - Eigen::Vector4d(0, 0, 3, 1)).norm(), 0, 1e-9);
}

TEST(LasFile, HasItsPointsInTheFrameOfTheMap) {
  const Pose T_map_world(so3_exp({0, 0, M_PI / 2}), {0, 0, 10});
  const std::string bytes = las_bytes(two_points(), T_map_world);
  ASSERT_EQ(bytes.size(), 227 + 2 * 26U);
  EXPECT_EQ(bytes.substr(0, 4), "LASF");
  const std::string extent = bytes.substr(227 - 48, 48);
  ByteReader bounds(extent, "extent", "");
  const auto values = bounds.get_list<double>(6);  // max x, min x, max y, ...
  EXPECT_NEAR(values[0], 0, 1e-9);
  EXPECT_NEAR(values[1], -0.5, 1e-9);
  EXPECT_NEAR(values[4], 13, 1e-9);
  const std::string second = bytes.substr(227 + 26);
  ByteReader point(second, "point", "");
  EXPECT_EQ(point.get_list<std::int32_t>(3), (std::vector<std::int32_t>{-5000, -10000, 130000}));
  EXPECT_EQ(point.get_list<std::uint8_t>(8)[2], 9);  // the first of one return
  EXPECT_EQ(point.get_list<std::uint16_t>(3), (std::vector<std::uint16_t>{257, 514, 771}));
}

TEST(StaticMask, LeavesOutMoversAndTheirRim) {
  const Camera camera = testing_support::small_camera();
  DenseOptions options;
  options.back_projection.stride = 1;
  DenseMap map(camera, options);
  cv::Mat1b movers(camera.height, camera.width, std::uint8_t{0});
  movers(cv::Rect(60, 50, 20, 30)) = 255;
  map.add(0, testing_support::frame_of(camera, testing_support::room_depth), movers);
  const PlacedMap placed =
      map.place([](std::uint64_t) { return std::optional(testing_support::kRoomCamera); });
  const cv::Mat1b mask = static_mask(placed.views[0], *placed.grid);
  EXPECT_EQ(cv::countNonZero(mask(cv::Rect(60, 50, 20, 30))), 0);
  EXPECT_EQ(mask(60, 59), 0);
  EXPECT_EQ(mask(60, 50), 255);
  EXPECT_GT(cv::countNonZero(mask), camera.width * camera.height - 26 * 36);
  const cv::Mat1w depth = static_millimeters(*placed.views[0].view);
  EXPECT_EQ(depth(60, 70), 0);
  EXPECT_NEAR(depth(60, 30), 1000 * testing_support::room_depth(30, 60), 1);
}

}  // namespace
}  // namespace stillmap
