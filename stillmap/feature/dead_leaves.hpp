// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cmath>
#include <cstdint>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

/// Test images with the statistics of photographs, for tests, benchmarks and the training of the
/// BRIEF pattern.
namespace stillmap {

/// splitmix64 (Steele, Lea, Flood 2014): the same numbers on every machine.
class TestRandom {
 public:
  explicit TestRandom(std::uint64_t seed) : state_(seed) {}
  std::uint64_t next() {
    std::uint64_t z = (state_ += 0x9e3779b97f4a7c15ULL);
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform(double low, double high) {
    return low + (high - low) * static_cast<double>(next() >> 11) * 0x1p-53;
  }
  int below(int count) { return static_cast<int>(next() % static_cast<std::uint64_t>(count)); }

 private:
  std::uint64_t state_;
};

/// Returns a dead-leaves image (Matheron 1968; Lee, Mumford, Huang 2001), 8UC1: overlapping discs
/// and rotated rectangles of random gray with sizes distributed as 1 / size^3, so that it is scale
/// invariant like photographs; slightly blurred as by a lens.
inline cv::Mat dead_leaves(cv::Size size, std::uint64_t seed) {
  constexpr int kShift = 4;  // Positions are in 1/16 pixel.
  constexpr double kMin = 3, kMax = 120;
  TestRandom random(seed);
  cv::Mat image(size, CV_8UC1, cv::Scalar(128));
  const int leaves = size.area() / 60;
  for (int i = 0; i < leaves; ++i) {
    const double q = random.uniform(0, 1);
    const double radius = 1 / std::sqrt((1 - q) / (kMin * kMin) + q / (kMax * kMax));
    const cv::Point2d center(random.uniform(0, size.width), random.uniform(0, size.height));
    const cv::Scalar gray(random.uniform(20, 235));
    const double angle = random.uniform(0, CV_PI), aspect = random.uniform(0.4, 1);
    if (random.below(2) == 0) {
      cv::circle(image, center * (1 << kShift), static_cast<int>(radius * (1 << kShift)), gray,
                 cv::FILLED, cv::LINE_AA, kShift);
      continue;
    }
    const cv::Point2d a = radius * cv::Point2d(std::cos(angle), std::sin(angle));
    const cv::Point2d b = aspect * cv::Point2d(-a.y, a.x);
    cv::Point corners[4];
    const cv::Point2d signs[4] = {{1, 1}, {1, -1}, {-1, -1}, {-1, 1}};
    for (int k = 0; k < 4; ++k)
      corners[k] = (center + signs[k].x * a + signs[k].y * b) * (1 << kShift);
    cv::fillConvexPoly(image, corners, 4, gray, cv::LINE_AA, kShift);
  }
  cv::GaussianBlur(image, image, {0, 0}, 0.7);
  return image;
}

}  // namespace stillmap
