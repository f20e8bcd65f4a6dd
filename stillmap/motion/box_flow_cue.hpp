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
  ClassSets classes = indoor_classes();  ///< the dynamic ones' boxes are looked into
  FlowOptions flow;                      ///< the paper's window is 5 x 5
  double factor = 0.5;    ///< l of equation 9, in units of the background's mean flow
  double least_flow = 0;  ///< l is never smaller [pixels]; the paper has no such floor: 0
};

/// The three sets of keypoints.
enum class FlowSet : std::uint8_t {
  kStatic,    ///< S: outside all boxes, or returned to it from F
  kDoubtful,  ///< F: inside a box, and not judged yet
  kDynamic,   ///< D: on the moving thing
};

/// F where a keypoint lies inside one of the boxes, else S.
std::vector<FlowSet> divide_by_boxes(const std::vector<Keypoint>& keypoints,
                                     const std::vector<cv::Rect>& boxes);

/// Empties F by the flow. With (u, v) a point's flow and n points of S that have one:
///
///     (U, V) = 1/n * sum over S of (u, v)                              (equation 8)
///     |(u, v) - (U, V)| > l = factor * |(U, V)|  =>  D, else S         (equation 9)
///
/// A point of S without flow stays in S and is not counted in the mean; a point of F without flow
/// joins D, as all of F does where no point of S has flow: what cannot be shown to stand still
/// inside a person's box is taken for the person.
void judge_by_flow(std::vector<FlowSet>& sets, const KeypointFlow& flow, double factor,
                   double least_flow);

/// The motion test of the YOLO11n + Lucas-Kanade system: keypoints in the boxes of things that move
/// by themselves are dropped where their flow since the frame before differs from the background's
/// mean flow. Masks are not looked at. The points followed are this frame's keypoints, back into
/// the frame before, as it is they that are judged; in the first frame all of F is dropped.
///
/// Known from the formulas: where the camera stands still, l comes to nothing and the noise of the
/// flow decides, so that nearly all of F is dropped, sitting people included (least_flow = 1 mends
/// that); a turn about the optical axis or a movement along it has flows without a common mean,
/// with the same effect; and where the camera moves fast, slow movers pass.
///
/// Pixels of a box count as moving where at least half of its keypoints are in D, or it has none.
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
