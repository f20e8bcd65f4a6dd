// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/depth_error_fit.hpp"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const Eigen::Vector2d kSize(640, 480);

/// An error that grows from one side of the image to the other, with a mean of zero [1/m].
SmoothDepthError slope(double most) {
  SmoothDepthError::Nodes nodes;
  for (int i = 0; i < nodes.size(); ++i) {
    const int col = i % SmoothDepthError::kCols;
    nodes[i] = most * (2.0 * col / (SmoothDepthError::kCols - 1) - 1);
  }
  return SmoothDepthError(nodes);
}

double measured(double depth, double u, double v, const SmoothDepthError& error) {
  return 1 / (1 / depth + error.at(u, v, kSize));
}

/// Surfaces of the same depth in two images, at random pixels, measured with an error and noise.
std::vector<DepthDifference> differences(int count, const SmoothDepthError& error, int seed = 1) {
  std::mt19937 rng(seed);
  std::uniform_real_distribution<double> u(0, kSize.x() - 1), v(0, kSize.y() - 1), z(1.5, 4);
  std::normal_distribution<double> noise(0, 0.002);  // [1/m]
  std::vector<DepthDifference> made;
  for (int i = 0; i < count; ++i) {
    const double depth = z(rng);
    PixelDepth from{u(rng), v(rng), 0}, to{u(rng), v(rng), 0};
    from.depth = measured(depth, from.u, from.v, error);
    to.depth = 1 / (1 / measured(depth, to.u, to.v, error) + noise(rng));
    // A camera that turns about its center: the depth stays.
    made.emplace_back(from, to, from.depth, kSize);
  }
  return made;
}

TEST(SmoothDepthError, IsBilinearBetweenItsNodes) {
  const SmoothDepthError error = slope(0.02);
  EXPECT_NEAR(error.at(0, 100, kSize), -0.02, 1e-12);
  EXPECT_NEAR(error.at(639, 400, kSize), 0.02, 1e-12);
  EXPECT_NEAR(error.at(319.5, 0, kSize), 0, 1e-12);
  EXPECT_NEAR(error.at(639 * 0.7, 17, kSize), 0.02 * 0.4, 1e-12);
  EXPECT_NEAR(error.at(-5, 700, kSize), -0.02, 1e-12);  // as at the border
}

TEST(SmoothDepthError, IsRemovedFromADepth) {
  const SmoothDepthError error = slope(0.05);
  EXPECT_NEAR(error.removed_from(measured(3, 500, 80, error), 500, 80, kSize), 3, 1e-12);
  EXPECT_NEAR((error - error).removed_from(3, 500, 80, kSize), 3, 1e-12);
  EXPECT_NEAR((error + error).removed_from(3, 0, 80, kSize), 1 / (1.0 / 3 + 0.1), 1e-12);
}

TEST(SmoothDepthError, AtMostDoublesADepth) {
  EXPECT_EQ(slope(0.05).removed_from(30, 639, 0, kSize), 60);
}

TEST(FitDepthError, FindsTheErrorThatTheImagesShare) {
  const SmoothDepthError truth = slope(0.02);
  const auto found = fit_depth_error(differences(6000, truth));
  ASSERT_TRUE(found);
  double worst = 0;
  for (int u = 0; u < 640; u += 20) {
    for (int v = 0; v < 480; v += 20)
      worst = std::max(worst, std::abs(found->at(u, v, kSize) - truth.at(u, v, kSize)));
  }
  EXPECT_LT(worst, 0.003);
  EXPECT_NEAR(found->nodes().mean(), 0, 1e-4);
}

TEST(FitDepthError, FindsNoneInNoise) { EXPECT_FALSE(fit_depth_error(differences(6000, {}))); }

TEST(FitDepthError, NeedsTwoThousandDifferences) {
  EXPECT_FALSE(fit_depth_error(differences(1999, slope(0.02))));
  EXPECT_TRUE(fit_depth_error(differences(2000, slope(0.02))));
}

TEST(FitDepthError, IsNoneIfTheHalvesContradictEachOther) {
  // As by wrong poses for a while: the first half decides the error of all.
  auto both = differences(3100, slope(0.02), 1);
  const auto opposite = differences(2900, slope(-0.005), 2);
  both.insert(both.end(), opposite.begin(), opposite.end());
  EXPECT_FALSE(fit_depth_error(both));
}

}  // namespace
}  // namespace stillmap
