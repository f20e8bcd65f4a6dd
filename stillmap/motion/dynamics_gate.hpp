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
  double warp_error = 1.7;    ///< A keypoint with a larger error is marked [pixels] (equation 6).
  double marked_share = 0.1;  ///< A frame with a larger share of them is marked (equation 7).
};

/// Returns the share of the pairs whose error under a RANSAC homography between the two frames
/// exceeds `warp_error` [pixels]; none if too few keypoints were tracked or no homography fits.
std::optional<double> share_off_homography(const KeypointFlow& flow, double warp_error);

/// Decides whether the scene is highly dynamic: the stage of that name in the high/low-dynamics
/// system. Keypoints of the previous frame are tracked by Lucas-Kanade and compared with their
/// positions under a homography (equation 6); a frame with more than a tenth of large errors is
/// marked (equation 7); the scene is highly dynamic while more than half of the last ten frames are
/// marked (equation 8).
///
/// In the paper the first ten frames take the label of the tenth. A live stream cannot wait for it,
/// so here they count as highly dynamic, and nothing is mapped from people before the label is
/// known. From the tenth frame on the labels are the paper's. A frame without a share (the first,
/// one without texture) has no vote and leaves the window unchanged.
class DynamicsGate {
 public:
  explicit DynamicsGate(const DynamicsGateOptions& options);
  /// Adds the next frame and returns whether the scene is highly dynamic as of it.
  bool push(const MotionInput& input);
  /// Adds a frame by its share of marked keypoints [0..1], like push() of a frame.
  bool push(std::optional<double> marked_share);
  bool highly_dynamic() const;

 private:
  DynamicsGateOptions options_;
  FlowTracker flow_;
  int frames_ = 0;           // number of frames so far, at most kWindow
  std::deque<bool> marked_;  // of the last frames with a share, at most kWindow
};

/// Applies another cue only while the scene is highly dynamic.
class GatedCue : public MotionCue {
 public:
  GatedCue(const DynamicsGateOptions& options, std::unique_ptr<MotionCue> cue);
  std::string_view name() const override { return name_; }
  std::set<std::string> classes() const override { return cue_->classes(); }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  DynamicsGate gate_;
  std::unique_ptr<MotionCue> cue_;
  std::string name_;
};

}  // namespace stillmap
