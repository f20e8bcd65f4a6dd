// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/motion/motion_cue.hpp"
#include "stillmap/motion/semantic_cue.hpp"

#include <memory>
#include <string>
#include <vector>

namespace stillmap {

struct MotionOptions {
  std::string preset = "seg-mask";  ///< which list of cues: see presets()
  double exclude_below = 0.25;  ///< probability of being static under which a keypoint is left out
  SemanticCueOptions semantic;
  STILLMAP_FIELDS(preset, exclude_below, semantic)
};

/// A named list of cues.
struct Preset {
  std::string name;
  std::string description;
  bool wants_instances = false;  ///< whether a network or a folder of masks is of use to it
};

/// The presets there are, in the order they are listed to the user.
const std::vector<Preset>& presets();

/// The preset of that name. Throws Error naming the nearest known one.
const Preset& find_preset(const std::string& name);

/// Asks every cue of a preset and adds up what they say.
class MotionEstimator {
 public:
  /// Throws Error for an unknown preset.
  explicit MotionEstimator(const MotionOptions& options);
  MotionEvidence estimate(const MotionInput& input);

 private:
  double exclude_below_;
  std::vector<std::unique_ptr<MotionCue>> cues_;
};

}  // namespace stillmap
