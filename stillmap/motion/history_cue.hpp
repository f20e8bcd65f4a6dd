// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/surface_spread.hpp"

namespace stillmap {

/// Spreads the evidence of the preceding cues along the surfaces, as objects move as a whole: each
/// cell gets the mean log-odds of the observations that reach it, sum / (kDoubt + count), and
/// counts as one observation from then on.
class SurfaceCue : public MotionCue {
 public:
  std::string_view name() const override { return "surface"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;
};

/// Recursive estimate of each surface's log-odds, l = kMemory * l' + evidence of the preceding cues
/// for this frame, where l' belongs to the cell of the previous frame that shows the same surface.
/// Keypoints matched to a landmark also get its log-odds from earlier frames, which persist while
/// it is occluded.
class HistoryCue : public MotionCue {
 public:
  std::string_view name() const override { return "history"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;
};

}  // namespace stillmap
