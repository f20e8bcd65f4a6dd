// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_covariance.hpp"

#include "stillmap/optimize/synthetic.hpp"

#include <algorithm>
#include <array>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using synthetic::PoseScene;

/// Noise equal to the solver's default model.
constexpr synthetic::Noise kModelNoise{.pixel_sigma = 1.0, .disparity_sigma = 0.3};

/// Mean squared errors of many poses, by the information and by the covariance; 6 is expected.
struct MeanErrors {
  double by_information = 0, by_covariance = 0;
};

/// @param common_size  of an error that all keypoints in a part of the image, one of 5 x 5, have in
///                common, relative to that of the noise
MeanErrors mean_errors(double common_size) {
  constexpr unsigned kTrials = 200;
  constexpr std::size_t kCells = 5;
  MeanErrors mean;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    PoseScene scene = synthetic::pose_scene(seed, 300, kModelNoise);
    std::mt19937 rng(seed);
    std::normal_distribution<double> normal;
    std::array<Eigen::Vector3d, kCells * kCells> common;  // (u, v, disparity) [pixels]
    for (Eigen::Vector3d& error : common) {
      error = common_size * Eigen::Vector3d(kModelNoise.pixel_sigma * normal(rng),
                                            kModelNoise.pixel_sigma * normal(rng),
                                            kModelNoise.disparity_sigma * normal(rng));
    }
    for (PoseObservation& o : scene.observations) {
      const auto cell = [](float at, int size) {
        return std::min(kCells - 1,
                        static_cast<std::size_t>(kCells * at / static_cast<float>(size)));
      };
      const Eigen::Vector3d& error =
          common.at(kCells * cell(o.v, scene.camera.height) + cell(o.u, scene.camera.width));
      o.u += static_cast<float>(error.x());
      o.v += static_cast<float>(error.y());
      o.depth = static_cast<float>(scene.camera.bf() / (scene.camera.bf() / o.depth + error.z()));
    }
    const PoseSolution solution =
        solve_pose(scene.camera, scene.T_world_camera, scene.observations);
    const Vector6d xi = (scene.T_world_camera.inverse() * solution.T_world_camera).log();
    mean.by_information += xi.dot(solution.information * xi) / kTrials;
    mean.by_covariance +=
        xi.dot(pose_covariance(scene.camera, scene.observations, solution).llt().solve(xi)) /
        kTrials;
  }
  return mean;
}

TEST(PoseCovariance, HoldsForIndependentErrors) {
  const MeanErrors mean = mean_errors(0);
  EXPECT_GT(mean.by_covariance, 5);
  EXPECT_LT(mean.by_covariance, 8);
}

/// The error of a part is not that of independent groups of keypoints: it goes beyond the borders
/// of those of the jackknife, and a scalar factor holds for the mean of all directions.
TEST(PoseCovariance, GrowsWithErrorsThatNeighboringKeypointsHaveInCommon) {
  const MeanErrors mean = mean_errors(0.5);
  EXPECT_GT(mean.by_information, 18);
  EXPECT_GT(mean.by_covariance, 5);
  EXPECT_LT(mean.by_covariance, 11);
}

/// A prior, such as that of a camera at rest, makes the pose more certain.
TEST(PoseCovariance, ContainsThePrior) {
  const PoseScene scene = synthetic::pose_scene(0, 300, kModelNoise);
  const PosePrior prior{scene.T_world_camera, 1e12 * Matrix6d::Identity()};
  const PoseSolution solution =
      solve_pose(scene.camera, scene.T_world_camera, scene.observations, prior);
  EXPECT_LT(pose_covariance(scene.camera, scene.observations, solution).trace(), 1e-9);
}

}  // namespace
}  // namespace stillmap
