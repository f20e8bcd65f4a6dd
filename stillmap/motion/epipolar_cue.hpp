// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/class_sets.hpp"
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/two_view.hpp"

#include <optional>
#include <set>
#include <string>
#include <vector>

namespace stillmap {

struct EpipolarOptions {
  ClassSets classes = indoor_classes();
  /// The paper names no window; 9 costs what 5 does, and loses fewer points.
  FlowOptions flow = {.window = 9};
  RansacOptions ransac = {.threshold = 1};  ///< of the fundamental matrix
  /// A keypoint further from its epipolar line than this moves [pixels]. The paper names no value;
  /// this is the 95 % quantile of the distance for an error of 1 pixel, sqrt(3.84), as Mur-Artal et
  /// al. (ORB-SLAM, TRO 2015, section IV) have it for fundamental matrices.
  double threshold = 1.96;
  bool test_standing_still = true;  ///< whether things that stay where they are are tested, too
};

/// The motion test of the improved-YOLOv7 system. Keypoints in the boxes of things that move by
/// themselves are dropped at once. All others, those on potentially moving things (a chair, a
/// book) and on what has no name, are dropped where they lie off the epipolar line that the
/// camera's motion since the frame before allows: see epipolar_distance().
///
/// The fundamental matrix comes from points followed by Lucas-Kanade that lie in no box of a moving
/// or potentially moving thing; where those are fewer than 30, from all outside of moving
/// things' boxes; where these are too few as well, or in the first frame, nothing is tested. Points
/// without flow are kept.
///
/// Known from the formula: movement along the epipolar line cannot be seen, and where the camera
/// stands still every line through a moving point's old position is allowed, so half of the
/// movement is lost on average.
class EpipolarCue : public MotionCue {
 public:
  explicit EpipolarCue(const EpipolarOptions& options);
  std::string_view name() const override { return "epipolar"; }
  std::set<std::string> classes() const override;
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  EpipolarOptions options_;
  FlowTracker flow_;
};

/// What EpipolarCue finds in one frame.
struct EpipolarLabels {
  std::vector<char> moving;  ///< per keypoint of this frame
  bool tested = false;       ///< whether there was a fundamental matrix
};

/// The test itself. `flow` has one entry per keypoint.
EpipolarLabels judge_by_epipolar_lines(const std::vector<Keypoint>& keypoints,
                                       const SegmentedFramePtr& instances, const KeypointFlow& flow,
                                       const EpipolarOptions& options);

}  // namespace stillmap
