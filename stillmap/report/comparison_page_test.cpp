// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/comparison_page.hpp"

#include "stillmap/report/test_text.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::count;
using ::testing::HasSubstr;
using ::testing::Not;

/// Returns a path of 100 frames with a wobble of the given size [m].
Trajectory wobbling(double size) {
  Trajectory trajectory;
  for (int i = 0; i < 100; ++i) {
    const double t = i / 30.0;
    trajectory.push_back({t, Pose(Eigen::Quaterniond::Identity(),
                                  {std::sin(t) + size * std::sin(9 * t), 0.1 * std::cos(t), t})});
  }
  return trajectory;
}

Comparison two_systems() {
  const std::vector<RecordedRun> runs{{"<static>", "", wobbling(0.3), wobbling(0), 100},
                                      {"fused", "", wobbling(0.001), wobbling(0), 100},
                                      {"empty", "", {}, wobbling(0), 100}};
  return compare_runs(runs);
}

TEST(ComparisonPage, ShowsTablesChartsAndFiles) {
  const std::string html = comparison_page(two_systems(), {"comparison.csv"});
  EXPECT_THAT(html, HasSubstr("ATE translation [m]"));
  EXPECT_THAT(html, HasSubstr("improved [%]"));
  EXPECT_THAT(html, HasSubstr("href=\"comparison.csv\""));
  EXPECT_THAT(html, HasSubstr("&lt;static&gt;"));
  EXPECT_THAT(html, Not(HasSubstr("<static>")));
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_EQ(count(html, "role=\"img\""), 2) << "two charts";
}

TEST(ErrorDistribution, HasABoxAndACurvePerEvaluatedRun) {
  const std::string svg = error_distribution_chart(two_systems()).element();
  EXPECT_EQ(count(svg, "class=\"box\""), 2);
  EXPECT_EQ(count(svg, "class=\"median\""), 2);
  EXPECT_EQ(count(svg, "class=\"curve\""), 2);
  EXPECT_EQ(count(svg, "not evaluated"), 1);
  EXPECT_THAT(svg, Not(HasSubstr("nan")));
  EXPECT_EQ(count(error_distribution_chart({}).element(), "class=\"box\""), 0);
}

}  // namespace
}  // namespace stillmap
