// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/keypoint_budget.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

void take(KeypointBudget& budget, int frames, double milliseconds, int landmarks = 300) {
  for (int i = 0; i < frames; ++i) budget.add_frame(milliseconds, 33, landmarks);
}

TEST(KeypointBudget, WantsAllWhileThereIsTime) {
  KeypointBudget budget(1000);
  EXPECT_EQ(budget.keypoints(), 1000);
  take(budget, 100, 25);
  EXPECT_EQ(budget.keypoints(), 1000);
}

TEST(KeypointBudget, OneSlowFrameIsForgiven) {
  KeypointBudget budget(1000);
  take(budget, 10, 15);
  take(budget, 1, 120);
  take(budget, 10, 15);
  EXPECT_GE(budget.keypoints(), 950);
}

TEST(KeypointBudget, WantsFewerWhileItFallsBehindAndNeverTooFew) {
  KeypointBudget budget(1000);
  int before = 1001;
  for (int i = 0; i < 12; ++i) {
    take(budget, 4, 40);
    EXPECT_LE(budget.keypoints(), before);
    before = budget.keypoints();
  }
  EXPECT_EQ(before, 400);
}

TEST(KeypointBudget, ComesBackWhenTheLoadHasGone) {
  KeypointBudget budget(1000);
  take(budget, 100, 60);
  take(budget, 100, 10);
  EXPECT_EQ(budget.keypoints(), 1000);
}

TEST(KeypointBudget, DoesNotShrinkWhileFewLandmarksAreTracked) {
  KeypointBudget budget(1000);
  take(budget, 100, 60, 100);
  EXPECT_EQ(budget.keypoints(), 1000);
  take(budget, 100, 60, 300);
  EXPECT_EQ(budget.keypoints(), 400);
  take(budget, 100, 60, 50);
  EXPECT_EQ(budget.keypoints(), 1000);
}

}  // namespace
}  // namespace stillmap
