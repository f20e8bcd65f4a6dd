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
  /// Names of the cues that are combined, in this order; see make_cues().
  std::vector<std::string> cues = {"residual", "free-space", "surface", "history", "semantic"};
  SemanticCueOptions semantic;
  BoxFlowOptions box_flow;
  DynamicsGateOptions gate;
  EpipolarOptions epipolar;
  ResidualCueOptions residual;
  FreeSpaceCueOptions free_space;
};

/// Asks every cue and adds up their evidence.
class MotionEstimator {
 public:
  /// Throws Error for an unknown cue.
  explicit MotionEstimator(const MotionOptions& options);
  /// finish(begin(input), input).
  MotionEvidence estimate(const MotionInput& input);

  /// What the cues say up to the first that looks at instances: `input` need not have any
  /// yet, so this can be done while they are waited for.
  MotionEvidence begin(const MotionInput& input);
  /// What the other cues say too, of the same input with its instances, and what follows from all.
  MotionEvidence finish(MotionEvidence begun, const MotionInput& input);

  /// Names of the classes that the cues look at: instances of all others may be left out.
  std::set<std::string> classes() const;
  /// Returns the names of the cues in their order. Each is also the name of the cue's trace
  /// spans, one per frame.
  std::vector<std::string_view> cues() const;

 private:
  void ask(std::size_t first, std::size_t end, MotionEvidence& evidence, const MotionInput& input);

  bool judges_surfaces_ = false;
  std::vector<std::unique_ptr<MotionCue>> cues_;
  std::size_t first_with_instances_ = 0;  // in cues_
};

}  // namespace stillmap
