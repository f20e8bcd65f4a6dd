// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_solver.hpp"

#include "stillmap/optimize/synthetic.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using synthetic::Noise;
using synthetic::PoseScene;

constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();

/// Noise equal to the solver's default model.
constexpr Noise kModelNoise{.pixel_sigma = 1.0, .disparity_sigma = 0.3};

double distance(const Pose& a, const Pose& b) { return (a.inverse() * b).log().norm(); }

/// Returns the squared error in units of the predicted covariance: chi-square with 6 degrees of
/// freedom.
double mahalanobis(const PoseSolution& solution, const Pose& truth) {
  const Vector6d xi = (truth.inverse() * solution.T_world_camera).log();
  return xi.dot(solution.information * xi);
}

PoseSolution solve_from_nearby(const PoseScene& scene, unsigned seed, double meters = 0.1,
                               double radians = 0.05) {
  std::mt19937 rng(seed);
  const Pose guess = scene.T_world_camera * synthetic::random_pose(rng, meters, radians);
  return solve_pose(scene.camera, guess, scene.observations);
}

TEST(SolvePose, FindsTheExactPoseFromExactObservations) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 300, {});
    const PoseSolution solution = solve_from_nearby(scene, seed);
    EXPECT_LT(distance(solution.T_world_camera, scene.T_world_camera), 1e-8) << seed;
    EXPECT_EQ(solution.inliers, 300);
    EXPECT_EQ(solution.depth_inliers, 300);
    EXPECT_LT(solution.rms, 1e-6);
    EXPECT_TRUE(solution.well_posed);
  }
}

TEST(SolvePose, NeedsNoDepth) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 100, {.depthless = 1});
    const PoseSolution solution = solve_from_nearby(scene, seed);
    EXPECT_LT(distance(solution.T_world_camera, scene.T_world_camera), 1e-8) << seed;
    EXPECT_EQ(solution.inliers, 100);
    EXPECT_EQ(solution.depth_inliers, 0);
  }
}

/// The information matrix must match the spread of the errors. The mean of a chi-square with 6
/// degrees of freedom over 100 trials is 6 +- 0.35; cutting the tails at 95 % adds an error that
/// the information does not include.
TEST(SolvePose, ErrorsMatchTheInformationMatrix) {
  double sum = 0, rms = 0;
  constexpr unsigned kTrials = 100;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 200, kModelNoise);
    const PoseSolution solution = solve_from_nearby(scene, seed);
    const double error = mahalanobis(solution, scene.T_world_camera);
    EXPECT_LT(error, 35) << seed;
    EXPECT_TRUE(solution.well_posed);
    sum += error, rms += solution.rms;
  }
  EXPECT_NEAR(sum / kTrials, 6.5, 1.5);
  // The standard deviation of a normal distribution cut at its 95 % quantile is 0.9.
  EXPECT_NEAR(rms / kTrials, 0.9, 0.05);
}

TEST(SolvePose, FindsOutliersAmongNoise) {
  Noise noise = kModelNoise;
  noise.outliers = 0.3;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 300, noise);
    const PoseSolution solution = solve_from_nearby(scene, seed);
    EXPECT_LT(mahalanobis(solution, scene.T_world_camera), 35) << seed;
    int wrongly_kept = 0, wrongly_dropped = 0, good = 0;
    for (std::size_t i = 0; i < scene.observations.size(); ++i) {
      wrongly_kept += scene.corruption[i].pixel && solution.inlier[i];
      wrongly_dropped += !scene.corruption[i].pixel && !solution.inlier[i];
      good += !scene.corruption[i].pixel;
    }
    EXPECT_LE(wrongly_kept, 2) << seed;               // An outlier may hit the right pixel.
    EXPECT_LT(wrongly_dropped, 0.12 * good) << seed;  // The chi-square test itself drops 5 %.
  }
}

