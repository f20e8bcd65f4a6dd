// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// Content of a preset, and the name of its file for messages.
struct PresetFile {
  std::string text, source;
};

/// Returns a preset by its name, or by its file (a name with a slash or with the extension .yaml).
/// The folder that the environment variable STILLMAP_PRESETS names takes precedence over the
/// built-in presets. Throws Error naming the nearest known preset.
PresetFile find_preset_file(const std::string& name_or_file);

/// A built-in preset. It is compiled in from the folder presets, so that the library needs no files
/// at run time and never reads those of another version.
struct ShippedPreset {
  std::string_view name, text;
};

/// Returns the built-in presets in alphabetical order.
const std::vector<ShippedPreset>& shipped_presets();

}  // namespace stillmap
