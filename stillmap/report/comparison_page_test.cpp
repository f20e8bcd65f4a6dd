// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/comparison_page.hpp"

#include "stillmap/report/test_text.hpp"

#include <cmath>
#include <regex>
#include <utility>

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
  EXPECT_THAT(html, HasSubstr("gain [%]"));
  EXPECT_THAT(html, HasSubstr("href=\"comparison.csv\""));
  EXPECT_THAT(html, HasSubstr("&lt;static&gt;"));
  EXPECT_THAT(html, Not(HasSubstr("<static>")));
  EXPECT_THAT(html, Not(HasSubstr("http")));
  EXPECT_EQ(count(html, "role=\"img\""), 2 + 3)
      << "errors for wide and narrow pages; one path per run";
  EXPECT_EQ(count(html, "class=\"untrusted\""), 1) << "of the run without an evaluation";
}

TEST(ComparisonPage, ShowsTheMapsOfTheRuns) {
  const std::string html =
      comparison_page(two_systems(), {}, {{cv::Mat3b(20, 30), "map of <fused>"}, {{}, "no map"}});
  EXPECT_EQ(count(html, "<img alt=\"map of &lt;fused&gt;\" width=\"30\" height=\"20\""), 1);
  EXPECT_THAT(html, HasSubstr("<h2>Static maps</h2>"));
  EXPECT_THAT(html, Not(HasSubstr("no map")));
  EXPECT_THAT(comparison_page(two_systems(), {}), Not(HasSubstr("Static maps")));
}

TEST(ComparisonPage, RepeatsTheDoubtsOfARun) {
  Comparison comparison = two_systems();
  comparison.runs[1].findings = {make_finding("low-coverage", "no <floor> was seen")};
  const std::string html = comparison_page(comparison, {});
  EXPECT_THAT(html, HasSubstr("<p class=\"untrusted\"><b>Do not trust this result:</b> fused: no "
                              "&lt;floor&gt; was seen</p>"));
  EXPECT_EQ(count(html, "<td>fused (untrusted)</td>"), 3) << "a row of each table";
  EXPECT_EQ(count(html, ">fused (untrusted)</text>"), 3) << "two charts of errors, one path";
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

/// Returns the leftmost and rightmost x of the curves of a chart of errors [pixels].
std::pair<double, double> extent_of_curves(const std::string& svg) {
  const std::regex curve("<polyline points=\"([^\"]*)\" class=\"curve\""), point("([0-9.]+),");
  std::pair<double, double> extent{1e9, -1e9};
  for (std::sregex_iterator c(svg.begin(), svg.end(), curve), end; c != end; ++c) {
    const std::string points = (*c)[1];
    for (std::sregex_iterator p(points.begin(), points.end(), point); p != end; ++p) {
      const double x = std::stod((*p)[1]);
      extent = {std::min(extent.first, x), std::max(extent.second, x)};
    }
  }
  return extent;
}

TEST(ErrorDistribution, TheAxisOfTimeSpansTheRunsAndNotTheTruth) {
  const Trajectory path = wobbling(0.01);
  const std::vector<RecordedRun> runs{
      {"part", "", {path.begin() + 40, path.begin() + 60}, wobbling(0), 100},
      {"later part", "", {path.begin() + 50, path.begin() + 70}, wobbling(0), 100}};
  for (const double width : {1000.0, 400.0}) {
    const auto [left, right] =
        extent_of_curves(error_distribution_chart(compare_runs(runs), width).element());
    EXPECT_NEAR(left, 80, 1);
    EXPECT_NEAR(right, width - 16, 1);
  }
}

}  // namespace
}  // namespace stillmap
