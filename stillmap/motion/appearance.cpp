// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/appearance.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

namespace stillmap {
namespace {

/// Difference of the largest and the smallest channel of a pixel, as a share of the largest, above
/// which the pixel is colored [percent]: below it hue is mostly noise.
constexpr int kMinSaturation = 15;
/// Share above which a color is strong [percent].
constexpr int kHighSaturation = 45;
/// Pixels darker than this are gray, whatever their hue [gray levels].
constexpr int kDark = 32;
/// A part with fewer pixels is not compared.
constexpr double kMinPixels = 50;

/// Returns the hue as a number from 0 to 6 (hexagon model: Smith, Color Gamut Transform Pairs,
/// SIGGRAPH 1978).
double hue_of(const cv::Vec3b& bgr, int largest, int spread) {
  const int b = bgr[0], g = bgr[1], r = bgr[2];
  double hue = 0;
  if (largest == r) {
    hue = static_cast<double>(g - b) / spread;
  } else if (largest == g) {
    hue = 2 + static_cast<double>(b - r) / spread;
  } else {
    hue = 4 + static_cast<double>(r - g) / spread;
  }
  return hue < 0 ? hue + 6 : hue;
}

}  // namespace

std::size_t Appearance::bin_of(const cv::Vec3b& bgr) {
  const auto [smallest, largest] = std::minmax({int{bgr[0]}, int{bgr[1]}, int{bgr[2]}});
  const int spread = largest - smallest;
  if (largest < kDark || 100 * spread < kMinSaturation * largest)
    return 2 * kHues + static_cast<std::size_t>(largest) * kGrays / 256;
  const auto hue = std::min(
      kHues - 1, static_cast<std::size_t>(hue_of(bgr, largest, spread) * double{kHues} / 6));
  return 100 * spread < kHighSaturation * largest ? hue : kHues + hue;
}

void Appearance::add(Part part, const cv::Vec3b& bgr) {
  ++parts_[static_cast<std::size_t>(part)][bin_of(bgr)];
}

void Appearance::add(const Appearance& other) {
  for (std::size_t part = 0; part < parts_.size(); ++part)
    for (std::size_t i = 0; i < kBins; ++i) parts_[part][i] += other.parts_[part][i];
}

std::optional<double> Appearance::distance(const Appearance& other) const {
  double sum = 0;
  int common = 0;
  for (std::size_t part = 0; part < parts_.size(); ++part) {
    const Histogram &a = parts_[part], &b = other.parts_[part];
    const double pixels_a = std::accumulate(a.begin(), a.end(), 0.0);
    const double pixels_b = std::accumulate(b.begin(), b.end(), 0.0);
    if (pixels_a < kMinPixels || pixels_b < kMinPixels) continue;
    double overlap = 0;
    for (std::size_t i = 0; i < kBins; ++i) overlap += std::sqrt(a[i] / pixels_a * b[i] / pixels_b);
    sum += std::sqrt(std::max(0.0, 1 - overlap));
    ++common;
  }
  return common == 0 ? std::nullopt : std::optional(sum / common);
}

}  // namespace stillmap
