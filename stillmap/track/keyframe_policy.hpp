// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/motion/frame.hpp"

#include <cstddef>
#include <deque>
#include <vector>

namespace stillmap {

struct KeyframePolicyOptions {
  int min_gap = 5;  ///< frames between keyframes at least
  double tracked_share =
      0.75;  ///< keep a frame that sees less than this share of the reference's landmarks
  int min_tracked_near = 100;   ///< near landmarks seen; fewer, and
  int min_untracked_near = 70;  ///< so many near keypoints that show none: keep the frame
  double max_rotation = 15;     ///< degrees from every keyframe nearby; more: keep the frame
  double max_translation =
      0.25;  ///< share of the median depth moved away from every keyframe nearby; more: keep
  /// A frame this much less sharp than the median of the last ones is blurred: its keypoints are
  /// few and displaced, and would stay in the map. A sharper one is waited for,
  double min_sharpness = 0.75;
  int sharpness_memory = 15;  ///< the median of so many frames
  int max_wait = 5;           ///< but for no more frames than this
  STILLMAP_FIELDS(min_gap, tracked_share, min_tracked_near, min_untracked_near, max_rotation,
                  max_translation, min_sharpness, sharpness_memory, max_wait)
};

/// Decides which frames are worth keeping: those that see what the map does not hold yet, or see it
/// from somewhere new; of those the sharp ones. Depends on the data alone, never on how busy the
/// mapper is. It is to be asked about every frame with a pose.
class KeyframePolicy {
 public:
  /// @param sensor the sensor that measured the depths of the keypoints
  KeyframePolicy(const KeyframePolicyOptions& options, const DepthSensor& sensor);

  /// @param landmarks per keypoint of `frame`: what it shows; invalid where nothing is known
  /// @param frames_since_last frames since the last one that was kept
  bool wants(const Frame& frame, const Pose& T_world_camera,
             const std::vector<LandmarkId>& landmarks, const LocalMap& local_map,
             std::size_t frames_since_last);

 private:
  bool adds_to_map(const Frame& frame, const Pose& T_world_camera,
                   const std::vector<LandmarkId>& landmarks, const LocalMap& local_map) const;
  bool is_blurred(const Frame& frame);
  bool sees_little_of_reference(const std::vector<LandmarkId>& landmarks,
                                const LocalMap& local_map) const;
  bool sees_much_unmapped(const Frame& frame, const std::vector<LandmarkId>& landmarks) const;
  bool stands_somewhere_new(const Frame& frame, const Pose& T_world_camera,
                            const LocalMap& local_map) const;

  KeyframePolicyOptions options_;
  float near_depth_;              // [m]
  std::deque<double> sharpness_;  // of the last frames
  int waited_ = 0;                // frames for a sharp one
};

}  // namespace stillmap
