// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/surface_refinement.hpp"

#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing_support::small_camera;

/// Views of a wall at z = 2 m, whose normal is not the direction of view.
class RefinedPoints : public ::testing::Test {
 protected:
  void add(const Eigen::Vector3d& eye, double turn, float error = 0) {
    const Camera camera = small_camera();
    const Pose pose(Eigen::Quaterniond(Eigen::AngleAxisd(turn, Eigen::Vector3d::UnitY())), eye);
    RgbdFrame frame = testing_support::view_of(camera, pose, {{0, 0, 1}, 2});
    frame.depth += error;
    BackProjectionOptions options;
    options.stride = 1;
    held_.push_back(std::make_shared<DenseView>(make_dense_view(camera, frame, {}, options).view));
    views_.push_back({held_.back().get(), pose});
  }

  std::vector<std::shared_ptr<DenseView>> held_;
  std::vector<PosedView> views_;
};

TEST_F(RefinedPoints, LieOnTheSurface) {
  add({0, 0, 0}, 0.3);
  add({0.4, 0.1, 0.2}, -0.2);
  const std::vector<Eigen::Vector3f> points{{0.1F, 0, 2.008F}, {0.3F, 0.2F, 1.99F}};
  for (const Eigen::Vector3f& p : refined_points(points, views_)) EXPECT_NEAR(p.z(), 2, 2e-4);
}

TEST_F(RefinedPoints, AreMeansOfAllViews) {
  add({0, 0, 0}, 0, 0.01F);
  add({0, 0, 0}, 0, -0.004F);
  const auto refined = refined_points({{0.1F, 0.1F, 2.01F}}, views_);
  EXPECT_NEAR(refined[0].z(), 2.003, 2e-4);
  EXPECT_NEAR(refined[0].x() / refined[0].z(), 0.1 / 2.01, 1e-5);  // on its ray
}

TEST_F(RefinedPoints, StayWhereNoViewAgrees) {
  add({0, 0, 0}, 0);
  const std::vector<Eigen::Vector3f> points{{0.1F, 0.1F, 1.8F}, {0, 0, 3}, {9, 0, 2}};
  EXPECT_EQ(refined_points(points, views_), points);
}

TEST_F(RefinedPoints, StayAtTheEdgesOfMovers) {
  add({0, 0, 0}, 0);
  const Camera& camera = held_[0]->camera;
  held_[0]->kind(cv::Rect(0, 0, camera.width / 2, camera.height)).setTo(kMoverSurface);
  const Eigen::Vector3f edge = camera.unproject(camera.width / 2 - 0.5, 60, 2.01).cast<float>();
  EXPECT_EQ(refined_points({edge}, views_)[0], edge);
}

}  // namespace
}  // namespace stillmap
