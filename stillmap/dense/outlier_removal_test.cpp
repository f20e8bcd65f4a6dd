// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/outlier_removal.hpp"

#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

// Returns the camera points of a wall at 2 m with noise along the rays.
PointGrid noisy_wall(double noise, unsigned seed) {
  const Camera camera = small_camera();
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss(0, noise);
  PointGrid grid{.points = cv::Mat3f(camera.height, camera.width), .stride = 1};
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      const Eigen::Vector3d p = camera.unproject(u, v, 2 + gauss(random));
      grid.points(v, u) = cv::Vec3f(static_cast<float>(p.x()), static_cast<float>(p.y()),
                                    static_cast<float>(p.z()));
    }
  }
  return grid;
}

// Returns the mean distance to the k nearest of all points, by comparing each.
double mean_nearest(const cv::Mat3f& points, const cv::Vec3f& p, int k) {
  std::vector<double> distances;
  for (const cv::Vec3f& q : points) distances.push_back(cv::norm(p - q));
  std::sort(distances.begin(), distances.end());
  double sum = 0;
  for (int i = 1; i <= k; ++i) sum += distances[static_cast<std::size_t>(i)];  // 0 is p itself
  return sum / k;
}

TEST(OutlierRemoval, RemovesSpikesAndLittleElse) {
  PointGrid grid = noisy_wall(0.002, 1);
  std::vector<cv::Point> spikes;
  for (int i = 0; i < 150; ++i) {
    spikes.emplace_back(5 + i % 15 * 10, 5 + i / 15 * 11);
    const float factor = i % 2 == 0 ? 0.9F : 1.1F;  // 20 cm along the ray
    grid.points(spikes.back()) *= factor;
  }
  const std::size_t removed = remove_outliers(grid);
  for (const cv::Point& spike : spikes) EXPECT_EQ(grid.points(spike)[2], 0) << spike;
  EXPECT_LT(removed, spikes.size() + 160 * 120 / 20);
}

TEST(OutlierRemoval, AgreesWithTheDefinitionOverTheWholeCloud) {
  PointGrid grid = noisy_wall(0.003, 2);
  grid.points = grid.points(cv::Rect(60, 40, 40, 30)).clone();
  const cv::Mat3f before = grid.points.clone();

  cv::Mat1d expected(before.size());
  for (int r = 0; r < before.rows; ++r) {
    for (int c = 0; c < before.cols; ++c) {
      expected(r, c) = mean_nearest(before, before(r, c), 6) / before(r, c)[2];
    }
  }
  cv::Scalar mean, deviation;
  cv::meanStdDev(expected, mean, deviation);
  const double threshold = mean[0] + 1.5 * deviation[0];

  const std::size_t removed =
      remove_outliers(grid, {.neighbors = 6, .window = 4, .deviations = 1.5});
  EXPECT_GT(removed, 10U);
  for (int r = 0; r < before.rows; ++r) {
    for (int c = 0; c < before.cols; ++c) {
      if (std::abs(expected(r, c) - threshold) < 1e-6) continue;  // undecided in single precision
      EXPECT_EQ(grid.points(r, c)[2] == 0, expected(r, c) > threshold) << r << " " << c;
    }
  }
}

TEST(OutlierRemoval, RemovesIslandsTooSmallToHaveNeighbors) {
  PointGrid grid{.points = cv::Mat3f(60, 60, cv::Vec3f(0, 0, 0)), .stride = 1};
  const PointGrid wall = noisy_wall(0, 3);
  const cv::Rect island(5, 5, 2, 4), continent(20, 20, 30, 30);
  wall.points(island).copyTo(grid.points(island));
  wall.points(continent).copyTo(grid.points(continent));
  EXPECT_GE(remove_outliers(grid), 8U);
  EXPECT_EQ(cv::countNonZero(cv::Mat(grid.points(island)).reshape(1)), 0);
  for (int i = 22; i < 48; ++i) EXPECT_GT(grid.points(i, i)[2], 0) << i;
}

TEST(OutlierRemoval, KeepsFarPoints) {
  // The points of the far wall are four times as far apart as those of the near one.
  PointGrid grid = noisy_wall(0.0, 4);
  grid.points.colRange(80, 160) *= 2;
  grid.points.colRange(0, 80) *= 0.5;
  remove_outliers(grid);
  EXPECT_GT(grid.points(60, 120)[2], 0);
  EXPECT_GT(grid.points(60, 40)[2], 0);
}

TEST(OutlierRemoval, CanBeTurnedOff) {
  PointGrid grid = noisy_wall(0.01, 5);
  EXPECT_EQ(remove_outliers(grid, {.neighbors = 0}), 0U);
}

TEST(OutlierRemoval, AcceptsAnEmptyGrid) {
  PointGrid grid{.points = cv::Mat3f(20, 20, cv::Vec3f(0, 0, 0)), .stride = 1};
  EXPECT_EQ(remove_outliers(grid), 0U);
}

}  // namespace
}  // namespace stillmap
