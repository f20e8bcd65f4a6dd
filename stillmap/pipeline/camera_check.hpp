// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/map.hpp"

#include <optional>

namespace stillmap {

/// What a map shows for certain to be wrong in the camera that it was made with; none if it shows
/// nothing, also if it is too small to tell. The map was made with the wrong values, so an estimate
/// makes up only half to nine tenths of the error.
struct CameraErrors {
  /// Focal length fx that fits the map best [pixels], if both focal lengths are wrong by 4 % and
  /// four standard deviations, or one by five.
  std::optional<double> focal_length = std::nullopt;
  /// Principal point that fits the map best [pixels], if one of its coordinates is wrong by 4 % of
  /// the focal length and five standard deviations.
  std::optional<Eigen::Vector2d> center = std::nullopt;
  /// Error of the disparity in the corners of the image [1/m]: see shows_distances().
  std::optional<double> disparity_bow = std::nullopt;
};

/// Returns the errors that calibrate_camera() finds from the first 60 keyframes of the largest
/// component, if it has at least five.
CameraErrors camera_errors(const Map& map);

}  // namespace stillmap
