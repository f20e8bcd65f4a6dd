// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/keyframe_policy.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// Landmarks of the reference that are well established: seen by three keyframes, or by all there
/// are.
int established_in_reference(const LocalMap& local_map) {
  const int needed = std::min<int>(3, static_cast<int>(local_map.keyframes.size()));
  int count = 0;
  for (const LandmarkId id : local_map.keyframes.front().landmarks) {
    const LocalLandmark* landmark = id.valid() ? local_map.find(id) : nullptr;
    count += landmark != nullptr && landmark->observations >= needed;
  }
  return count;
}

double median_depth(const Features& features) {
  std::vector<float> depths;
  for (const Keypoint& k : features.keypoints)
    if (k.depth > 0) depths.push_back(k.depth);
  if (depths.empty()) return 0;
  const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
  std::nth_element(depths.begin(), middle, depths.end());
  return *middle;
}

}  // namespace

bool KeyframePolicy::wants(const Frame& frame, const Pose& T_world_camera,
                           const std::vector<LandmarkId>& landmarks, const LocalMap& local_map,
                           std::size_t frames_since_last) const {
  if (frames_since_last < static_cast<std::size_t>(options_.min_gap)) return false;
  return sees_little_of_reference(landmarks, local_map) || sees_much_unmapped(frame, landmarks) ||
         stands_somewhere_new(frame, T_world_camera, local_map);
}

bool KeyframePolicy::sees_little_of_reference(const std::vector<LandmarkId>& landmarks,
                                              const LocalMap& local_map) const {
  const auto seen =
      std::count_if(landmarks.begin(), landmarks.end(), [](auto id) { return id.valid(); });
  return static_cast<double>(seen) < options_.tracked_share * established_in_reference(local_map);
}

bool KeyframePolicy::sees_much_unmapped(const Frame& frame,
                                        const std::vector<LandmarkId>& landmarks) const {
  int tracked = 0, untracked = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const float depth = frame.features->keypoints[i].depth;
    if (depth <= 0 || depth > options_.near_depth || frame.evidence.weight[i] <= 0) continue;
    ++(landmarks[i].valid() ? tracked : untracked);
  }
  return tracked < options_.min_tracked_near && untracked > options_.min_untracked_near;
}

bool KeyframePolicy::stands_somewhere_new(const Frame& frame, const Pose& T_world_camera,
                                          const LocalMap& local_map) const {
  const double reach = options_.max_translation * median_depth(*frame.features);
  if (reach <= 0) return false;
  return std::none_of(local_map.keyframes.begin(), local_map.keyframes.end(), [&](const auto& k) {
    const Pose T = k.T_world_camera.inverse() * T_world_camera;
    return T.angle() < options_.max_rotation * kDegree && T.translation().norm() < reach;
  });
}

}  // namespace stillmap
