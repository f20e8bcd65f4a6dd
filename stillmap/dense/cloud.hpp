// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
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

/// Writes a cloud as PLY: binary little endian, per vertex float x y z [m] and uchar red green
/// blue. The same cloud gives the same bytes. Complete or not at all. Throws Error (points and
/// colors differ in number, folder missing, not writable, disk full).
void write_ply(const std::filesystem::path& file, const Cloud& cloud);

/// Reads the vertices of a binary little endian PLY whose first element is `vertex` with x, y, z
/// and, optionally, red, green, blue (or diffuse_red ...) of type uchar; points without color
/// become white. Other properties and elements are ignored; vertices that are not finite are
/// left out. Throws Error, naming the file and the fix, if it is anything else or cut short.
Cloud read_ply(const std::filesystem::path& file);

}  // namespace stillmap
