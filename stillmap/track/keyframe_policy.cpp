// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/keyframe_policy.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/sharpness.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180;
/// A frame that matches less than this share of the reference's landmarks becomes a keyframe, as in
/// ORB-SLAM2 for RGB-D [0..1].
constexpr double kTrackedShare = 0.75;
/// A frame with fewer near landmarks than the first, and more near keypoints without landmark than
/// the second, becomes a keyframe, as in ORB-SLAM2.
constexpr int kMinTrackedNear = 100, kMinUntrackedNear = 70;
/// Number of frames for the median of the sharpness.
constexpr std::size_t kSharpnessMemory = 15;

/// Returns the number of landmarks of the reference keyframe that `min_views` keyframes observe, or
/// all keyframes if there are fewer.
int confirmed_in_reference(const LocalMap& local_map, int min_views) {
  const int needed = std::min<int>(min_views, static_cast<int>(local_map.keyframes.size()));
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
  return depths.empty() ? 0 : upper_median(depths);
}

bool loses_reference(const std::vector<LandmarkId>& landmarks, const LocalMap& local_map,
                     int min_views) {
  const auto matched =
      std::count_if(landmarks.begin(), landmarks.end(), [](auto id) { return id.valid(); });
  return static_cast<double>(matched) <
         kTrackedShare * confirmed_in_reference(local_map, min_views);
}

bool observes_unmapped_points(const Frame& frame, const std::vector<LandmarkId>& landmarks,
                              float near_depth) {
  int tracked = 0, untracked = 0;
  for (std::size_t i = 0; i < landmarks.size(); ++i) {
    const float depth = frame.features->keypoints[i].depth;
    if (depth <= 0 || depth > near_depth || frame.evidence.weight[i] <= 0) continue;
    ++(landmarks[i].valid() ? tracked : untracked);
  }
  return tracked < kMinTrackedNear && untracked > kMinUntrackedNear;
}

}  // namespace

KeyframePolicy::KeyframePolicy(const KeyframePolicyOptions& options, const DepthSensor& sensor)
    : options_(options), near_depth_(sensor.depth_at_sigma(kNearSigma)) {}

bool KeyframePolicy::wants_keyframe(const Frame& frame, const Pose& T_world_camera,
                                    const std::vector<LandmarkId>& landmarks,
                                    const LocalMap& local_map, std::size_t frames_since_last) {
  const TraceScope scope("keyframe decision");
  const bool blurred = is_blurred(frame);
  if (median_depth(*frame.features) <= 0) return false;  // no landmark could be made of it
  const bool wanted = frames_since_last >= static_cast<std::size_t>(options_.min_gap) &&
                      (loses_reference(landmarks, local_map, options_.min_views) ||
                       observes_unmapped_points(frame, landmarks, near_depth_) ||
                       has_new_viewpoint(frame, T_world_camera, local_map));
  const bool waits = wanted && blurred && waited_ < kMaxWait;
  waited_ = waits ? waited_ + 1 : 0;
  return wanted && !waits;
}

bool KeyframePolicy::is_blurred(const Frame& frame) {
  const double here = sharpness(frame.image->gray);
  sharpness_.push_back(here);
  if (sharpness_.size() > kSharpnessMemory) sharpness_.pop_front();
  std::vector<double> last(sharpness_.begin(), sharpness_.end());
  return here < options_.min_sharpness * upper_median(last);
}

bool KeyframePolicy::has_new_viewpoint(const Frame& frame, const Pose& T_world_camera,
                                       const LocalMap& local_map) const {
  const double reach = options_.max_translation * median_depth(*frame.features);
  if (reach <= 0) return false;
  return std::none_of(local_map.keyframes.begin(), local_map.keyframes.end(), [&](const auto& k) {
    const Pose T = k.T_world_camera.inverse() * T_world_camera;
    return T.angle() < options_.max_rotation * kDegree && T.translation().norm() < reach;
  });
}

}  // namespace stillmap
