// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/view_depth_error.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

/// Error of the inverse depth at a pixel [1/m], with a mean of zero over the image.
double true_error(double u, double v) {
  const Camera camera = small_camera();
  const double x = 2 * u / (camera.width - 1) - 1, y = 2 * v / (camera.height - 1) - 1;
  return 0.02 * x + 0.015 * x * y - 0.01 * y;
}

/// Returns the depth of a room with a floor, a ceiling and four walls [m].
double room_depth(const Pose& T_world_camera, int u, int v) {
  const Eigen::Vector3d ray = T_world_camera.rotation() * small_camera().unproject(u, v, 1);
  const Eigen::Vector3d low = Eigen::Vector3d(-2, -1.2, -2) - T_world_camera.translation();
  const Eigen::Vector3d high = Eigen::Vector3d(2.5, 1.3, 3) - T_world_camera.translation();
  double z = 100;
  for (int i = 0; i < 3; ++i) z = std::min(z, (ray[i] < 0 ? low[i] : high[i]) / ray[i]);
  return z;
}

/// Views of the room by a camera that turns, with an error of their depths.
class Views {
 public:
  explicit Views(double error_factor) {
    for (int i = 0; i < 10; ++i) {
      const Pose T(so3_exp({0.15 * std::sin(2.0 * i), 0.4 * std::sin(0.9 * i), 0}),
                   {0.02 * i, 0.03 * std::sin(i), 0});
      const RgbdFrame frame = frame_of(small_camera(), [&](int u, int v) {
        return 1 / (1 / room_depth(T, u, v) + error_factor * true_error(u, v));
      });
      views_.push_back(make_dense_view(small_camera(), frame, {}, {.stride = 1}, {}).view);
      poses_.push_back(T);
    }
  }
  std::vector<PosedView> posed() const {
    std::vector<PosedView> posed;
    for (std::size_t i = 0; i < views_.size(); ++i) posed.push_back({&views_[i], poses_[i]});
    return posed;
  }

 private:
  std::vector<DenseView> views_;
  std::vector<Pose> poses_;
};

TEST(ViewDepthError, IsFoundFromViewsOfARoom) {
  const auto error = depth_error_of(Views(1).posed());
  ASSERT_TRUE(error);
  const Eigen::Vector2d lattice(160, 120);
  double sum = 0, worst = 0;
  int count = 0;
  for (int v = 4; v < lattice.y(); v += 8) {
    for (int u = 4; u < lattice.x(); u += 8) {
      sum += error->at(u, v, lattice);
      worst = std::max(worst, std::abs(error->at(u, v, lattice) - true_error(u, v)));
      ++count;
    }
  }
  EXPECT_LT(worst, 0.004);  // of 0.045
  EXPECT_NEAR(sum / count, 0, 1e-3);
}

TEST(ViewDepthError, IsRemovedFromTheDepths) {
  const Views views(1);
  const auto error = depth_error_of(views.posed());
  ASSERT_TRUE(error);
  double before = 0, after = 0;
  for (const auto& [view, T] : views.posed()) {
    const cv::Mat1w corrected = without_error(view->depth, *error);
    for (int v = 10; v < 110; v += 5) {
      for (int u = 10; u < 150; u += 5) {
        const double z = room_depth(T, u, v);
        before += std::abs(view->depth(v, u) * DenseView::kDepthUnit - z);
        after += std::abs(corrected(v, u) * DenseView::kDepthUnit - z);
      }
    }
  }
  EXPECT_LT(after, 0.15 * before);
}

TEST(ViewDepthError, IsNotFoundWithoutAnError) { EXPECT_FALSE(depth_error_of(Views(0).posed())); }

TEST(ViewDepthError, IsNotFoundFromTooFewViews) {
  const Views views(1);
  EXPECT_FALSE(depth_error_of(std::vector(1, views.posed()[0])));
  EXPECT_FALSE(depth_error_of(std::span<const PosedView>()));
}

}  // namespace
}  // namespace stillmap
