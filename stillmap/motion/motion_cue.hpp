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

/// The input of the cues for one frame.
struct MotionInput {
  RgbdFramePtr image;
  FeaturesPtr features;
  PyramidShape pyramid{};  ///< Scales of the keypoints' pyramid levels.
  CellGridPtr cells;
  ExposureMotion exposure{};    ///< Motion of the camera during the exposure of the depth image.
  SegmentedFramePtr instances;  ///< Null without a network or masks, or before the first result.
  /// Cells of `instances`; null if those are null or no cue provides surface evidence.
  InstanceCellsPtr instance_cells;
  FramePtr previous;  ///< Previous frame with its evidence; null for the first frame.
  std::optional<EgoMotion> ego_motion;  ///< None for a first frame and for a lost camera.
};

/// Decrease of the static log-odds of a keypoint that a cue without probabilities labels as moving:
/// one of e^6 = 400 such decisions is wrong.
constexpr float kCertainlyMoving = 6;

/// One source of evidence for motion.
class MotionCue {
 public:
  virtual ~MotionCue() = default;
  virtual std::string_view name() const = 0;
  /// Returns the names of the classes whose instances it uses; none for a cue without instances.
  virtual std::set<std::string> classes() const { return {}; }
  /// Returns whether it adds to evidence.surface_measured or evidence.surface_prior.
  virtual bool provides_surface_evidence() const { return false; }
  /// Starts the work of the frame that needs no instances, before add_to() of the same frame, while
  /// the network may still be at work. `input` has no instances yet.
  virtual void begin(const MotionInput& /*input*/) {}
  /// Adds this cue's log-likelihood ratios to `evidence.static_log_odds` (already sized, one per
  /// keypoint) and marks the pixels it labels as moving in `evidence.moving_pixels` (empty or
  /// image-sized). A cue with surface evidence adds to the surface fields instead.
  virtual void add_to(MotionEvidence& evidence, const MotionInput& input) = 0;
};

}  // namespace stillmap
