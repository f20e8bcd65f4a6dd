// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/comparison_chart.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/report/test_text.hpp"

#include <algorithm>
#include <cmath>
#include <regex>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::count;
using ::testing::HasSubstr;
using ::testing::Not;

/// A loop in the x-z plane of a world with y down, with a wobble of the given size [m].
Trajectory wobbling(double size) {
  Trajectory trajectory;
  for (int i = 0; i < 200; ++i) {
    const double t = i / 30.0;
    trajectory.push_back({t, Pose(so3_exp({0, 0.2 * std::sin(t), 0}),
                                  {std::sin(t) + size * std::sin(9 * t), 0.2 * std::sin(3 * t),
                                   0.7 * std::cos(t) + size * std::cos(7 * t)})});
  }
  return trajectory;
}

std::vector<RecordedRun> two_systems() {
  return {{"static", "walk", wobbling(0.08), wobbling(0), 200},
          {"seg-mask", "walk", wobbling(0.02), wobbling(0), 200}};
}

TEST(ComparisonChart, ShowsTruthEstimateAndErrorsOfEveryRun) {
  const std::string svg = comparison_chart(compare_runs(two_systems())).element();
  EXPECT_EQ(count(svg, "<polyline"), 4) << "truth and estimate of two runs";
  EXPECT_EQ(count(svg, "class=\"error\""), 2 * 200 + 1) << "one per pose, one in the legend";
  EXPECT_THAT(svg, HasSubstr(">static, walk<"));
  EXPECT_THAT(svg, HasSubstr("200/200 frames"));
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
}

TEST(ComparisonChart, HasAtMostThreePanelsInARow) {
  std::vector<RecordedRun> runs = two_systems();
  runs.insert(runs.end(), {runs[0], runs[1], runs[0]});
  const std::string svg = comparison_chart(compare_runs(runs)).element();
  EXPECT_THAT(svg, HasSubstr("viewBox=\"0 0 1920 1288\""));  // three panels wide, two high
}

TEST(ComparisonChart, ShowsARunThatCannotBeEvaluated) {
  std::vector<RecordedRun> runs = two_systems();
  for (auto& pose : runs[1].estimate) pose.timestamp += 1000;
  EXPECT_THAT(comparison_chart(compare_runs(runs)).element(), HasSubstr("not evaluated"));
  EXPECT_THROW(comparison_chart({}), Error);
}

TEST(ComparisonChart, TheFileNeedsNoOtherStyleSheet) {
  const std::string file = comparison_chart(compare_runs(two_systems())).file();
  EXPECT_THAT(file, HasSubstr("xmlns=\"http://www.w3.org/2000/svg\""));
  EXPECT_THAT(file, HasSubstr("svg .path { fill: none; stroke: #"));
  EXPECT_THAT(file, Not(HasSubstr("var(--")));
}

}  // namespace
}  // namespace stillmap
