// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/reference_keyframe_tracking.hpp"

#include "stillmap/track/rendered_track_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

TEST(ReferenceKeyframeTracking, RecoversThePoseWithoutAPrediction) {
  for (const std::size_t index : {2U, 10U}) {
    const auto pose =
        track_reference_keyframe(model(), *local_map(), true_pose(kReference), *frame(index));
    ASSERT_TRUE(pose) << index;
    expect_pose(pose->T_world_camera, index);
    EXPECT_GE(pose->matches.size(), 15U);
  }
}

TEST(ReferenceKeyframeTracking, FailsOnABlankImageAndElsewhere) {
  const Pose& guess = true_pose(kReference);
  EXPECT_FALSE(track_reference_keyframe(model(), *local_map(), guess, *blank(1)));
  EXPECT_FALSE(track_reference_keyframe(model(), *local_map(), guess, *elsewhere(1)));
}

TEST(ReferenceKeyframeTracking, FailsIfEverythingMoves) {
  auto moving = changeable(1);
  moving->evidence.weight.assign(moving->features->size(), 0);
  EXPECT_FALSE(track_reference_keyframe(model(), *local_map(), true_pose(kReference), *moving));
}

}  // namespace
}  // namespace stillmap
