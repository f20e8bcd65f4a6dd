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

// A wall with a thing in front of it, a mover in front of that, and a patch without depth.
DenseView cluttered_view() {
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int v) {
    if (u > 120 && v > 90) return 0.0;
    if (std::abs(u - 40) < 12) return 1.0;
    return std::abs(u - 90) < 15 ? 1.5 : 2.2 + 0.003 * u;
  });
  const cv::Mat1b mover = cv::Mat(frame.depth > 0.5) & cv::Mat(frame.depth < 1.2);
  return make_dense_view(small_camera(), frame, mover, {}, {}).view;
}

TEST(PlacedView, TellsWhatLiesBeforeAtAndBehindASurface) {
  const DenseView view = cluttered_view();
  const PlacedView placed(view, Pose());
  const auto at = [&](int col, int row, double z) {
    return placed.at(view.camera.unproject(col, row, z).cast<float>());
  };
  const int mover = 40 / view.stride, thing = 90 / view.stride, row = 40 / view.stride;
  EXPECT_EQ(at(mover, row, 0.5), Sight::kThrough);
  EXPECT_EQ(at(mover, row, 1.0), Sight::kMover);
  EXPECT_EQ(at(mover, row, 1.5), Sight::kNothing);
  EXPECT_EQ(at(thing, row, 1.3), Sight::kThrough);
  EXPECT_EQ(at(thing, row, 1.48), Sight::kNothing);
  EXPECT_EQ(at(thing, row, 2.0), Sight::kNothing);
}

TEST(PlacedView, SaysOfABallWhatItSaysOfEachOfItsPoints) {
  const DenseView view = cluttered_view();
  const PlacedView placed(view, Pose(so3_exp({0.1, 0.2, 0.3}), {1, 2, 3}));
  std::mt19937 random(1);
  std::uniform_real_distribution<float> side(-1.2F, 1.2F), depth(-0.2F, 3), unit(-1, 1);
  int through = 0, nothing = 0, unsure = 0;
  for (int i = 0; i < 20000; ++i) {
    const Eigen::Vector3f center(side(random), side(random), depth(random));
    const float radius = 0.05F * (1.1F + unit(random));
    const std::optional<Sight> whole = placed.within(center, radius);
    unsure += !whole;
    through += whole == Sight::kThrough;
    nothing += whole == Sight::kNothing;
    for (int n = 0; whole && n < 10; ++n) {
      const Eigen::Vector3f d = Eigen::Vector3f(unit(random), unit(random), unit(random));
      EXPECT_EQ(placed.at(center + radius / std::max(1.0F, d.norm()) * d), *whole);
    }
  }
  // Two thirds of the space are told at once.
  EXPECT_GT(through, 500);
  EXPECT_GT(nothing, 5000);
  EXPECT_LT(unsure, 8000);
}

// PlacedView::within() draws on it: the nearest of several depths has the nearest margin.
TEST(PlacedView, DepthLessItsMarginGrowsOverTheRangeOfEverySensor) {
  for (const std::string& name : depth_sensor_names()) {
    const DepthSensor& sensor = find_depth_sensor(name);
    const auto margin = see_through_margin(sensor);
    for (float z = 0.1F; z < static_cast<float>(sensor.max_depth); z += 0.1F) {
      EXPECT_GT(z + 0.1F - margin.at(z + 0.1F), z - margin.at(z)) << name << " at " << z;
    }
  }
}

TEST(PlacedView, PutsItsPixelsIntoTheWorld) {
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

TEST(PlacedView, SaysNothingOnceItIsEmpty) {
  const DenseView view;
  const PlacedView placed(view, Pose());
  EXPECT_EQ(placed.within({0, 0, 1}, 0.1F), Sight::kNothing);
  EXPECT_EQ(placed.at({0, 0, 1}), Sight::kNothing);
}

}  // namespace
}  // namespace stillmap