TEST(SolvePose, AWrongDepthDiscardsTheDepthAndNotThePixel) {
  Noise noise = kModelNoise;
  noise.depth_outliers = 0.4;
  for (unsigned seed = 0; seed < 30; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 300, noise);
    const PoseSolution solution = solve_from_nearby(scene, seed);
    EXPECT_LT(mahalanobis(solution, scene.T_world_camera), 35) << seed;
    int pixels_kept = 0, depths_kept = 0, count = 0;
    for (std::size_t i = 0; i < scene.observations.size(); ++i) {
      if (!scene.corruption[i].depth) continue;
      ++count;
      pixels_kept += solution.inlier[i];
      depths_kept += solution.depth_inlier[i];
    }
    EXPECT_GT(pixels_kept, 0.88 * count) << seed;
    EXPECT_LT(depths_kept, 0.05 * count) << seed;
  }
}

TEST(SolvePose, IgnoresObservationsWithoutWeight) {
  PoseScene scene = synthetic::pose_scene(3, 200, kModelNoise);
  const PoseSolution expected = solve_from_nearby(scene, 5);
  for (int i = 0; i < 200; ++i) {  // Half of the observations move 30 pixels to the right.
    PoseObservation o = scene.observations[static_cast<std::size_t>(i)];
    o.u += 30, o.weight = i % 2 ? 0.0F : -1.0F;
    scene.observations.push_back(o);
  }
  const PoseSolution solution = solve_from_nearby(scene, 5);
  EXPECT_EQ(distance(solution.T_world_camera, expected.T_world_camera), 0);
  EXPECT_EQ(solution.inliers, expected.inliers);
  EXPECT_EQ(std::count(solution.inlier.begin() + 200, solution.inlier.end(), 1), 0);
}

TEST(SolvePose, WeightMultipliesInformation) {
  PoseScene scene = synthetic::pose_scene(4, 200, {});
  const PoseSolution full = solve_from_nearby(scene, 5);
  for (PoseObservation& o : scene.observations) o.weight = 0.25F;
  const PoseSolution quarter = solve_from_nearby(scene, 5);
  EXPECT_LT((full.information - 4 * quarter.information).norm(), 1e-6 * full.information.norm());
}

TEST(SolvePose, ObservationsOfLowWeightPullLess) {
  // Half of the observations have weight 1; the other half moved coherently by 2 pixels and has a
  // low weight. Both halves stay inliers.
  PoseScene scene = synthetic::pose_scene(4, 400, {});
  for (std::size_t i = 0; i < 200; ++i) scene.observations[i].u += 2;
  const auto error_with_weight = [&](float weight) {
    for (std::size_t i = 0; i < 200; ++i) scene.observations[i].weight = weight;
    const PoseSolution solution = solve_from_nearby(scene, 5, 0.01, 0.005);
    EXPECT_GT(solution.inliers, 390);
    return distance(solution.T_world_camera, scene.T_world_camera);
  };
  EXPECT_LT(error_with_weight(0.1F), 0.5 * error_with_weight(1));
}

TEST(SolvePose, ReturnsTheGuessWithoutObservations) {
  const PoseScene scene = synthetic::pose_scene(1, 0, {});
  const PoseSolution solution = solve_from_nearby(scene, 1);
  EXPECT_LT(distance(solution.T_world_camera, scene.T_world_camera), 1);
  EXPECT_FALSE(solution.well_posed);
  EXPECT_EQ(solution.inliers, 0);
}

TEST(SolvePose, OneOrTwoObservationsAreNotWellPosed) {
  for (const int count : {1, 2}) {
    const PoseScene scene = synthetic::pose_scene(1, count, {});
    const PoseSolution solution = solve_from_nearby(scene, 1, 0.01, 0.01);
    EXPECT_FALSE(solution.well_posed) << count;
    EXPECT_LT(distance(solution.T_world_camera, scene.T_world_camera), 0.5) << count;
  }
}

