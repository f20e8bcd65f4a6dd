// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/map_depth_error.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/optimize/depth_error_fit.hpp"

#include <cmath>
#include <vector>

namespace stillmap {
namespace {

using namespace compared_depths;  // NOLINT(google-build-using-namespace)

bool is_compared(const Keypoint& k) { return k.depth >= kNearest && k.depth <= kFarthest; }

void compare(const Map& map, const Landmark& landmark, std::vector<DepthDifference>& differences) {
  const Camera& camera = map.camera();
  for (const Observation& first : landmark.observations) {
    const Keyframe& a = map.at(first.keyframe);
    const Keypoint& from = a.features->keypoints[first.keypoint];
    if (a.session != map.session() || !is_compared(from)) continue;
    const Eigen::Vector3d p = a.T_world_camera * camera.unproject(from.u, from.v, from.depth);
    for (const Observation& second : landmark.observations) {
      const Keyframe& b = map.at(second.keyframe);
      const Keypoint& to = b.features->keypoints[second.keypoint];
      const Pose& T_world_b = b.T_world_camera;
      if (b.session != map.session() || !is_compared(to) ||
          std::hypot(to.u - from.u, to.v - from.v) < kLeastShift * camera.width ||
          (a.T_world_camera.translation() - T_world_b.translation()).norm() > kFarthestCamera)
        continue;
      const double predicted = (T_world_b.inverse() * p).z();
      if (predicted < kNearest) continue;
      const DepthDifference difference({from.u, from.v, from.depth}, {to.u, to.v, to.depth},
                                       predicted, {camera.width, camera.height});
      if (std::abs(difference.inverse_depth) <= kMostDifference) differences.push_back(difference);
    }
  }
}

}  // namespace

std::optional<SmoothDepthError> depth_error_of(const Map& map) {
  const TraceScope scope("error of the depth sensor");
  std::vector<DepthDifference> differences;
  map.for_each_landmark([&](const Landmark& landmark) { compare(map, landmark, differences); });
  return fit_depth_error(differences);
}

void restore_measured_depths(const Map& map, BundleProblem& problem) {
  if (!map.depth_error()) return;
  const SmoothDepthError added = SmoothDepthError() - *map.depth_error();
  const Eigen::Vector2d size(problem.camera.width, problem.camera.height);
  for (BundleObservation& o : problem.observations) {
    if (o.depth > 0) o.depth = static_cast<float>(added.removed_from(o.depth, o.u, o.v, size));
  }
}

}  // namespace stillmap
