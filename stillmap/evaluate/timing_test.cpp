// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/timing.hpp"

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

TEST(Timing, WritesTextAndJson) {
  StageTimes times;
  times.add("track", 12.5);
  const auto stages = times.stages();
  EXPECT_NE(timing_text(stages).find("12.50"), std::string::npos);
  const nlohmann::json json = stages;
  EXPECT_EQ(json.at(0).at("median_ms"), 12.5);
}

}  // namespace
}  // namespace stillmap