TEST(SolvePose, PointsOnALineAreNotWellPosed) {
  PoseScene scene = synthetic::pose_scene(2, 0, {});
  const Pose T_camera_world = scene.T_world_camera.inverse();
  for (int i = 0; i < 50; ++i) {
    const Eigen::Vector3d p_camera(-0.5 + 0.02 * i, 0.1, 2 + 0.01 * i);
    PoseObservation o;
    o.p_world = scene.T_world_camera * p_camera;
    const Eigen::Vector3d uvd = predict(scene.camera, T_camera_world * o.p_world);
    o.u = static_cast<float>(uvd.x()), o.v = static_cast<float>(uvd.y());
    o.depth = static_cast<float>(p_camera.z());
    scene.observations.push_back(o);
  }
  const PoseSolution solution = solve_from_nearby(scene, 1, 0.01, 0.01);
  EXPECT_FALSE(solution.well_posed);
  EXPECT_GT(solution.inliers, 45);
  EXPECT_TRUE(std::isfinite(solution.T_world_camera.translation().norm()));
}

TEST(SolvePose, DropsPointsBehindTheCamera) {
  PoseScene scene = synthetic::pose_scene(6, 200, kModelNoise);
  const PoseSolution expected = solve_from_nearby(scene, 1, 0.02, 0.02);
  // The points are mirrored through the center: same pixel, behind the camera.
  for (std::size_t i = 0; i < 60; ++i) {
    PoseObservation o = scene.observations[i];
    o.p_world = scene.T_world_camera * -(scene.T_world_camera.inverse() * o.p_world);
    scene.observations.push_back(o);
  }
  const PoseSolution solution = solve_from_nearby(scene, 1, 0.02, 0.02);
  EXPECT_LT(distance(solution.T_world_camera, expected.T_world_camera), 1e-5);
  EXPECT_EQ(std::count(solution.inlier.begin() + 200, solution.inlier.end(), 1), 0);
}

TEST(SolvePose, IgnoresEveryKindOfBadNumber) {
  PoseScene scene = synthetic::pose_scene(7, 200, kModelNoise);
  const PoseSolution expected = solve_from_nearby(scene, 1);
  const auto spoil = [&](auto&& change) {
    PoseObservation o = scene.observations.front();
    o.u += 50;  // The error would be visible if it were used.
    change(o);
    scene.observations.push_back(o);
  };
  spoil([](PoseObservation& o) { o.u = kNaN; });
  spoil([](PoseObservation& o) { o.v = HUGE_VALF; });
  spoil([](PoseObservation& o) { o.weight = kNaN; });
  spoil([](PoseObservation& o) { o.scale = 0; });
  spoil([](PoseObservation& o) { o.p_world.x() = kNaN; });
  spoil([](PoseObservation& o) { o.p_world.y() = 1e300; });
  const PoseSolution solution = solve_from_nearby(scene, 1);
  EXPECT_EQ(distance(solution.T_world_camera, expected.T_world_camera), 0);

  for (PoseObservation& o : scene.observations) o.depth = kNaN;  // The pixels alone must suffice.
  const PoseSolution without_depth = solve_from_nearby(scene, 1);
  EXPECT_LT(mahalanobis(without_depth, scene.T_world_camera), 35);
  EXPECT_EQ(without_depth.depth_inliers, 0);
}

TEST(SolvePose, ReturnsAnInvalidGuessUnchanged) {
  const PoseScene scene = synthetic::pose_scene(8, 100, {});
  const Pose guess(Eigen::Quaterniond::Identity(), {kNaN, 0, 0});
  EXPECT_FALSE(solve_pose(scene.camera, guess, scene.observations).well_posed);
}

TEST(SolvePose, ConvergesFromADistantGuessWithOutliers) {
  Noise noise = kModelNoise;
  noise.outliers = 0.3;
  int found = 0;
  for (unsigned seed = 0; seed < 50; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 200, noise);
    const PoseSolution solution = solve_from_nearby(scene, seed, 0.3, 0.2);
    found += mahalanobis(solution, scene.T_world_camera) < 35;
  }
  EXPECT_GE(found, 49);
}

}  // namespace
}  // namespace stillmap
