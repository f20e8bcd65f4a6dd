// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/surface_spread.hpp"

namespace stillmap {

/// Whole things move, not single points: what the cues before it say of cells is spread along the
/// surfaces, and each cell takes the mean log-odds of the observations that reach it,
/// sum / (doubt + count). After it a cell counts as one observation.
class SurfaceCue : public MotionCue {
 public:
  std::string_view name() const override { return "surface"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;
};

/// What was static stays static until something speaks against it: a recursive estimate of each
/// surface's log-odds, l = memory * l' + what the cues before it say of this frame, where l' is
/// that of the cell of the frame before which the surface lies in; and for keypoints that show a
/// landmark what earlier frames said of it, which lasts while it is hidden.
class HistoryCue : public MotionCue {
 public:
  std::string_view name() const override { return "history"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;
};

}  // namespace stillmap
