// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracked_frame.hpp"

#include <cstdint>
#include <optional>
#include <vector>

namespace stillmap {

/// Recognizes a map that was started on moving objects. The motion between the first two frames of
/// a map is ambiguous: a small rotation of the camera shifts distant points as a translation does,
/// so that somebody near may decide. Some frames later the parallax tells them apart.
///
/// In the first frames the keypoints are matched with those of an earlier one, by their descriptors
/// alone; most of them agree with one rigid motion, others with further ones. The map is wrong if
/// one of these explains far more of the image than the tracked motion: each is first refined by
/// the image, so that a small error of either does not decide.
class StartVerification {
 public:
  /// Begins with the frame that starts a map.
  void begin(FramePtr first, const Pose& T_world_camera);

  /// Moves the poses along with a correction of the map.
  void move(const Pose& T_corrected_world) {
    T_world_earlier_ = T_corrected_world * T_world_earlier_;
  }

  /// Number of frames since the start of the map up to which it is verified. Later on somebody who
  /// fills the view of a right map would replace it.
  static constexpr int kFrames = 16;

  /// Another motion of the camera than the tracked one.
  struct Motion {
    Pose T_world_camera;   ///< Pose of the frame by it.
    Pose T_previous_next;  ///< By it in one frame.
    /// 1 for each keypoint of the frame at which the earlier frame shows a surface, too.
    std::vector<std::uint8_t> stands;
  };

  /// Adds the next frame of the map and its pose in the world of the map. Returns the motion if the
  /// map is wrong, else none.
  std::optional<Motion> contradiction(const TrackingModel& model, const FramePtr& frame,
                                      const Pose& T_world_camera);

 private:
  FramePtr earlier_;  // null after the verification
  Pose T_world_earlier_;
  int frames_ = 0, since_ = 0;  // since the start of the map and since the earlier frame
};

}  // namespace stillmap
