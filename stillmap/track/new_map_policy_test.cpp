// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/new_map_policy.hpp"

#include "stillmap/simulate/board.hpp"
#include "stillmap/track/rendered_track_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

/// Returns frame `index` with only the keypoints that a condition accepts.
template <typename Condition>
FramePtr only(std::size_t index, const Condition& accepts) {
  auto result = changeable(index);
  for (std::size_t i = 0; i < result->features->size(); ++i) {
    if (!accepts(result->features->keypoints[i])) result->evidence.weight[i] = 0;
  }
  return result;
}

/// Returns frame `index` behind a printed board.
FramePtr occluded(std::size_t index, const Board& board) {
  return frame_of(behind(board, *frame(index)->image, sequence().camera(), 0));
}

TEST(NewMap, StartsFromPointsSpreadOverTheImage) {
  EXPECT_EQ(reason_against_new_map(*frame(0), sequence().camera()), "");
}

TEST(NewMap, DoesNotStartFromPointsInOneCorner) {
  // All keypoints are moved into the first part of the image.
  auto features = std::make_shared<Features>(*frame(0)->features);
  for (Keypoint& k : features->keypoints) k.u /= 5, k.v /= 5;
  auto crowded = changeable(0);
  crowded->features = features;
  const std::string reason = reason_against_new_map(*crowded, sequence().camera());
  EXPECT_NE(reason.find("1 of 16 parts"), std::string::npos) << reason;
}

TEST(NewMap, NeedsStaticPointsWithDepth) {
  const auto moving = only(0, [](const Keypoint&) { return false; });
  const std::string reason = reason_against_new_map(*moving, sequence().camera());
  EXPECT_NE(reason.find("0 static keypoints"), std::string::npos) << reason;
  EXPECT_NE(reason_against_new_map(*blank(0), sequence().camera()), "");
}

TEST(NewMap, ANearSurfaceOccludesTheCamera) {
  const auto is_occluded_by = [](const Board& board) {
    return is_occluded(model(), *local_map(), true_pose(kReference), *occluded(0, board));
  };
  EXPECT_TRUE(is_occluded_by({.share = 1, .distance = 0.6}));
  EXPECT_FALSE(is_occluded_by({.share = 0.1, .distance = 0.6})) << "most of the view is free";
}

TEST(NewMap, AnotherPlaceIsNoOcclusion) {
  EXPECT_FALSE(is_occluded(model(), *local_map(), true_pose(kReference), *frame(0)));
  EXPECT_FALSE(is_occluded(model(), *local_map(), true_pose(kReference), *elsewhere(0)));
}

/// Returns the number of lost frames after which the policy wants a map.
int frames_until_map(NewMapPolicy& policy, const FramePtr& lost) {
  int count = 1;
  while (!policy.wants_map(model(), local_map(), true_pose(kReference), *lost) && count < 100)
    ++count;
  return count;
}

TEST(NewMap, ALostCameraWaits) {
  NewMapPolicy policy({.patience = 4, .occluded_patience = 7});
  EXPECT_EQ(frames_until_map(policy, frame(0)), 5);
  policy.reset();
  EXPECT_EQ(frames_until_map(policy, frame(0)), 5);
}

TEST(NewMap, AnOccludedCameraWaitsLonger) {
  NewMapPolicy policy({.patience = 4, .occluded_patience = 7});
  const FramePtr lost = occluded(0, {.share = 1, .distance = 0.6});
  ASSERT_EQ(reason_against_new_map(*lost, sequence().camera()), "");
  EXPECT_EQ(frames_until_map(policy, lost), 12);
}

TEST(NewMap, AFrameThatCannotStartAMapIsNotCounted) {
  NewMapPolicy policy({.patience = 1, .occluded_patience = 7});
  for (int i = 0; i < 5; ++i)
    EXPECT_FALSE(policy.wants_map(model(), local_map(), true_pose(kReference), *blank(0)));
  EXPECT_EQ(frames_until_map(policy, frame(0)), 2);
}

}  // namespace
}  // namespace stillmap
