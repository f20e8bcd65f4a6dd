// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/box_flow_cue.hpp"
#include "stillmap/motion/dynamics_gate.hpp"
#include "stillmap/motion/epipolar_cue.hpp"
#include "stillmap/motion/free_space_cue.hpp"
#include "stillmap/motion/history_cue.hpp"
#include "stillmap/motion/make_cues.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/residual_cue.hpp"
#include "stillmap/motion/semantic_cue.hpp"

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

struct MotionOptions {
  /// Names of the combined cues, in this order; see make_cues().
  std::vector<std::string> cues = {"residual", "free-space", "surface", "history", "semantic"};
  SemanticCueOptions semantic;
  BoxFlowOptions box_flow;
  DynamicsGateOptions gate;
  EpipolarOptions epipolar;
};

/// Returns the evidence of a frame without that of measurements, which the motion of the camera
/// decides: only surfaces of moving classes are moving. For a frame whose motion proved to be
/// wrong.
MotionEvidence evidence_of_classes(const Frame& frame);

/// Sums the evidence of all cues.
class MotionEstimator {
 public:
  /// Throws Error for an unknown cue.
  explicit MotionEstimator(const MotionOptions& options);
  /// Returns finish(begin(input), input).
  MotionEvidence estimate(const MotionInput& input);

  /// Returns the evidence of the cues before the first that uses instances. `input` need not have
  /// instances yet, so this can run while they are computed.
  MotionEvidence begin(const MotionInput& input);
  /// Returns the evidence of all cues. `begun` is the result of begin() for the same input without
  /// instances.
  MotionEvidence finish(MotionEvidence begun, const MotionInput& input);

  /// Returns whether a cue uses MotionInput::ego_motion, as those of surfaces do.
  bool needs_pose() const { return has_surface_evidence_; }
  /// Returns the names of the classes that the cues use; instances of others may be left out.
  std::set<std::string> classes() const;
  /// Returns the names of the cues in their order. Each is also the name of the cue's trace
  /// spans, one per frame.
  std::vector<std::string_view> cues() const;

 private:
  void add_cues(std::size_t first, std::size_t end, MotionEvidence& evidence,
                const MotionInput& input);

  bool has_surface_evidence_ = false;
  std::vector<std::unique_ptr<MotionCue>> cues_;
  std::size_t first_with_instances_ = 0;  // index into cues_
};

}  // namespace stillmap
