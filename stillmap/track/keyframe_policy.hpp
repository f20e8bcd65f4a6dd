// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"

#include <cstddef>
#include <deque>
#include <vector>

namespace stillmap {

/// A keypoint is near while the standard deviation of its depth is below this [m]: that of a Kinect
/// v1 at 3 m, forty of its baselines (Mur-Artal and Tardos, ORB-SLAM2, TRO 2017, section III.A).
inline constexpr double kNearSigma = 0.014044;

struct KeyframePolicyOptions {
  int min_gap = 5;  ///< Minimum number of frames between keyframes.
  /// A frame rotated by more from every keyframe around is kept [degrees].
  double max_rotation = 15;
  /// A frame further away from every keyframe around is kept [share of its median depth].
  double max_translation = 0.25;
  /// Minimum number of keyframes that observe a landmark of the reference keyframe for it to count.
  int min_views = 3;
  /// A frame counts as blurred if its sharpness is below this share of the median of the last
  /// frames [0..1]. Its keypoints are few and displaced, and would stay in the map.
  double min_sharpness = 0.75;
};

/// Decides which tracked frames become keyframes: sharp ones that observe unmapped parts of the
/// scene, or mapped parts from a new viewpoint. It depends on the data alone, never on the load of
/// the mapper. It must be asked about every frame with a pose.
class KeyframePolicy {
 public:
  /// @param sensor the sensor that measured the depths of the keypoints
  KeyframePolicy(const KeyframePolicyOptions& options, const DepthSensor& sensor);

  /// Longest wait for a sharp frame after a blurred one was wanted [frames].
  static constexpr int kMaxWait = 5;

  /// @param landmarks         matched landmark of each keypoint, or invalid
  /// @param frames_since_last frames since the last keyframe
  bool wants_keyframe(const Frame& frame, const Pose& T_world_camera,
                      const std::vector<LandmarkId>& landmarks, const LocalMap& local_map,
                      std::size_t frames_since_last);

 private:
  bool is_blurred(const Frame& frame);
  bool has_new_viewpoint(const Frame& frame, const Pose& T_world_camera,
                         const LocalMap& local_map) const;

  KeyframePolicyOptions options_;
  float near_depth_;              // [m]
  std::deque<double> sharpness_;  // of the last frames
  int waited_ = 0;                // frames since a blurred one was wanted
};

}  // namespace stillmap
