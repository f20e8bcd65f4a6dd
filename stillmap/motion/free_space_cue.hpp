// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <deque>
#include <vector>

namespace stillmap {

/// Free space votes: surfaces in space that an earlier view saw through. A view has free space up
/// to its measured depth, so a point in front of that by more than the depth tolerance was not
/// there at that time. A point on the measured surface is static, unless the view labeled it as
/// moving; an occluded point gets no evidence.
class FreeSpaceCue : public MotionCue {
 public:
  std::string_view name() const override { return "free-space"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  /// Depths of a cell and its neighbors [m]; `nearest` is 0 if unknown. The range of a moving
  /// surface ends in front of the camera, so that no point agrees with it.
  struct DepthRange {
    float nearest = 0, farthest = 0;
  };
  /// The surfaces of an earlier frame.
  struct View {
    std::size_t frame_index = 0;
    Pose T_odometry_camera;
    ExposureMotion exposure;
    std::vector<DepthRange> surface;  // per cell, row by row
  };

  static std::vector<DepthRange> surface_of(const Frame& frame);
  void remember(const Frame& frame, const Pose& T_odometry_camera);
  std::vector<const View*> chosen(std::size_t frame_index) const;
  static void compare(const View& view, const MotionInput& input, MotionEvidence& evidence);

  std::deque<View> views_;  // oldest first
};

}  // namespace stillmap
