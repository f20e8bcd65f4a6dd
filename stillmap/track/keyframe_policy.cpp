// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/keyframe_policy.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/sharpness.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

/// A keypoint is near while the standard deviation of its depth is below this [m]: that of a Kinect
/// v1 at 3 m, forty of its baselines (Mur-Artal and Tardos, ORB-SLAM2, TRO 2017, section III.A).
constexpr double kNearSigma = 0.0126;

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

/// Of at least one value.
template <typename Values>
double median(Values values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double median_depth(const Features& features) {
  std::vector<float> depths;
  for (const Keypoint& k : features.keypoints)
    if (k.depth > 0) depths.push_back(k.depth);
  return depths.empty() ? 0 : median(std::move(depths));
}

}  // namespace

KeyframePolicy::KeyframePolicy(const KeyframePolicyOptions& options, const DepthSensor& sensor)
    : options_(options), near_depth_(sensor.depth_at_sigma(kNearSigma)) {}

bool KeyframePolicy::wants(const Frame& frame, const Pose& T_world_camera,
                           const std::vector<LandmarkId>& landmarks, const LocalMap& local_map,
                           std::size_t frames_since_last) {
  const TraceScope scope("keyframe decision");
  const bool blurred = is_blurred(frame);
  const bool wanted = frames_since_last >= static_cast<std::size_t>(options_.min_gap) &&
                      adds_to_map(frame, T_world_camera, landmarks, local_map);
  const bool waits = wanted && blurred && waited_ < options_.max_wait;
  waited_ = waits ? waited_ + 1 : 0;
  return wanted && !waits;
}

bool KeyframePolicy::adds_to_map(const Frame& frame, const Pose& T_world_camera,
                                 const std::vector<LandmarkId>& landmarks,
                                 const LocalMap& local_map) const {
  return sees_little_of_reference(landmarks, local_map) || sees_much_unmapped(frame, landmarks) ||
         stands_somewhere_new(frame, T_world_camera, local_map);
}

bool KeyframePolicy::is_blurred(const Frame& frame) {
  const double here = sharpness(frame.image->gray);
  sharpness_.push_back(here);
  if (sharpness_.size() > static_cast<std::size_t>(options_.sharpness_memory)) {
    sharpness_.pop_front();
  }
  return here < options_.min_sharpness * median(sharpness_);
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
    if (depth <= 0 || depth > near_depth_ || frame.evidence.weight[i] <= 0) continue;
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
