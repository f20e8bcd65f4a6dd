// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_solver.hpp"

#include "stillmap/optimize/synthetic.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using synthetic::Noise;
using synthetic::PoseScene;

/// Translation and rotation error of an estimate.
struct PoseError {
  double metres, radians;
};

PoseError error_of(const Pose& estimate, const Pose& truth) {
  return {(estimate.translation() - truth.translation()).norm(),
          (estimate.inverse() * truth).angle()};
}

PoseSolution solve_from_nearby(const PoseScene& scene, unsigned seed, double metres = 0.1,
                               double radians = 0.05) {
  std::mt19937 rng(seed);
  return solve_pose(scene.camera,
                    scene.T_world_camera * synthetic::random_pose(rng, metres, radians),
                    scene.observations);
}

/// Observations in double would be exact; floats round pixels at 3e-5, which is the floor of the
/// error.
TEST(SolvePose, FindsTheExactPoseFromExactObservations) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const PoseScene scene = synthetic::pose_scene(seed, 300, {});
    const PoseSolution solution = solve_from_nearby(scene, seed);
    const PoseError error = error_of(solution.T_world_camera, scene.T_world_camera);
    EXPECT_LT(error.metres, 1e-6) << seed;
    EXPECT_LT(error.radians, 1e-6) << seed;
    EXPECT_EQ(solution.inliers, 300);
    EXPECT_EQ(solution.depth_inliers, 300);
    EXPECT_TRUE(solution.well_posed);
  }
}

}  // namespace
}  // namespace stillmap
