// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/keypoint_budget.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

void take(KeypointBudget& pace, int frames, double milliseconds, int landmarks = 300) {
  for (int i = 0; i < frames; ++i) pace.took(milliseconds, 33, landmarks);
}

TEST(KeypointBudget, WantsAllWhileThereIsTime) {
  KeypointBudget pace(1000);
  EXPECT_EQ(pace.keypoints(), 1000);
  take(pace, 100, 25);
  EXPECT_EQ(pace.keypoints(), 1000);
}

TEST(KeypointBudget, OneSlowFrameIsForgiven) {
  KeypointBudget pace(1000);
  take(pace, 10, 15);
  take(pace, 1, 120);
  take(pace, 10, 15);
  EXPECT_GE(pace.keypoints(), 950);
}

TEST(KeypointBudget, WantsFewerWhileItFallsBehindAndNeverTooFew) {
  KeypointBudget pace(1000);
  int before = 1001;
  for (int i = 0; i < 12; ++i) {
    take(pace, 4, 40);
    EXPECT_LE(pace.keypoints(), before);
    before = pace.keypoints();
  }
  EXPECT_EQ(before, 400);
}

TEST(KeypointBudget, ComesBackWhenTheLoadHasGone) {
  KeypointBudget pace(1000);
  take(pace, 100, 60);
  take(pace, 100, 10);
  EXPECT_EQ(pace.keypoints(), 1000);
}

TEST(KeypointBudget, DoesNotEconomizeOnWhatHoldsTheCamera) {
  KeypointBudget pace(1000);
  take(pace, 100, 60, 100);
  EXPECT_EQ(pace.keypoints(), 1000);
  take(pace, 100, 60, 300);
  EXPECT_EQ(pace.keypoints(), 400);
  take(pace, 100, 60, 50);
  EXPECT_EQ(pace.keypoints(), 1000);
}

}  // namespace
}  // namespace stillmap
