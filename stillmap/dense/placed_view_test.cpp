// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/placed_view.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

// Returns a wall with an object in front of it, a mover in front of both, and a patch without
// depth.
DenseView cluttered_view() {
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int v) {
    if (u > 120 && v > 90) return 0.0;
    if (std::abs(u - 40) < 12) return 1.0;
    return std::abs(u - 90) < 15 ? 1.5 : 2.2 + 0.003 * u;
  });
  const cv::Mat1b mover = cv::Mat(frame.depth > 0.5) & cv::Mat(frame.depth < 1.2);
  return make_dense_view(small_camera(), frame, mover, {}, {}).view;
}

TEST(PlacedView, VotesInFrontOfAtAndBehindASurface) {
  const DenseView view = cluttered_view();
  const PlacedView placed(view, Pose());
  const auto at = [&](int col, int row, double z) {
    return placed.at(view.camera.unproject(col, row, z).cast<float>());
  };
  const int mover = 40 / view.stride, object = 90 / view.stride, row = 40 / view.stride;
  EXPECT_EQ(at(mover, row, 0.5), VoxelVote::kSeenThrough);
  EXPECT_EQ(at(mover, row, 1.0), VoxelVote::kMover);
  EXPECT_EQ(at(mover, row, 1.5), VoxelVote::kNone);
  EXPECT_EQ(at(object, row, 1.3), VoxelVote::kSeenThrough);
  EXPECT_EQ(at(object, row, 1.48), VoxelVote::kNone);
  EXPECT_EQ(at(object, row, 2.0), VoxelVote::kNone);
}

TEST(PlacedView, VotesOnABallAsOnEachOfItsPoints) {
  const DenseView view = cluttered_view();
  const PlacedView placed(view, Pose(so3_exp({0.1, 0.2, 0.3}), {1, 2, 3}));
  std::mt19937 random(1);
  std::uniform_real_distribution<float> side(-1.2F, 1.2F), depth(-0.2F, 3), unit(-1, 1);
  int through = 0, nothing = 0, unsure = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f center(side(random), side(random), depth(random));
    const float radius = 0.05F * (1.1F + unit(random));
    const std::optional<VoxelVote> whole = placed.within(center, radius);
    unsure += !whole;
    through += whole == VoxelVote::kSeenThrough;
    nothing += whole == VoxelVote::kNone;
    for (int n = 0; whole && n < 10; ++n) {
      const Eigen::Vector3f d = Eigen::Vector3f(unit(random), unit(random), unit(random));
      EXPECT_EQ(placed.at(center + radius / std::max(1.0F, d.norm()) * d), *whole);
    }
  }
  // Two thirds of the balls have one vote.
  EXPECT_GT(through, 500);
  EXPECT_GT(nothing, 5000);
  EXPECT_LT(unsure, 8000);
}

// PlacedView::within() relies on this: the nearest of several depths has the nearest margin.
TEST(PlacedView, DepthLessItsMarginGrowsOverTheRangeOfEverySensor) {
  for (const std::string& name : depth_sensor_names()) {
    const DepthSensor& sensor = find_depth_sensor(name);
    const auto margin = see_through_margin(sensor);
    for (float z = 0.1F; z < static_cast<float>(sensor.max_depth); z += 0.1F) {
      EXPECT_GT(z + 0.1F - margin.at(z + 0.1F), z - margin.at(z)) << name << " at " << z;
    }
  }
}

TEST(PlacedView, TransformsItsPixelsToTheWorld) {
  const DenseView view = cluttered_view();
  const Pose T(so3_exp({0.1, 0.2, 0.3}), {1, 2, 3});
  const PlacedView placed(view, T);
  const Eigen::Vector3d p = placed.point(10, 45);
  EXPECT_LT((p - T * view.camera.unproject(45, 10, placed.depth(10, 45))).norm(), 1e-12);
  EXPECT_LT((placed.eye() + placed.depth(10, 45) * placed.ray(10, 45) - p).norm(), 1e-12);
  EXPECT_LT((placed.in_camera(p.cast<float>()) -
             view.camera.unproject(45, 10, placed.depth(10, 45)).cast<float>())
                .norm(),
            1e-5);
}

TEST(PlacedView, HasNoVotesIfItIsEmpty) {
  const DenseView view;
  const PlacedView placed(view, Pose());
  EXPECT_EQ(placed.within({0, 0, 1}, 0.1F), VoxelVote::kNone);
  EXPECT_EQ(placed.at({0, 0, 1}), VoxelVote::kNone);
}

}  // namespace
}  // namespace stillmap
