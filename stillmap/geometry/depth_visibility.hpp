// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"

#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stillmap {

/// Relation of a point to the surface that a depth image measured in its direction.
enum class Visibility : std::uint8_t {
  kUnknown,      ///< No depth was measured there.
  kOccluded,     ///< The surface is nearer than the point and hides it.
  kOnSurface,    ///< The surface is at the point, within the tolerance.
  kSeenThrough,  ///< The surface is further away: the point is in free space.
};

/// Returns the visibility of a point at a depth where another depth was measured.
/// @param depth     depth of the point along the optical axis [m]
/// @param measured  depth along the same ray [m]; 0 or less: none
/// @param tolerance largest difference on the same surface [m]
template <typename T>
constexpr Visibility visibility_of(T depth, T measured, T tolerance) {
  if (measured <= 0) return Visibility::kUnknown;
  if (measured + tolerance < depth) return Visibility::kOccluded;
  return measured - tolerance <= depth ? Visibility::kOnSurface : Visibility::kSeenThrough;
}

/// A depth image and its camera.
struct DepthView {
  const cv::Mat1f& depth;  ///< Depth image [m]; 0 where unknown.
  const Camera& camera;    ///< Camera of the depth image.

  /// Returns the pixel that a point projects to, if the point is in front of the camera and all
  /// neighbors of the pixel are in the image.
  /// @param nearest minimum depth of the point [m]
  std::optional<cv::Point> inner_pixel(const Eigen::Vector3d& p_camera, double nearest) const {
    if (p_camera.z() < nearest) return std::nullopt;
    const Eigen::Vector2d uv = camera.project(p_camera);
    const int x = cvRound(uv.x()), y = cvRound(uv.y());
    if (x < 1 || y < 1 || x >= depth.cols - 1 || y >= depth.rows - 1) return std::nullopt;
    return cv::Point(x, y);
  }

  /// Returns the visibility on which a pixel and its eight neighbors agree, kUnknown if one of them
  /// has no depth, and kOnSurface if they disagree: an edge is nearby.
  Visibility visibility_around(cv::Point pixel, float point_depth, float tolerance) const {
    bool occluded = true, seen_through = true;
    for (int y = pixel.y - 1; y <= pixel.y + 1; ++y) {
      for (int x = pixel.x - 1; x <= pixel.x + 1; ++x) {
        const Visibility v = visibility_of(point_depth, depth(y, x), tolerance);
        if (v == Visibility::kUnknown) return v;
        occluded = occluded && v == Visibility::kOccluded;
        seen_through = seen_through && v == Visibility::kSeenThrough;
      }
    }
    if (occluded) return Visibility::kOccluded;
    return seen_through ? Visibility::kSeenThrough : Visibility::kOnSurface;
  }
};

}  // namespace stillmap
