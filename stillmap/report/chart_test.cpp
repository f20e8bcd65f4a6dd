// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/chart.hpp"

#include "stillmap/report/svg.hpp"

#include <algorithm>
#include <cmath>
#include <regex>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using Labels = std::vector<std::string>;

TEST(ChartAxes, TicksAreRoundAndInsideTheRange) {
  EXPECT_EQ(tick_labels(nice_ticks({-0.73, 1.31}, 5)), (Labels{"-0.5", "0.0", "0.5", "1.0"}));
  EXPECT_EQ(tick_labels(nice_ticks({0, 20}, 5)), (Labels{"0", "5", "10", "15", "20"}));
  EXPECT_EQ(tick_labels(nice_ticks({0, 0.009}, 4)), (Labels{"0.000", "0.005"}));
  EXPECT_EQ(tick_labels(nice_ticks({-1, 1}, 2), /*reversed=*/true), (Labels{"1", "0", "-1"}));
  EXPECT_TRUE(nice_ticks({}, 5).empty());
  EXPECT_TRUE(nice_ticks({1, 1}, 5).empty());
}

TEST(ChartAxes, RangeIgnoresValuesThatAreNotFinite) {
  ValueRange range;
  EXPECT_TRUE(range.empty());
  range.include(NAN);
  EXPECT_TRUE(range.empty());
  range.include(3);
  range.include(-1);
  EXPECT_EQ(range.low, -1);
  EXPECT_EQ(range.high, 3);
}

TEST(ChartAxes, UpIsTheMeanUpwardDirectionOfTheCameras) {
  // A camera's y axis points down in its image.
  const Trajectory y_down{{0, Pose()}, {1, Pose(so3_exp({0.3, 0.5, 0}), {0, 0, 0})}};
  EXPECT_EQ(up_axis(y_down), Eigen::Vector3d(0, -1, 0));
  const Trajectory z_up{{0, Pose(so3_exp({-M_PI / 2, 0, 0}), {0, 0, 0})}};
  EXPECT_EQ(up_axis(z_up), Eigen::Vector3d(0, 0, 1));
}

TEST(ChartAxes, PlanesAreNeverMirrored) {
  for (int i = 0; i < 3; ++i) {
    for (const double sign : {-1.0, 1.0}) {
      const Eigen::Vector3d up = sign * Eigen::Vector3d::Unit(i);
      const ProjectionPlane plane = plane_from_above(up);
      const auto direction = [](const PlaneAxis& axis) -> Eigen::Vector3d {
        return (axis.reversed ? -1.0 : 1.0) * Eigen::Vector3d::Unit(axis.axis);
      };
      EXPECT_EQ(direction(plane.right).cross(direction(plane.up)), up);
    }
  }
}

TEST(ChartAxes, TheSideViewShowsTheWiderSide) {
  const std::vector<Eigen::Vector3d> points{{0, 0, 0}, {1, 9, 3}};
  const ProjectionPlane plane = plane_from_the_side({0, -1, 0}, points);
  EXPECT_EQ(plane.right.axis, 2);
  EXPECT_EQ(plane.up.axis, 1);
  EXPECT_TRUE(plane.up.reversed);
  EXPECT_EQ(plane({4, 5, 6}), Eigen::Vector2d(6, -5));
}

TEST(ContinuousRanges, AreInterruptedWhereTrackingWasLost) {
  using Ranges = std::vector<std::pair<std::size_t, std::size_t>>;
  EXPECT_EQ(continuous_ranges(std::vector<double>{0, 1, 2, 9, 10}), (Ranges{{0, 3}, {3, 5}}));
  EXPECT_EQ(continuous_ranges(std::vector<double>{4}), (Ranges{{0, 1}}));
  EXPECT_TRUE(continuous_ranges({}).empty());
}

TEST(ChartArea, OneUnitIsEquallyLongOnBothAxes) {
  ChartArea area{10, 20, 400, 100, {0, 1}, {0, 1}};
  area.fit_equal_scale();
  EXPECT_NEAR(area.px(1) - area.px(0), area.py(0) - area.py(1), 1e-9);
  EXPECT_GT(area.px(0), area.left);
  EXPECT_LT(area.px(1), area.right());
  EXPECT_GT(area.py(1), area.top);
  EXPECT_LT(area.py(0), area.bottom());
}

TEST(ChartAxes, LogarithmicAxesAreLabeledAtRoundValues) {
  Svg svg(400, 300, "test");
  const ChartArea area{50, 10, 300, 200, {-2, 1}, {-3, -2}};
  draw_logarithmic_x_axis(svg, area, "x");
  draw_logarithmic_y_axis(svg, area, "y");
  const std::string drawing = svg.element();
  for (const char* label : {">0.01<", ">0.1<", ">1<", ">10<", ">0.002<", ">0.005<"})
    EXPECT_THAT(drawing, ::testing::HasSubstr(label));
  EXPECT_THAT(drawing, ::testing::Not(::testing::HasSubstr(">0.05<"))) << "a long axis";
}

TEST(ChartAxes, ThousandsAreWrittenOut) {
  Svg svg(400, 300, "test");
  draw_logarithmic_x_axis(svg, {50, 10, 300, 200, {2, 4}, {0, 1}}, "ms");
  EXPECT_THAT(svg.element(), ::testing::HasSubstr(">1000<"));
}

/// Returns the x coordinates of the tick labels of a drawing.
std::vector<double> label_positions(const std::string& svg) {
  const std::regex label("<text x=\"([-0-9.]+)\"[^>]*class=\"tick\"");
  std::vector<double> positions;
  for (std::sregex_iterator i(svg.begin(), svg.end(), label), end; i != end; ++i)
    positions.push_back(std::stod((*i)[1]));
  std::sort(positions.begin(), positions.end());
  return positions;
}

TEST(ChartAxes, LabelsOfANarrowChartDoNotTouch) {
  Svg svg(200, 100, "test");
  draw_logarithmic_x_axis(svg, {10, 10, 180, 60, {-3.1, -0.9}, {0, 1}}, "x");
  const std::vector<double> positions = label_positions(svg.element());
  ASSERT_GE(positions.size(), 3U);
  constexpr double kLabel = 4 * 8;  // "0.01" in a wide font [pixels]
  for (std::size_t i = 1; i < positions.size(); ++i)
    EXPECT_GE(positions[i] - positions[i - 1], kLabel);
  for (const char* label : {">0.001<", ">0.01<", ">0.1<"})
    EXPECT_THAT(svg.element(), ::testing::HasSubstr(label)) << "powers of ten come first";
}

TEST(ChartAxes, TheTitleOfAYAxisIsBesideItsLabels) {
  Svg svg(200, 100, "test");
  draw_logarithmic_y_axis(svg, {80, 10, 100, 80, {0, 1}, {-3.5, -2}}, "error");
  const std::string drawing = svg.element();
  EXPECT_THAT(drawing, ::testing::HasSubstr(">0.0005<"));
  std::smatch title;
  ASSERT_TRUE(std::regex_search(drawing, title, std::regex("<text x=\"([0-9.]+)\"[^>]*rotate")));
  constexpr double kLabelsBegin = 80 - 8 - 6 * 7.3;  // of six characters, the point is narrow
  EXPECT_LT(std::stod(title[1]), kLabelsBegin);
}

TEST(Shortened, KeepsBothEndsOfALongText) {
  EXPECT_EQ(shortened("short", 10), "short");
  EXPECT_EQ(shortened("a very long name", 9), "a ve\u2026name");
}

}  // namespace
}  // namespace stillmap
