// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/timing.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

TEST(Timing, SummarizesEachStageInTheOrderOfFirstSight) {
  TimingRecorder recorder;
  for (int ms = 100; ms >= 1; --ms) recorder.add("track", ms);
  recorder.add("decode", 7);
  const std::vector<StageTiming> stages = recorder.stages();
  ASSERT_EQ(stages.size(), 2u);
  EXPECT_EQ(stages[0].name, "track");
  EXPECT_EQ(stages[0].count, 100u);
  EXPECT_DOUBLE_EQ(stages[0].median, 50.5);
  EXPECT_DOUBLE_EQ(stages[0].mean, 50.5);
  EXPECT_DOUBLE_EQ(stages[0].p95, 95.05);
  EXPECT_DOUBLE_EQ(stages[0].p99, 99.01);
  EXPECT_DOUBLE_EQ(stages[0].max, 100);
  EXPECT_DOUBLE_EQ(stages[0].total, 5050);
  EXPECT_EQ(stages[1].name, "decode");
}

TEST(Timing, MergesRecordersOfSeveralThreads) {
  TimingRecorder a, b;
  a.add("track", 1);
  b.add("segment", 5);
  b.add("track", 3);
  a.merge(b);
  EXPECT_EQ(a.samples("track").size(), 2u);
  EXPECT_EQ(a.samples("segment").size(), 1u);
  EXPECT_TRUE(a.samples("unknown").empty());
  a.merge(a);
  EXPECT_EQ(a.samples("track").size(), 4u);
}

TEST(Timing, WritesTextAndJson) {
  TimingRecorder recorder;
  recorder.add("track", 12.5);
  const auto stages = recorder.stages();
  EXPECT_NE(timing_text(stages).find("12.50"), std::string::npos);
  const nlohmann::json json = stages;
  EXPECT_EQ(json.at(0).at("median_ms"), 12.5);
}

}  // namespace
}  // namespace stillmap
