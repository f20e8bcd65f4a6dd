// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <deque>
#include <vector>

namespace stillmap {

struct FreeSpaceCueOptions {
  int view_every = 5;  ///< frames from one remembered view to the next
  /// Ages of the views that a frame is held against [frames].
  std::vector<int> ages = {5, 15, 35, 75, 150};
  double intruding = -3.0;  ///< log-odds of a surface where a view saw free space
  double agreeing = 1.0;  ///< of one that a view saw in the same place, and did not take for moving
  /// What a cell of such a surface counts for beside a followed keypoint.
  double intruding_count = 0.2, agreeing_count = 0.1;
  /// A thing that moves slowly still covers itself after a while: agreement counts in proportion to
  /// the view's age, in full from this one on [frames].
  int full_age = 35;
};

/// Surfaces where there was free space a while ago: something came there. A view saw free space
/// all the way to what it measured, so a point that lies in front of that, by more than the depth
/// tolerance, was not there then. A point that lies on it is static, unless the view took it for
/// moving; one behind it was hidden then, and nothing is known.
class FreeSpaceCue : public MotionCue {
 public:
  explicit FreeSpaceCue(const FreeSpaceCueOptions& options) : options_(options) {}
  std::string_view name() const override { return "free-space"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  /// Of a cell and its neighbors [m]. Nothing agrees with what was moving: it reaches nowhere.
  struct DepthRange {
    float nearest = 0, farthest = 0;  // nearest is 0 where it is unknown
  };
  /// What was seen from where.
  struct View {
    std::size_t frame_index = 0;
    Pose T_world_camera;
    std::vector<DepthRange> surface;  // of each cell, row by row
  };

  static std::vector<DepthRange> surface_of(const Frame& frame);
  void remember(const Frame& frame, const Pose& T_world_camera);
  std::vector<const View*> chosen(std::size_t frame_index) const;
  void compare(const View& view, const MotionInput& input, MotionEvidence& evidence) const;

  FreeSpaceCueOptions options_;
  std::deque<View> views_;  // oldest first
};

}  // namespace stillmap
