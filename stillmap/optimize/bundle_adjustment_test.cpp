// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/bundle_adjustment.hpp"

#include "stillmap/optimize/synthetic.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using synthetic::BundleScene;

double worst_pose_error(const std::vector<Pose>& estimate, const std::vector<Pose>& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    worst = std::max(worst, (estimate[i].inverse() * truth[i]).log().norm());
  }
  return worst;
}

TEST(AdjustBundle, FindsTheExactPosesFromExactObservations) {
  const BundleScene scene = synthetic::bundle_scene(1, {4, 2, 200, 5}, {});
  const BundleResult result = adjust_bundle(scene.problem);
  EXPECT_LT(worst_pose_error(result.T_world_camera, scene.T_world_camera), 1e-6);
}

}  // namespace
}  // namespace stillmap
