// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/class_sets.hpp"
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/two_view.hpp"

#include <set>
#include <string>
#include <vector>

namespace stillmap {

struct EpipolarOptions {
  ClassSets classes = indoor_classes();
  /// Whether keypoints outside all boxes and on objects of other classes are tested as well, which
  /// the paper does not do (cue epipolar-everywhere).
  bool everywhere = false;
  /// A keypoint further from its epipolar line than this moves [pixels]. The paper names no value;
  /// this is the 95 % quantile of the distance for an error of 1 pixel, sqrt(3.84), as used by
  /// Mur-Artal et al. (ORB-SLAM, TRO 2015, section IV) for fundamental matrices.
  double threshold = 1.96;
};

/// The motion test of the improved-YOLOv7 system (Shi et al. 2024, section 1.3). Keypoints in the
/// boxes of objects that move by themselves are excluded at once. Keypoints on objects that
/// somebody may move (a chair, a book) are excluded if they are off the epipolar line of the
/// camera's motion since the previous frame: see epipolar_distance(). Keypoints on static objects
/// and on unrecognized surroundings are kept.
///
/// The fundamental matrix comes from points tracked by Lucas-Kanade outside the boxes of dynamic
/// and potentially moving objects; with fewer than 30 of them, from all outside the boxes of
/// dynamic objects; with too few of these as well, or in the first frame, nothing is tested. Points
/// without flow are kept.
///
/// Limits of the formula: movement along the epipolar line is not observable, and for a camera at
/// rest every line through a moving point's old position is allowed, so half of the movement is
/// lost on average.
class EpipolarCue : public MotionCue {
 public:
  explicit EpipolarCue(const EpipolarOptions& options);
  std::string_view name() const override {
    return options_.everywhere ? "epipolar-everywhere" : "epipolar";
  }
  std::set<std::string> classes() const override;
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  EpipolarOptions options_;
  FlowTracker flow_;
};

/// The result of EpipolarCue for one frame.
struct EpipolarLabels {
  std::vector<char> moving;  ///< Per keypoint of this frame: 1 if it moves, else 0.
  bool tested = false;       ///< Whether there was a fundamental matrix.
};

/// Returns the labels of a frame. `flow` has one entry per keypoint.
EpipolarLabels labels_by_epipolar_lines(std::span<const Keypoint> keypoints,
                                        const SegmentedFramePtr& instances,
                                        const KeypointFlow& flow, const EpipolarOptions& options);

}  // namespace stillmap
