// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/stage_times.hpp"

#include "stillmap/base/statistics.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(StageTimes, SummarizesEachStageInTheOrderOfFirstSight) {
  StageTimes times;
  for (int ms = 100; ms >= 1; --ms) times.add("track", ms);
  times.add("decode", 7);
  const std::vector<StageTiming> stages = times.stages();
  ASSERT_EQ(stages.size(), 2U);
  EXPECT_EQ(stages[0].name, "track");
  EXPECT_EQ(stages[0].count, 100U);
  EXPECT_DOUBLE_EQ(stages[0].median, 50.5);
  EXPECT_DOUBLE_EQ(stages[0].mean, 50.5);
  EXPECT_DOUBLE_EQ(stages[0].p95, 95.05);
  EXPECT_DOUBLE_EQ(stages[0].p99, 99.01);
  EXPECT_DOUBLE_EQ(stages[0].max, 100);
  EXPECT_DOUBLE_EQ(stages[0].total, 5050);
  EXPECT_EQ(stages[1].name, "decode");
}

TEST(StageTimes, PartsOfAStageOnTwoThreadsAreOneStage) {
  StageSamples a, b;
  a.add(1);
  b.add(2);
  b.add(4);
  StageTimes times;
  times.append("loop", a);
  times.append("loop", b);
  times.append("none", StageSamples());
  ASSERT_EQ(times.stages().size(), 1U);
  EXPECT_EQ(times.stages()[0].count, 3U);
  EXPECT_EQ(times.stages()[0].total, 7);
}

TEST(StageTimes, AnUnknownStageHasNoSamples) {
  StageTimes times;
  times.add("track", 1);
  EXPECT_EQ(times.samples("track").size(), 1U);
  EXPECT_TRUE(times.samples("unknown").empty());
}

/// A ramp: every part of the run must stay represented, in order.
TEST(StageSamples, AreBoundedAndStaySpreadOverTheRun) {
  StageSamples samples;
  constexpr std::size_t kAdded = 5 * StageSamples::kMost;
  for (std::size_t i = 0; i < kAdded; ++i) samples.add(static_cast<double>(i));
  const auto kept = samples.kept();
  EXPECT_LE(kept.size(), StageSamples::kMost);
  EXPECT_GE(kept.size(), StageSamples::kMost / 2);
  const double step = kept[1] - kept[0];
  for (std::size_t i = 0; i < kept.size(); ++i) {
    ASSERT_EQ(kept[i], static_cast<double>(i) * step);
  }
  EXPECT_GT(kept.back() + step, static_cast<double>(kAdded) - 1);
  const StageTiming timing = samples.summary("ramp");
  EXPECT_EQ(timing.count, kAdded);
  EXPECT_EQ(timing.max, static_cast<double>(kAdded) - 1);
  EXPECT_NEAR(timing.median, static_cast<double>(kAdded) / 2, step);
}

TEST(Quantile, InterpolatesBetweenTheTwoNearest) {
  EXPECT_EQ(quantile(std::vector<double>{}, 0.5), 0);
  EXPECT_DOUBLE_EQ(quantile(std::vector<double>{3, 1, 2}, 0.5), 2);
  EXPECT_DOUBLE_EQ(quantile(std::vector<double>{4, 1, 3, 2}, 0.5), 2.5);
  EXPECT_DOUBLE_EQ(quantile(std::vector<double>{4, 1, 3, 2}, 1), 4);
}

}  // namespace
}  // namespace stillmap
