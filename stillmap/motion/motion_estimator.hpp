// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/motion/box_flow_cue.hpp"
#include "stillmap/motion/dynamics_gate.hpp"
#include "stillmap/motion/epipolar_cue.hpp"
#include "stillmap/motion/free_space_cue.hpp"
#include "stillmap/motion/history_cue.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/presets.hpp"
#include "stillmap/motion/residual_cue.hpp"
#include "stillmap/motion/semantic_cue.hpp"

#include <memory>
#include <set>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

struct MotionOptions {
  std::string preset = "fused";  ///< which list of cues: see presets()
  double exclude_below = 0.25;   ///< probability of being static under which a keypoint is left out
  /// Names of cues of the preset that are left out, to see what each is worth.
  std::vector<std::string> without;
  SemanticCueOptions semantic;
  BoxFlowOptions box_flow;
  DynamicsGateOptions gate;
  EpipolarOptions epipolar;
  ResidualCueOptions residual;
  FreeSpaceCueOptions free_space;
  SurfaceCueOptions surface;
  HistoryCueOptions history;
  STILLMAP_FIELDS(preset, exclude_below, without, semantic, box_flow, gate, epipolar, residual,
                  free_space, surface, history)
};

/// Asks every cue of a preset and adds up what they say.
class MotionEstimator {
 public:
  /// Throws Error for an unknown preset, and for a cue to be left out that the preset does not
  /// have.
  explicit MotionEstimator(const MotionOptions& options);
  /// finish(begin(input), input).
  MotionEvidence estimate(const MotionInput& input);

  /// What the preset's cues say up to the first that looks at instances: `input` need not have any
  /// yet, so this can be done while they are waited for.
  MotionEvidence begin(const MotionInput& input);
  /// What the other cues say too, of the same input with its instances, and what follows from all.
  MotionEvidence finish(MotionEvidence begun, const MotionInput& input);

  /// Names of the classes that the cues look at: instances of all others may be left out.
  std::set<std::string> classes() const;
  /// Returns the names of the cues in the preset's order. Each is also the name of the cue's trace
  /// spans, one per frame.
  std::vector<std::string_view> cues() const;

 private:
  void ask(std::size_t first, std::size_t end, MotionEvidence& evidence, const MotionInput& input);

  double exclude_below_;
  bool judges_surfaces_ = false;
  std::vector<std::unique_ptr<MotionCue>> cues_;
  std::size_t first_with_instances_ = 0;  // in cues_
};

}  // namespace stillmap
