// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/fusion.hpp"

#include "stillmap/map/visibility.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Maximum Hamming distance between two descriptors of one landmark [bits].
constexpr int kMaxDistance = 50;
/// Maximum difference between measured and predicted disparity [pixels].
constexpr double kMaxDisparity = 1.0;
/// Minimum cosine of the angle between mean and current viewing direction.
constexpr double kMinViewCosine = 0.5;

bool observed_by(const Landmark& landmark, KeyframeId keyframe) {
  return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                     [&](const Observation& o) { return o.keyframe == keyframe; });
}

/// Returns whether the keypoint has no depth or its disparity agrees with the landmark's.
bool depth_agrees(const Map& map, const Keypoint& keypoint, double depth) {
  if (keypoint.depth <= 0) return true;
  const double bf = map.camera().bf();
  return std::abs(bf / keypoint.depth - bf / depth) < kMaxDisparity;
}

/// Adds the observation of the landmark by keypoint i, or merges it with the landmark that this
/// keypoint already shows. Returns 1 if the map changed, else 0.
int join(Map& map, const Keyframe& keyframe, std::uint32_t i, LandmarkId id) {
  const LandmarkId shown = keyframe.landmarks[i];
  if (!shown.valid()) {
    if (keyframe.static_weight[i] <= 0 || !map.observe(id, {keyframe.id, i})) return 0;
    map.refresh(id);
    return 1;
  }
  if (shown == id) return 0;
  const bool keep_shown = map.at(shown).observations.size() >= map.at(id).observations.size();
  map.merge(keep_shown ? shown : id, keep_shown ? id : shown);
  return 1;
}

}  // namespace

int fuse_into(Map& map, KeyframeId target, std::span<const LandmarkId> landmarks, double radius) {
  const Keyframe& keyframe = map.at(target);
  const LandmarkProjector view(map.camera(), map.pyramid(), keyframe.T_world_camera);
  std::vector<ProjectionQuery> queries;
  std::vector<LandmarkId> ids;
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr || observed_by(*landmark, target)) continue;
    if (const auto query = view.expect(*landmark, radius, kMinViewCosine)) {
      queries.push_back(*query);
      ids.push_back(id);
    }
  }
  ProjectionMatchOptions matching;
  matching.max_distance = kMaxDistance;
  // A second match of equal distance is probably the same corner at another level.
  matching.ratio = 1;
  const auto found = match_by_projection(queries, *keyframe.features, matching);
  int joined = 0;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const Landmark* landmark = map.find(ids[q]);  // An earlier match may have merged it.
    if (!found[q] || landmark == nullptr) continue;
    const std::uint32_t keypoint = *found[q];
    const double depth = view.depth(landmark->p_world);
    if (!depth_agrees(map, keyframe.features->keypoints[keypoint], depth)) continue;
    joined += join(map, keyframe, keypoint, ids[q]);
  }
  return joined;
}

}  // namespace stillmap
