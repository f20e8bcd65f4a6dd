// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/smooth_depth_error.hpp"

#include <array>
#include <optional>
#include <vector>

namespace stillmap {

/// Which depths are compared for fit_depth_error().
namespace compared_depths {
/// Least distance of the pixels [image widths], since noise dominates nearer ones, and largest
/// distance of the cameras [m].
inline constexpr double kLeastShift = 0.1, kFarthestCamera = 1;
/// Nearest and farthest depth [m]: the error of poses matters for near ones.
inline constexpr double kNearest = 0.8, kFarthest = 6;
/// Largest difference of the inverse depths of one surface [1/m].
inline constexpr double kMostDifference = 0.06;
}  // namespace compared_depths

/// A pixel and its depth.
struct PixelDepth {
  double u = 0, v = 0;  ///< [pixels]
  double depth = 0;     ///< Measured along the optical axis [m].
};

/// The difference of the inverse depths of a surface in two images, and its derivatives by the
/// errors at the nodes around both pixels.
struct DepthDifference {
  /// @param from       the surface in the first image
  /// @param to         the surface in the second image
  /// @param predicted  depth in the second image by the first one [m]
  /// @param size       width and height of both images [pixels]
  DepthDifference(const PixelDepth& from, const PixelDepth& to, double predicted,
                  const Eigen::Vector2d& size);

  double inverse_depth = 0;       ///< As predicted minus as measured in the second image [1/m].
  std::array<int, 8> node{};      ///< Numbers of the nodes.
  std::array<double, 8> slope{};  ///< Derivative by the error at each of them [1].

  /// Returns the difference without the part that an error explains [1/m].
  double without(const SmoothDepthError& error) const;
};

/// Returns the error with which the differences are least; none unless their median is then a tenth
/// smaller, for either half of them also with the error that the other half shows. Its mean is
/// zero: a camera that turns hardly shows it, so that the map keeps the mean depth of the sensor.
/// @param differences  such of the same time next to each other
std::optional<SmoothDepthError> fit_depth_error(const std::vector<DepthDifference>& differences);

}  // namespace stillmap
