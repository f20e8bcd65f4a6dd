// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/keypoint_depths.hpp"

namespace stillmap {

FeaturesPtr without_depth_error(const FeaturesPtr& features, const DepthErrorPtr& error,
                                const DepthErrorPtr& removed, const Camera& camera) {
  if (error == removed) return features;
  const auto known = [](const DepthErrorPtr& e) { return e ? *e : SmoothDepthError(); };
  const SmoothDepthError left = known(error) - known(removed);
  const Eigen::Vector2d size(camera.width, camera.height);
  auto corrected = std::make_shared<Features>(*features);
  for (Keypoint& k : corrected->keypoints) {
    if (k.depth > 0) k.depth = static_cast<float>(left.removed_from(k.depth, k.u, k.v, size));
  }
  return corrected;
}

}  // namespace stillmap
