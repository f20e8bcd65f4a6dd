// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/class_sets.hpp"
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <set>
#include <string>
#include <vector>

namespace stillmap {

/// Part of the box of a dynamic class whose keypoints are in D without a test.
enum class BoxBody {
  kNone,          ///< None: all keypoints of the box are in F.
  kMoved,         ///< Surfaces that moved in one of the last frames.
  kDepthCluster,  ///< The largest cluster of depths in the box: see cluster_in_box().
};

struct BoxFlowOptions {
  /// Keypoints in boxes of dynamic and of potentially moving classes are tested.
  ClassSets classes = indoor_classes();
  double factor = 0.5;  ///< Limit l of equation 9, in units of the background's mean flow.
  BoxBody body = BoxBody::kMoved;
  /// Number of frames for which a surface stays in D after it moved (BoxBody::kMoved).
  int memory = 10;
};

/// The three sets of keypoints (section 1.3).
enum class FlowSet : std::uint8_t {
  kStatic,    ///< S: outside all boxes, or returned from F
  kDoubtful,  ///< F: inside a box, without a label yet
  kDynamic,   ///< D: on the moving body
};

/// Returns F for a keypoint inside one of the boxes, else S.
std::vector<FlowSet> divide_by_boxes(std::span<const Keypoint> keypoints,
                                     const std::vector<cv::Rect>& boxes);

/// Moves keypoints from F to D that lie in the largest cluster of depths of one of these boxes.
/// @param depth height x width [m]; 0 means unknown
void divide_by_depth(std::vector<FlowSet>& sets, std::span<const Keypoint> keypoints,
                     const cv::Mat1f& depth, const std::vector<cv::Rect>& bodies);

/// Radius around a keypoint that moved within which a keypoint shows the same surface [pixels].
inline constexpr float kSameSurface = 3;

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

/// Keypoints that moved in the last frames, which show where the body in a box is.
class MovedKeypoints {
 public:
  /// @param memory number of frames for which they are known
  explicit MovedKeypoints(int memory) : memory_(memory) {}

  /// Moves the points of F to D that are within kSameSurface of one that moved in the last frames.
  /// @param on_bodies per keypoint: 1 in the box of an object that can move by itself
  void divide(std::vector<FlowSet>& sets, const KeypointFlow& flow,
              const std::vector<char>& on_bodies);
  /// Adds a frame: the points that equation 9 found moving, and those that divide() moved to D.
  /// @param moving per keypoint: 1 if it is on a body, has flow and moves by equation 9
  void add(const KeypointFlow& flow, const std::vector<char>& moving);
  /// Adds a frame without any.
  void forget() { moved_.clear(); }

 private:
  struct Moved {
    cv::Point2f at;      // pixel in the newest frame
    int frames_ago = 0;  // since it moved
  };
  int memory_;
  std::vector<Moved> moved_;     // of the previous frame
  std::vector<int> frames_ago_;  // per keypoint of this frame: see divide(); -1 for none
};

/// The motion test of the YOLO11n + Lucas-Kanade system (Feng et al. 2026, section 1.3): keypoints
/// in the boxes of moving and of potentially moving objects are excluded if their flow since the
/// previous frame differs from the background's mean flow. Masks are not used. This frame's
/// keypoints are tracked back into the previous frame; in the first frame all of F is excluded.
///
/// The paper puts the points on a person's body into D at once and tests only the rest of the box,
/// F. It does not say how the body is found within a box, only that optical flow and consistency
/// over time are used. Here the body is every surface that moved before: a keypoint on a surface
/// that equation 9 found moving in one of the last `memory` frames is in D, even while it pauses.
/// BoxBody selects other interpretations.
///
/// Limits of the formulas: for a camera at rest, l approaches 0 and the noise of the flow decides,
/// so that nearly all of F is excluded, sitting people included; a rotation about the optical axis
/// or a translation along it has flows without a common mean, with the same effect; and for a fast
/// camera, slow movers are kept.
///
/// The pixels of the box of a dynamic class count as moving if at least half of its keypoints are
/// in D or it has none.
class BoxFlowCue : public MotionCue {
 public:
  explicit BoxFlowCue(const BoxFlowOptions& options);
  std::string_view name() const override { return "box-flow"; }
  std::set<std::string> classes() const override;
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  std::vector<FlowSet> sets_of(const MotionInput& input, const std::vector<cv::Rect>& bodies,
                               const std::vector<cv::Rect>& boxes);

  BoxFlowOptions options_;
  FlowTracker flow_;
  MovedKeypoints moved_;
};

}  // namespace stillmap
