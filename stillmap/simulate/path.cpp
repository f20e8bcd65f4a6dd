// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/path.hpp"

#include <cmath>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f;

/// Returns a point on the Catmull-Rom spline between b and c.
Vector2f catmull_rom(const Vector2f& a, const Vector2f& b, const Vector2f& c, const Vector2f& d,
                     float s) {
  return 0.5F * (2 * b + (c - a) * s + (2 * a - 5 * b + 4 * c - d) * s * s +
                 (3 * b - a - 3 * c + d) * s * s * s);
}

}  // namespace

Path::Path(const std::vector<Vector2f>& corners) {
  constexpr int kFine = 200;
  constexpr float kSpacing = 0.01F;
  const std::size_t n = corners.size();
  std::vector<Vector2f> fine;
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < kFine; ++k) {
      fine.push_back(catmull_rom(corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n],
                                 corners[(i + 2) % n], static_cast<float>(k) / kFine));
    }
  }
  fine.push_back(fine.front());
  std::vector<float> walked{0};
  for (std::size_t i = 1; i < fine.size(); ++i) {
    walked.push_back(walked.back() + (fine[i] - fine[i - 1]).norm());
  }
  length_ = walked.back();
  const auto count = static_cast<std::size_t>(std::lround(length_ / kSpacing));
  std::size_t i = 1;
  for (std::size_t k = 0; k < count; ++k) {
    const float arc = length_ * static_cast<float>(k) / static_cast<float>(count);
    while (walked[i] < arc) ++i;
    const float s = (arc - walked[i - 1]) / (walked[i] - walked[i - 1]);
    points_.push_back(fine[i - 1] + s * (fine[i] - fine[i - 1]));
  }
}

Vector2f Path::at(double arc) const {
  const double turn = arc / length_ - std::floor(arc / length_);
  const double s = turn * static_cast<double>(points_.size());
  const auto i = static_cast<std::size_t>(s) % points_.size();
  const auto f = static_cast<float>(s - std::floor(s));
  return points_[i] + f * (points_[(i + 1) % points_.size()] - points_[i]);
}

Vector2f Path::heading(double arc) const { return (at(arc + 0.15) - at(arc - 0.15)).normalized(); }

}  // namespace stillmap::simulate
