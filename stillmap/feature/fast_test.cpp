// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/fast.hpp"

#include "stillmap/feature/dead_leaves.hpp"

#include <algorithm>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Literal definition: whether 9 contiguous ring pixels are all brighter by more than t, or all
/// darker.
bool is_corner(const cv::Mat& image, int x, int y, int t) {
  constexpr int kX[16] = {0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3, -3, -3, -2, -1};
  constexpr int kY[16] = {-3, -3, -2, -1, 0, 1, 2, 3, 3, 3, 2, 1, 0, -1, -2, -3};
  const int center = image.at<std::uint8_t>(y, x);
  for (int first = 0; first < 16; ++first) {
    int brighter = 0, darker = 0;
    for (int i = first; i < first + 9; ++i) {
      const int p = image.at<std::uint8_t>(y + kY[i % 16], x + kX[i % 16]);
      brighter += p > center + t ? 1 : 0;
      darker += p < center - t ? 1 : 0;
    }
    if (brighter == 9 || darker == 9) return true;
  }
  return false;
}

int score_by_definition(const cv::Mat& image, int x, int y) {
  int t = 0;
  while (t < 255 && is_corner(image, x, y, t)) ++t;
  return t;
}

cv::Mat noise_image(int width, int height, std::uint64_t seed) {
  TestRandom random(seed);
  cv::Mat image(height, width, CV_8UC1);
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x)
      image.at<std::uint8_t>(y, x) = static_cast<std::uint8_t>(random.next());
  }
  return image;
}

class FastScores : public testing::TestWithParam<CpuPath> {};

TEST_P(FastScores, EqualTheDefinition) {
  for (const cv::Mat& image : {dead_leaves({90, 41}, 3), noise_image(75, 30, 4)}) {
    const cv::Rect area(3, 3, image.cols - 6, image.rows - 6);
    cv::Mat scores = cv::Mat::zeros(image.size(), CV_8UC1);
    fast_scores(image, area, 7, scores, GetParam());
    int corners = 0;
    for (int y = 3; y < image.rows - 3; ++y) {
      for (int x = 3; x < image.cols - 3; ++x) {
        const int expected = score_by_definition(image, x, y);
        ASSERT_EQ(scores.at<std::uint8_t>(y, x), expected > 7 ? expected : 0) << x << ", " << y;
        corners += expected > 7 ? 1 : 0;
      }
    }
    EXPECT_GT(corners, 20);
  }
}

TEST_P(FastScores, DoNotChangePixelsOutsideTheArea) {
  const cv::Mat image = noise_image(80, 40, 5);
  cv::Mat scores(image.size(), CV_8UC1, cv::Scalar(99));
  const cv::Rect area(10, 12, 47, 9);
  fast_scores(image, area, 7, scores, GetParam());
  scores(area) = 99;
  EXPECT_EQ(cv::countNonZero(scores != 99), 0);
}

TEST_P(FastScores, OfAreasNarrowerThanAVector) {
  const cv::Mat image = noise_image(64, 20, 6);
  for (int width = 1; width < 34; ++width) {
    cv::Mat scores = cv::Mat::zeros(image.size(), CV_8UC1);
    fast_scores(image, {3, 3, width, 5}, 1, scores, GetParam());
    for (int x = 3; x < 3 + width; ++x) {
      const int expected = score_by_definition(image, x, 5);
      ASSERT_EQ(scores.at<std::uint8_t>(5, x), expected > 1 ? expected : 0);
    }
  }
}

INSTANTIATE_TEST_SUITE_P(Paths, FastScores, testing::Values(CpuPath::kPortable, best_cpu_path()),
                         [](const auto& suite) { return suite.index == 0 ? "Portable" : "Best"; });

TEST(FastDetector, FindsTheCornersOfASquare) {
  cv::Mat image(100, 100, CV_8UC1, cv::Scalar(40));
  image(cv::Rect(30, 40, 30, 25)) = 200;
  cv::GaussianBlur(image, image, {0, 0}, 0.7);  // Blur of a lens.
  FastDetector detector(20, 7, 30, 16);
  std::vector<cv::Point> found;
  for (const Corner& c : detector.detect(image)) found.emplace_back(c.x, c.y);
  for (const cv::Point truth : {cv::Point(30, 40), {59, 40}, {30, 64}, {59, 64}}) {
    EXPECT_TRUE(std::any_of(found.begin(), found.end(), [&](cv::Point p) {
      return std::abs(p.x - truth.x) <= 1 && std::abs(p.y - truth.y) <= 1;
    })) << truth;
  }
  EXPECT_LE(found.size(), 4U);
}

TEST(FastDetector, NeverKeepsTwoNeighbors) {
  FastDetector detector(20, 7, 30, 16);
  const auto corners = detector.detect(dead_leaves({200, 150}, 7));
  ASSERT_GT(corners.size(), 50U);
  for (std::size_t i = 0; i < corners.size(); ++i) {
    for (std::size_t j = i + 1; j < corners.size(); ++j) {
      const int dx = std::abs(corners[i].x - corners[j].x),
                dy = std::abs(corners[i].y - corners[j].y);
      ASSERT_TRUE(dx > 1 || dy > 1);
    }
  }
}

TEST(FastDetector, LowersTheThresholdOnlyInEmptyCells) {
  // Two adjacent cells: the left one with a strong and a faint square, the right one with a faint
  // square.
  cv::Mat image(64, 96, CV_8UC1, cv::Scalar(100));
  image(cv::Rect(18, 18, 9, 9)) = 200;
  image(cv::Rect(34, 34, 8, 8)) = 112;
  image(cv::Rect(60, 28, 8, 8)) = 112;
  FastDetector detector(20, 7, 32, 16);
  bool faint_left = false, faint_right = false;
  for (const Corner& c : detector.detect(image)) {
    if (c.score > 20) continue;
    (c.x < 48 ? faint_left : faint_right) = true;
  }
  EXPECT_FALSE(faint_left);
  EXPECT_TRUE(faint_right);
}

TEST(FastDetector, FindsNothingInFlatOrTinyImages) {
  FastDetector detector(20, 7, 30, 16);
  EXPECT_TRUE(detector.detect(cv::Mat(100, 100, CV_8UC1, cv::Scalar(128))).empty());
  EXPECT_TRUE(detector.detect(dead_leaves({32, 100}, 8)).empty());
  EXPECT_TRUE(detector.detect(cv::Mat()).empty());
  EXPECT_NO_THROW(detector.detect(dead_leaves({33, 33}, 8)));
}

}  // namespace
}  // namespace stillmap
