// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/tag_landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <optional>

namespace stillmap {
namespace {

/// Maximum distance of a corner from the projection of its landmark, and maximum difference of
/// their disparities [pixels]. Larger ones are drift, which a loop closure corrects.
constexpr double kRadius = 8, kMaxDisparity = 3;

/// A corner without a landmark, and the best landmark for it so far.
struct OpenCorner {
  std::uint32_t keypoint;
  double distance = kRadius;  // of the landmark's projection [pixels]
  LandmarkId landmark = {};
};

std::map<TagCorner, OpenCorner> open_corners(const Keyframe& keyframe) {
  std::map<TagCorner, OpenCorner> open;
  for (std::uint32_t i = 0; i < keyframe.features->size(); ++i) {
    if (keyframe.landmarks[i].valid() || keyframe.static_weight[i] <= 0) continue;
    if (const auto corner = tag_corner_of(keyframe.features->descriptors[i]))
      open.insert({*corner, {i}});
  }
  return open;
}

/// Returns the distance of a landmark's projection from a keypoint [pixels], if their depths agree.
std::optional<double> distance_in_image(const Camera& camera, const Keypoint& keypoint,
                                        const Eigen::Vector3d& p_camera) {
  constexpr double kNear = 0.05;  // [m]
  if (p_camera.z() < kNear) return std::nullopt;
  const double disparity = keypoint.depth > 0 ? camera.bf() / keypoint.depth : 0;
  if (disparity > 0 && std::abs(disparity - camera.bf() / p_camera.z()) > kMaxDisparity)
    return std::nullopt;
  return (camera.project(p_camera) - Eigen::Vector2d(keypoint.u, keypoint.v)).norm();
}

}  // namespace

std::map<TagName, TagLandmarks> tags_among(std::span<const Landmark* const> landmarks) {
  std::map<TagName, TagLandmarks> tags;
  for (const Landmark* landmark : landmarks) {
    const auto corner = tag_corner_of(landmark->descriptor);
    if (!corner) continue;
    const Landmark*& kept = tags[corner->tag][corner->corner];
    if (kept == nullptr || kept->observations.size() < landmark->observations.size())
      kept = landmark;
  }
  std::erase_if(tags, [](const auto& tag) {
    return std::ranges::find(tag.second, nullptr) != tag.second.end();
  });
  return tags;
}

void observe_tags(Map& map, KeyframeId id) {
  const Keyframe& keyframe = map.at(id);
  std::map<TagCorner, OpenCorner> open = open_corners(keyframe);
  if (open.empty()) return;
  const Pose T_camera_world = keyframe.T_world_camera.inverse();
  map.for_each_landmark([&](const Landmark& landmark) {
    const auto corner = tag_corner_of(landmark.descriptor);
    const auto seen = corner ? open.find(*corner) : open.end();
    if (seen == open.end()) return;
    if (map.at(landmark.observations.front().keyframe).component != keyframe.component) return;
    OpenCorner& best = seen->second;
    const auto distance =
        distance_in_image(map.camera(), keyframe.features->keypoints[best.keypoint],
                          T_camera_world * landmark.p_world);
    if (!distance || *distance >= best.distance) return;
    best.distance = *distance;
    best.landmark = landmark.id;
  });
  for (const auto& [corner, best] : open) {
    if (best.landmark.valid() && map.observe(best.landmark, {id, best.keypoint}))
      map.refresh(best.landmark);
  }
}

}  // namespace stillmap
