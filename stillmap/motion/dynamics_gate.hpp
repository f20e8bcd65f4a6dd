// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/two_view.hpp"

#include <deque>
#include <memory>
#include <optional>
#include <set>
#include <string>

namespace stillmap {

struct DynamicsGateOptions {
  /// The paper names no window; 9 costs what 5 does, and loses fewer points.
  FlowOptions flow = {.window = 9};
  /// Of the homography; the paper names no threshold, so OpenCV's default.
  RansacOptions ransac = {.threshold = 3};
  double warp_error = 1.7;    ///< a keypoint further off than this is marked [pixels] (equation 6)
  double marked_share = 0.1;  ///< a frame with more marked keypoints is marked (equation 7)
};

/// Share of the pairs that a RANSAC homography between the two frames misses by more than
/// options.warp_error; none where too few were followed, or nothing fits.
std::optional<double> share_off_homography(const KeypointFlow& flow,
                                           const DynamicsGateOptions& options);

/// Whether the scene is highly dynamic: the stage of that name in the high/low-dynamics system.
/// Keypoints of the last frame are followed by Lucas-Kanade and compared with where a homography
/// takes them (equation 6); a frame where more than a tenth are off is marked (equation 7); the
/// scene is highly dynamic where more than half of the last ten frames are marked (equation 8).
///
/// In the paper the first ten frames take the label of the tenth. A live stream cannot wait for
/// it, so here they count as highly dynamic, the safe side: nothing is mapped from people before
/// it is known how dynamic the scene is. From the tenth on the labels are the paper's. A frame
/// that cannot be judged (the first, one without texture) has no vote and leaves the window as it
/// is.
class DynamicsGate {
 public:
  explicit DynamicsGate(const DynamicsGateOptions& options);
  /// Judges the next frame. @return whether the scene is highly dynamic as of it
  bool push(const MotionInput& input);
  /// The same for a frame whose share of marked keypoints is known already.
  bool push(std::optional<double> marked_share);
  bool highly_dynamic() const;

 private:
  DynamicsGateOptions options_;
  FlowTracker flow_;
  int frames_ = 0;           // pushed so far, at most window
  std::deque<bool> marked_;  // of the last frames that could be judged, at most window
};

/// Another cue, asked only while the scene is highly dynamic.
class GatedCue : public MotionCue {
 public:
  GatedCue(const DynamicsGateOptions& options, std::unique_ptr<MotionCue> cue);
  std::string_view name() const override { return name_; }
  std::set<std::string> classes() const override { return cue_->classes(); }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;
  const DynamicsGate& gate() const { return gate_; }

 private:
  DynamicsGate gate_;
  std::unique_ptr<MotionCue> cue_;
  std::string name_;
};

}  // namespace stillmap
