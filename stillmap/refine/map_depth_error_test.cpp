// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/map_depth_error.hpp"

#include "stillmap/refine/map_bundle.hpp"

#include <algorithm>
#include <cmath>
#include <memory>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const Camera kCamera{.width = 640, .height = 480, .fx = 525, .fy = 525, .cx = 320, .cy = 240};

/// Error of the inverse depth at a pixel, with a mean of about zero [1/m].
double true_error(double u, double v) {
  const double x = u / kCamera.width - 0.5, y = v / kCamera.height - 0.5;
  return 0.04 * x - 0.02 * y + 0.06 * x * y;
}

/// A camera that turns among points around it.
/// @param error  factor of true_error() in the depths
Map turning_camera(double error) {
  Map map(kCamera, {});
  std::mt19937 rng(5);
  std::uniform_real_distribution<double> side(-2.5, 2.5), height(-1.5, 1.5), depth(1.5, 4);
  std::normal_distribution<double> noise(0, 0.002);
  std::vector<Eigen::Vector3d> points;
  for (int i = 0; i < 900; ++i) points.emplace_back(side(rng), height(rng), depth(rng));
  std::vector<LandmarkId> landmarks(points.size());
  for (int k = 0; k < 10; ++k) {
    const Pose T_world_camera(so3_exp({0.15 * std::sin(2.0 * k), 0.4 * std::sin(0.9 * k), 0}),
                              {0.02 * k, 0.03 * std::sin(k), 0});
    auto features = std::make_shared<Features>();
    std::vector<std::size_t> seen;
    for (std::size_t i = 0; i < points.size(); ++i) {
      const Eigen::Vector3d p = T_world_camera.inverse() * points[i];
      const Eigen::Vector2d uv = kCamera.project(p);
      if (p.z() < 0.1 || !kCamera.contains(uv.x(), uv.y())) continue;
      const double inverse = 1 / p.z() + error * true_error(uv.x(), uv.y()) + noise(rng);
      features->keypoints.push_back({.u = static_cast<float>(uv.x()),
                                     .v = static_cast<float>(uv.y()),
                                     .depth = static_cast<float>(1 / inverse)});
      features->descriptors.emplace_back();
      seen.push_back(i);
    }
    Keyframe made;
    made.T_world_camera = T_world_camera;
    made.static_weight.assign(features->size(), 1);
    made.features = std::move(features);
    const KeyframeId id = map.add_keyframe(std::move(made)).id;
    for (std::uint32_t j = 0; j < seen.size(); ++j) {
      LandmarkId& landmark = landmarks[seen[j]];
      if (landmark.valid())
        map.observe(landmark, {id, j});
      else
        landmark = map.add_landmark(points[seen[j]], {id, j}).id;
    }
  }
  return map;
}

TEST(MapDepthError, IsFoundFromLandmarksInDifferentPartsOfTheImages) {
  const auto found = depth_error_of(turning_camera(1));
  ASSERT_TRUE(found);
  const Eigen::Vector2d size(kCamera.width, kCamera.height);
  double worst = 0;
  for (int u = 40; u < kCamera.width; u += 40) {
    for (int v = 40; v < kCamera.height; v += 40)
      worst = std::max(worst, std::abs(found->at(u, v, size) - true_error(u, v)));
  }
  EXPECT_LT(worst, 0.006);  // of 0.045
}

TEST(MapDepthError, IsNoneForDepthsWithNoiseAlone) {
  EXPECT_FALSE(depth_error_of(turning_camera(0)));
}

TEST(MapDepthError, KeyframesOfEarlierSessionsDoNotCount) {
  EXPECT_FALSE(depth_error_of(Map(turning_camera(1).content())));
}

TEST(MapDepthError, MeasuredDepthsAreRestoredInABundle) {
  Map map = turning_camera(1);
  std::vector<KeyframeId> keyframes = keyframes_of(map, 0);
  const MapBundle corrected =
      make_bundle(map, keyframes, keyframes.size(), landmarks_seen_by(map, keyframes));
  BundleProblem measured = corrected.problem;
  restore_measured_depths(map, measured);
  EXPECT_EQ(measured.observations[7].depth, corrected.problem.observations[7].depth);
  map.set_depth_error(std::make_shared<SmoothDepthError>(SmoothDepthError::Nodes::Constant(0.02)));
  restore_measured_depths(map, measured);
  EXPECT_NEAR(1 / measured.observations[7].depth,
              1 / corrected.problem.observations[7].depth + 0.02, 1e-6);
}

}  // namespace
}  // namespace stillmap
