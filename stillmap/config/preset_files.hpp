// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// The text of a preset, and its file's name for messages.
struct PresetFile {
  std::string text, source;
};

/// A preset by its name, or by its file (a name with a slash or with the extension .yaml). The
/// folder that the environment variable STILLMAP_PRESETS names comes before the presets that come
/// with the program. Throws Error naming the nearest known preset.
PresetFile find_preset_file(const std::string& name_or_file);

/// A preset that comes with the program. It is compiled in from the folder presets, so that
/// the library needs no files at run time, and a program never meets presets of another version.
struct ShippedPreset {
  std::string_view name, text;
};

/// In alphabetical order.
const std::vector<ShippedPreset>& shipped_presets();

}  // namespace stillmap
