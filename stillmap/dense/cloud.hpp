// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Red, green, blue, 0..255 each: the order of cloud files, not of OpenCV's images.
using Rgb = std::array<std::uint8_t, 3>;

/// A colored point cloud. `points` and `colors` have the same length.
struct Cloud {
  std::vector<Eigen::Vector3f> points;  ///< [m]; world frame unless stated otherwise.
  std::vector<Rgb> colors;

  std::size_t size() const { return points.size(); }
  bool empty() const { return points.empty(); }
  void reserve(std::size_t n) {
    points.reserve(n);
    colors.reserve(n);
  }
  void add(const Eigen::Vector3f& point, const Rgb& color) {
    points.push_back(point);
    colors.push_back(color);
  }
  bool operator==(const Cloud&) const = default;
};

}  // namespace stillmap
