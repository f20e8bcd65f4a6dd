// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/camera_change.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Conversion of keypoints between the images of two cameras at the same place.
class PixelChange {
 public:
  PixelChange(const Camera& from, const Camera& to, const PyramidShape& pyramid)
      : from_(from),
        to_(to),
        levels_(pyramid.levels),
        shift_(static_cast<int>(std::lround(std::log(scale()) / std::log(pyramid.scale_factor)))) {}

  /// Returns the size of a patch in the images of the second camera over that in the first.
  double scale() const { return to_.fx / from_.fx; }

  FeaturesPtr operator()(const Features& features) const {
    auto changed = std::make_shared<Features>();
    changed->descriptors.assign(features.descriptors.begin(), features.descriptors.end());
    for (const Keypoint& keypoint : features.keypoints)
      changed->keypoints.push_back((*this)(keypoint));
    changed->grid = KeypointGrid(changed->keypoints, to_.width, to_.height);
    return changed;
  }

 private:
  Keypoint operator()(Keypoint keypoint) const {
    const Eigen::Vector2d pixel = to_.project(from_.unproject(keypoint.u, keypoint.v, 1));
    keypoint.u = static_cast<float>(pixel.x());
    keypoint.v = static_cast<float>(pixel.y());
    keypoint.level = static_cast<std::uint8_t>(std::clamp(keypoint.level + shift_, 0, levels_ - 1));
    return keypoint;
  }

  const Camera& from_;
  const Camera& to_;
  int levels_;
  int shift_;  // [levels]
};

}  // namespace

bool same_images(const Camera& a, const Camera& b) {
  constexpr double kRounding = 1e-6;  // relative
  const auto same = [](double x, double y) { return std::abs(x - y) <= kRounding * std::abs(x); };
  return a.width == b.width && a.height == b.height && same(a.fx, b.fx) && same(a.fy, b.fy) &&
         same(a.cx, b.cx) && same(a.cy, b.cy) && same(a.baseline, b.baseline) &&
         a.depth_sensor.name == b.depth_sensor.name;
}

MapContent with_camera(MapContent map, const Camera& camera) {
  const PixelChange change(map.camera, camera, map.pyramid);
  for (Keyframe& keyframe : map.keyframes) keyframe.features = change(*keyframe.features);
  for (Landmark& landmark : map.landmarks) {
    landmark.min_distance = static_cast<float>(landmark.min_distance * change.scale());
    landmark.max_distance = static_cast<float>(landmark.max_distance * change.scale());
  }
  map.camera = camera;
  return map;
}

}  // namespace stillmap
