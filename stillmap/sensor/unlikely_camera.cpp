// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/unlikely_camera.hpp"

#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Largest ratio of the sides of a pixel, and limits of the focal length [image widths]: fields of
/// view of 136 and 14 degrees.
constexpr double kMostOblong = 1.2, kShortestFocal = 0.2, kLongestFocal = 4;

/// Returns whether the principal point is far from the center of the images and would be near it
/// with cx and cy exchanged.
bool has_exchanged_center(const Camera& camera) {
  constexpr double kNear = 0.05, kFar = 0.1;  // distances from the center [image widths]
  const auto distance = [&](double x, double y) {
    return std::hypot(x - camera.width / 2.0, y - camera.height / 2.0) / camera.width;
  };
  return distance(camera.cx, camera.cy) > kFar && distance(camera.cy, camera.cx) < kNear;
}

bool is_likely(const Camera& camera) {
  const double aspect = camera.fx / camera.fy, focal = camera.fx / camera.width;
  const double cx = camera.cx / camera.width, cy = camera.cy / camera.height;
  const auto central = [](double share) { return share > 0.25 && share < 0.75; };
  return aspect > 1 / kMostOblong && aspect < kMostOblong && central(cx) && central(cy) &&
         focal > kShortestFocal && focal < kLongestFocal;
}

}  // namespace

std::optional<Finding> unlikely_camera_finding(const Camera& camera) {
  if (camera.width == 0 || camera.fx <= 0 || camera.fy <= 0) return std::nullopt;
  if (has_exchanged_center(camera)) {
    return make_finding(
        "principal-point",
        fmt::format("the principal point (cx {:g}, cy {:g}) is far from the center of the images "
                    "of {} x {} pixels, and would be near it with cx and cy exchanged",
                    camera.cx, camera.cy, camera.width, camera.height),
        "exchange them in the camera file");
  }
  if (is_likely(camera)) return std::nullopt;
  return make_finding(
      "unlikely-camera",
      fmt::format("the intrinsics of the camera are unlikely (fx {:g}, fy {:g}, cx {:g}, cy {:g} "
                  "for images of {} x {} pixels)",
                  camera.fx, camera.fy, camera.cx, camera.cy, camera.width, camera.height),
      "give those of this camera and this image size, or find them with: stillmap calibrate "
      "RECORDING");
}

}  // namespace stillmap
