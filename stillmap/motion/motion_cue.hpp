// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/cell_grid.hpp"
#include "stillmap/motion/ego_motion.hpp"
#include "stillmap/motion/frame.hpp"

#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace stillmap {

/// What a cue may look at. Pointers that may be null say so.
struct MotionInput {
  RgbdFramePtr image;
  FeaturesPtr features;
  PyramidShape pyramid{};  ///< The scales that the levels of the keypoints stand for.
  CellGridPtr cells;
  SegmentedFramePtr instances;  ///< may be null: no network, no masks, or none has come yet
  /// Of `instances`; null where those are, or no cue speaks of surfaces.
  InstanceCellsPtr instance_cells;
  FramePtr previous;  ///< the frame before, with its evidence; null for the first
  /// None for a first frame, and where the camera is lost.
  std::optional<EgoMotion> ego_motion;
};

/// Log-odds against "static" of a keypoint that a cue without probabilities takes for moving: one
/// such decision in e^6 = 400 is wrong.
constexpr float kCertainlyMoving = 6;

/// One reason to believe that something moves.
class MotionCue {
 public:
  virtual ~MotionCue() = default;
  virtual std::string_view name() const = 0;
  /// Names of the classes whose instances it looks at; none for a cue that needs no instances.
  virtual std::set<std::string> classes() const { return {}; }
  /// Whether it speaks of surfaces, evidence.surface_measured or .surface_prior, too.
  virtual bool provides_surface_evidence() const { return false; }
  /// Adds this cue's log-likelihood ratios to `evidence.static_log_odds` (already sized, one per
  /// keypoint) and marks the pixels it takes for moving in `evidence.moving_pixels` (empty or
  /// image-sized); or, where surfaces are judged, adds to what is known of those.
  virtual void add_to(MotionEvidence& evidence, const MotionInput& input) = 0;
};

}  // namespace stillmap
