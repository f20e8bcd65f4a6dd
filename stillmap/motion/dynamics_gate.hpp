// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/two_view.hpp"

#include <cstddef>
#include <deque>
#include <future>
#include <memory>
#include <optional>
#include <set>
#include <string>

namespace stillmap {

struct DynamicsGateOptions {
  /// Whether T of equation 6 is the image rotation and translation, SE(2), nearest to the
  /// homography instead of the homography itself. The paper states T in SE(2), "obtained by
  /// decomposing the homography". But SE(2) can neither scale nor shear the image, so the parallax
  /// of a moving camera marks frames in which nothing moves; in the paper static sequences have low
  /// dynamics.
  bool in_se2 = false;
  double warp_error = 1.7;    ///< Limit a of equation 7: a larger error marks a keypoint [pixels].
  double marked_share = 0.1;  ///< Limit b of equation 8: a larger share of them marks a frame.
};

/// Returns the share of a frame's keypoints that are marked, equations 6 to 8: their error under
/// the transformation between the two frames is `warp_error` or more. Keypoints without flow are
/// not marked. None if too few keypoints were tracked or no homography fits.
/// @param keypoints number of all keypoints of the frame, W of equation 8
std::optional<double> marked_share(const KeypointFlow& flow, std::size_t keypoints,
                                   const DynamicsGateOptions& options);

/// Decides whether the scene is highly dynamic: the stage of that name in the high/low-dynamics
/// system (Fu et al. 2024, section 1.1). Keypoints of the previous frame are tracked by
/// Lucas-Kanade and compared with their positions under a transformation of the image (equations 6
/// and 7); a frame is marked if they are more than a tenth of its keypoints (equation 8); the scene
/// is highly dynamic while more than half of the last ten frames are marked.
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

/// Applies another cue only while the scene is highly dynamic, and sets MotionEvidence::dynamics.
/// From begin() to add_to() the gate runs on its own thread, parallel to the network. add_to()
/// waits for it, so the result does not depend on timing.
class GatedCue : public MotionCue {
 public:
  GatedCue(const DynamicsGateOptions& options, std::unique_ptr<MotionCue> cue);
  std::string_view name() const override { return name_; }
  std::set<std::string> classes() const override { return cue_->classes(); }
  void begin(const MotionInput& input) override;
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  DynamicsGate gate_;
  std::unique_ptr<MotionCue> cue_;
  std::string name_;
  std::future<bool> highly_dynamic_;  // of the frame of begin(); last, as its thread uses the gate
};

}  // namespace stillmap
