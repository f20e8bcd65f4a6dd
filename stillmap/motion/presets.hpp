// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/motion_cue.hpp"

#include <memory>
#include <string>
#include <vector>

namespace stillmap {

struct MotionOptions;

/// A named list of cues.
struct Preset {
  std::string name;
  std::string description;       ///< one line
  bool wants_instances = false;  ///< whether a network or a folder of masks is of use to it
  std::string detector = {};     ///< which one it is meant for, in words
};

/// The presets there are, in the order they are listed to the user.
const std::vector<Preset>& presets();

/// One line for each of presets(): name, description, detector.
std::string describe_presets();

/// The preset of that name. Throws Error naming the nearest known one.
const Preset& find_preset(const std::string& name);

using MotionCues = std::vector<std::unique_ptr<MotionCue>>;

/// The cues of options.preset, made with their options, in the order they are asked. Throws Error
/// for an unknown preset.
MotionCues make_cues(const MotionOptions& options);

}  // namespace stillmap
