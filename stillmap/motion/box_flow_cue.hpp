// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/class_sets.hpp"
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <set>
#include <string>
#include <vector>

namespace stillmap {

struct BoxFlowOptions {
  ClassSets classes = indoor_classes();  ///< Keypoints in boxes of dynamic classes are tested.
  double factor = 0.5;  ///< Limit l of equation 9, in units of the background's mean flow.
};

/// The three sets of keypoints.
enum class FlowSet : std::uint8_t {
  kStatic,    ///< S: outside all boxes, or returned from F
  kDoubtful,  ///< F: inside a box, without a label yet
  kDynamic,   ///< D: on the moving object
};

/// Returns F for a keypoint inside one of the boxes, else S.
std::vector<FlowSet> divide_by_boxes(const std::vector<Keypoint>& keypoints,
                                     const std::vector<cv::Rect>& boxes);

/// Moves each point of F to S or D by the flow. With (u, v) a point's flow and n points of S that
/// have one:
///
///     (U, V) = 1/n * sum over S of (u, v)                              (equation 8)
///     |(u, v) - (U, V)| > l = factor * |(U, V)|  =>  D, else S         (equation 9)
///
/// A point of S without flow stays in S and is not counted in the mean; a point of F without flow
/// joins D, as does all of F if no point of S has flow: a point inside a person's box that cannot
/// be shown to be static counts as the person's.
void divide_by_flow(std::vector<FlowSet>& sets, const KeypointFlow& flow, double factor);

/// The motion test of the YOLO11n + Lucas-Kanade system: keypoints in the boxes of dynamic objects
/// are excluded if their flow since the previous frame differs from the background's mean flow.
/// Masks are not used. This frame's keypoints are tracked back into the previous frame; in the
/// first frame all of F is excluded.
///
/// Limits of the formulas: for a camera at rest, l approaches 0 and the noise of the flow decides,
/// so that nearly all of F is excluded, sitting people included; a rotation about the optical axis
/// or a translation along it has flows without a common mean, with the same effect; and for a fast
/// camera, slow movers are kept.
///
/// The pixels of a box count as moving if at least half of its keypoints are in D or it has none.
class BoxFlowCue : public MotionCue {
 public:
  explicit BoxFlowCue(const BoxFlowOptions& options);
  std::string_view name() const override { return "box-flow"; }
  std::set<std::string> classes() const override;
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  BoxFlowOptions options_;
  FlowTracker flow_;
};

}  // namespace stillmap
