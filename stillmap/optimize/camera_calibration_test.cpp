// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/camera_calibration.hpp"

#include "stillmap/optimize/synthetic.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr synthetic::BundleShape kShape{.free_poses = 29, .fixed_poses = 1, .points = 4000};
constexpr synthetic::Noise kNoise{.pixel_sigma = 1.0, .disparity_sigma = 0.3};

/// Returns observations of the default camera; the initial values of the problem have errors.
BundleProblem recorded() { return synthetic::bundle_scene(1, kShape, kNoise).problem; }

/// Gives every depth a disparity error: 1 / measured = 1 / z + offset + bow r^2, r = 1 in the
/// corners.
void bias_depth(double offset, double bow, BundleProblem& problem) {
  const Camera& camera = problem.camera;
  for (BundleObservation& o : problem.observations) {
    const double error = offset + bow * camera.squared_radius(o.u, o.v);
    if (o.depth > 0) o.depth = static_cast<float>(1 / (1 / o.depth + error));
  }
}

void expect_within_three_sigma(const CameraCalibration& found, const CameraVector& truth) {
  for (int i = 0; i < kCameraParameters; ++i)
    EXPECT_LT(std::abs(found.correction(i) - truth(i)), 3 * found.sigma(i)) << "parameter " << i;
}

TEST(CameraCalibration, FindsNoErrorOfAPerfectCamera) {
  const CameraCalibration found = calibrate_camera(recorded());
  expect_within_three_sigma(found, CameraVector::Zero());
}

TEST(CameraCalibration, FindsIntrinsicsOffByOnePercent) {
  BundleProblem problem = recorded();
  CameraVector truth = CameraVector::Zero();
  truth.head<4>() << 5.25, -5.25, 3.2, -2.4;
  const double bf = problem.camera.bf();
  problem.camera.fx -= truth(kFx), problem.camera.fy -= truth(kFy);
  problem.camera.cx -= truth(kCx), problem.camera.cy -= truth(kCy);
  problem.camera.baseline = bf / problem.camera.fx;
  const CameraCalibration found = calibrate_camera(problem);
  expect_within_three_sigma(found, truth);
  for (int i = kFx; i <= kCy; ++i) EXPECT_LT(found.sigma(i), 2.5) << "parameter " << i;
}

TEST(CameraCalibration, FindsOffsetAndBowOfTheDisparity) {
  BundleProblem problem = recorded();
  bias_depth(0.02, -0.01, problem);
  CameraVector truth = CameraVector::Zero();
  truth.segment<2>(kDisparityOffset) << 0.02, -0.01;
  const CameraCalibration found = calibrate_camera(problem);
  expect_within_three_sigma(found, truth);
  EXPECT_LT(found.sigma(kDisparityOffset), 0.002);
  EXPECT_LT(found.sigma(kDisparityBow), 0.002);
}

TEST(CameraCalibration, TakesAScaleOfTheDepthForThatOfTheMap) {
  BundleProblem problem = recorded();
  for (BundleObservation& o : problem.observations) o.depth *= 0.95F;
  expect_within_three_sigma(calibrate_camera(problem), CameraVector::Zero());
}

TEST(CameraCalibration, OutliersDoNotMatter) {
  synthetic::Noise noise = kNoise;
  noise.outliers = 0.02, noise.depth_outliers = 0.05, noise.depthless = 0.1;
  const CameraCalibration found =
      calibrate_camera(synthetic::bundle_scene(1, kShape, noise).problem);
  EXPECT_LT(std::abs(found.correction(kFx)), 4 * found.sigma(kFx));
  EXPECT_LT(std::abs(found.correction(kDisparityOffset)), 0.004);
}

/// Persistent depth errors, such as those of delayed depth images while the camera turns, look like
/// errors of the camera. Here they drift over the sequence: the estimates are off by more than
/// independent errors of this size would allow, and the standard deviations must reflect it.
TEST(CameraCalibration, ErrorsThatLastMakeItLessCertain) {
  BundleProblem problem = recorded();
  const CameraCalibration independent = calibrate_camera(problem);
  const Camera& camera = problem.camera;
  for (BundleObservation& o : problem.observations) {
    const double drift = 0.02 * std::sin(0.7 * o.pose) * (o.v - camera.cy) / camera.height;
    if (o.depth > 0) o.depth = static_cast<float>(1 / (1 / o.depth + drift));
  }
  const CameraCalibration found = calibrate_camera(problem);
  EXPECT_GT(found.sigma(kFy), 1.5 * independent.sigma(kFy));
  for (int i = kFx; i <= kCy; ++i)
    EXPECT_LT(std::abs(found.correction(i)), 2 * found.sigma(i)) << "parameter " << i;
}

TEST(CameraCalibration, ACameraAtRestShowsNeitherIntrinsicsNorDepthErrors) {
  BundleProblem problem = recorded();
  Pose still = problem.T_world_camera.front();
  for (Pose& pose : problem.T_world_camera) pose = still;
  for (BundleObservation& o : problem.observations) {
    const Eigen::Vector3d uvd = predict(problem.camera, still.inverse() * problem.points[o.point]);
    o.u = static_cast<float>(uvd.x()), o.v = static_cast<float>(uvd.y());
    o.depth = static_cast<float>(problem.camera.bf() / uvd.z());
    if (uvd.z() <= 0.1) o.weight = 0;
  }
  const CameraCalibration found = calibrate_camera(problem);
  EXPECT_GT(found.sigma(kFx), 20);
  EXPECT_GT(found.sigma(kCx), 20);
  EXPECT_GT(found.sigma(kDisparityOffset), 0.025);
}

}  // namespace
}  // namespace stillmap
