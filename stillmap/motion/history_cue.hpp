// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/surface_spread.hpp"

namespace stillmap {

struct SurfaceCueOptions {
  SpreadOptions spread;
  double doubt = 1.0;  ///< observations that say nothing, added to those of each surface
  STILLMAP_FIELDS(spread, doubt)
};

/// Whole things move, not single points: what the cues before it say of cells is spread along the
/// surfaces, and each cell takes the mean log-odds of the observations that reach it,
/// sum / (doubt + count). After it a cell counts as one observation.
class SurfaceCue : public MotionCue {
 public:
  explicit SurfaceCue(const SurfaceCueOptions& options) : options_(options) {}
  std::string_view name() const override { return "surface"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  SurfaceCueOptions options_;
};

struct HistoryCueOptions {
  double memory = 0.8;     ///< share of a surface's log-odds that lasts to the next frame
  double most = 3;         ///< log-odds in favor of static never grow beyond
  double least = -6;       ///< nor those against it
  double landmarks = 0.5;  ///< what a landmark's history counts for
  STILLMAP_FIELDS(memory, most, least, landmarks)
};

/// What was static stays static until something speaks against it: a recursive estimate of each
/// surface's log-odds, l = memory * l' + what the cues before it say of this frame, where l' is
/// that of the cell of the frame before which the surface lies in; and for keypoints that show a
/// landmark what earlier frames said of it, which lasts while it is hidden.
class HistoryCue : public MotionCue {
 public:
  explicit HistoryCue(const HistoryCueOptions& options) : options_(options) {}
  std::string_view name() const override { return "history"; }
  bool provides_surface_evidence() const override { return true; }
  void add_to(MotionEvidence& evidence, const MotionInput& input) override;

 private:
  HistoryCueOptions options_;
};

}  // namespace stillmap
