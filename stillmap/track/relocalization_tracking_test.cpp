// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/relocalization_tracking.hpp"

#include "stillmap/track/rendered_track_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

constexpr int kMinLandmarks = 25;

TEST(RelocalizationTracking, ASecondFrameConfirmsThePlace) {
  const auto confirmed =
      track_from_relocalization(model(), relocalization(kReference), *frame(3), kMinLandmarks);
  ASSERT_TRUE(confirmed);
  expect_pose(confirmed->pose.estimate.T_world_camera, 3);
  EXPECT_EQ(confirmed->state.local_map, local_map());
  EXPECT_EQ(confirmed->state.previous->frame, frame(kReference));
}

TEST(RelocalizationTracking, UsesTheReferenceKeyframeIfTheCameraMovedOn) {
  const auto confirmed =
      track_from_relocalization(model(), relocalization(kReference), *frame(12), kMinLandmarks);
  ASSERT_TRUE(confirmed);
  expect_pose(confirmed->pose.estimate.T_world_camera, 12);
}

TEST(RelocalizationTracking, AFrameOfAnotherPlaceDoesNotConfirmIt) {
  const auto found = relocalization(kReference);
  EXPECT_FALSE(track_from_relocalization(model(), found, *elsewhere(3), kMinLandmarks));
  EXPECT_FALSE(track_from_relocalization(model(), found, *blank(3), kMinLandmarks));
}

}  // namespace
}  // namespace stillmap
