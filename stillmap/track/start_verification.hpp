// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracked_frame.hpp"

#include <optional>

namespace stillmap {

/// Recognizes a map that was started on moving objects. The motion between the first two frames of
/// a map is ambiguous: a small rotation of the camera shifts distant points as a translation does,
/// so that somebody near may decide. Some frames later the parallax tells them apart.
///
/// In a few of the first frames the keypoints are matched with those of the first frame, by their
/// descriptors alone, and the rigid motion with which most of them agree is found. The map is wrong
/// if the tracked pose has far less support.
class StartVerification {
 public:
  /// Begins with the frame that starts a map.
  void begin(FramePtr first, const Pose& T_world_camera);

  /// Number of frames since the start of the map after which it is not verified any more.
  static constexpr int kFrames = 15;

  /// Adds the next frame of the map and its pose in the world of the map. Returns T_first_frame if
  /// the map is wrong, else none.
  std::optional<Pose> contradiction(const TrackingModel& model, const Frame& frame,
                                    const Pose& T_world_camera);

  /// Returns the number of frames since the start of the map.
  int frames() const { return frames_; }
  /// Returns T_world_camera of the first frame.
  const Pose& T_world_first() const { return T_world_first_; }

 private:
  FramePtr first_;  // null after the verification
  Pose T_world_first_;
  int frames_ = 0;
};

}  // namespace stillmap
