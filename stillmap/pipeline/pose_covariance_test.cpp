// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/recording_test.hpp"

#include <algorithm>
#include <string>
#include <vector>

#include <Eigen/Cholesky>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using recorded::Recording, recorded::recording, recorded::small_options;

SlamResult result_of(const Recording& rec, bool smooth) {
  SlamParameters options = small_options("fused");
  options.smooth_trajectory = smooth;
  SlamSystem slam(rec.sequence->camera(), options);
  for (const RgbdFramePtr& frame : rec.frames) slam.push(frame);
  return slam.finish();
}

/// Returns the mean of the transforms from the true to the estimated world.
Pose mean_alignment(const SlamResult& result, const Recording& rec) {
  Eigen::Matrix3d rotations = Eigen::Matrix3d::Zero();
  Eigen::Vector3d estimated = Eigen::Vector3d::Zero(), truth = Eigen::Vector3d::Zero();
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    const Pose T_true = rec.sequence->T_world_camera(i);
    rotations +=
        result.poses[i].T_world_camera.rotation() * T_true.quaternion().conjugate().matrix();
    estimated += result.poses[i].T_world_camera.translation();
    truth += T_true.translation();
  }
  const auto n = static_cast<double>(result.poses.size());
  const Eigen::Matrix3d R = nearest_rotation(rotations);
  return {R, (estimated - R * truth) / n};
}

/// Returns the squared errors of the poses over their covariances, after an alignment.
std::vector<double> normalized_errors(const SlamResult& result, const Recording& rec) {
  const Pose T_estimated_true = mean_alignment(result, rec);
  std::vector<double> errors;
  for (std::size_t i = 0; i < result.poses.size(); ++i) {
    if (!(result.poses[i].covariance.trace() > 0)) continue;
    const Pose E = result.poses[i].T_world_camera.inverse() * T_estimated_true *
                   rec.sequence->T_world_camera(i);
    const Vector6d e = E.log();
    errors.push_back(e.dot(result.poses[i].covariance.ldlt().solve(e)));
  }
  return errors;
}

/// With six degrees of freedom the mean is 6, and 95 % are below 12.6. The bounds allow standard
/// deviations that are wrong by a factor of 1.5.
TEST(PoseCovariance, ErrorsOnRenderedFramesFollowIt) {
  for (const char* camera : {"xyz", "rpy"}) {
    for (const bool smooth : {false, true}) {
      const Recording& rec = recording(1, camera);
      const SlamResult result = result_of(rec, smooth);
      ASSERT_EQ(result.poses.size(), rec.frames.size());
      const std::vector<double> errors = normalized_errors(result, rec);
      double sum = 0;
      for (const double error : errors) sum += error;
      const double mean = sum / static_cast<double>(errors.size());
      const auto within =
          std::count_if(errors.begin(), errors.end(), [](double error) { return error < 28; });
      RecordProperty(std::string(camera) + (smooth ? "_smooth" : ""), std::to_string(mean));
      EXPECT_GT(mean, 3) << camera << smooth;
      EXPECT_LT(mean, 14) << camera << smooth;
      EXPECT_GT(within, 0.9 * static_cast<double>(errors.size())) << camera << smooth;
    }
  }
}

}  // namespace
}  // namespace stillmap
