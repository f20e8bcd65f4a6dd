// SPDX-License-Identifier: Apache-2.0
#include "stillmap/config/preset_files.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/options.hpp"

#include <cstdlib>
#include <map>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

constexpr const char* kPresetFolder = "STILLMAP_PRESETS";
constexpr const char* kExtension = ".yaml";

/// The user's own presets by name.
std::map<std::string, fs::path> own_presets() {
  std::map<std::string, fs::path> files;
  const char* folder = std::getenv(kPresetFolder);
  if (folder == nullptr || *folder == '\0') return files;
  if (!fs::is_directory(folder)) {
    throw Error("is no folder", std::string(kPresetFolder) + "=" + folder,
                "name a folder of presets (*.yaml), or unset the variable");
  }
  for (const auto& entry : fs::directory_iterator(folder)) {
    if (entry.path().extension() == kExtension) files[entry.path().stem()] = entry.path();
  }
  return files;
}

/// The first line of a preset without its comment sign.
std::string description_of(const std::string& text) {
  const std::string line = text.substr(0, text.find('\n'));
  const auto first = line.find_first_not_of("# ");
  return line.starts_with('#') && first != std::string::npos ? line.substr(first) : "";
}

}  // namespace

std::vector<Preset> presets() {
  std::map<std::string, Preset> all;
  for (const ShippedPreset& preset : shipped_presets()) {
    const std::string name(preset.name), text(preset.text);
    all[name] = {name, description_of(text), text};
  }
  for (const auto& [name, file] : own_presets()) {
    const std::string text = read_file(file);
    all[name] = {name, description_of(text), text};
  }
  std::vector<Preset> listed;
  for (const auto& [name, preset] : all) listed.push_back(preset);
  return listed;
}

PresetFile find_preset_file(const std::string& name_or_file) {
  const fs::path path(name_or_file);
  if (path.has_parent_path() || path.extension() == kExtension) {
    return {read_file(path), name_or_file};
  }
  const auto own = own_presets();
  if (const auto found = own.find(name_or_file); found != own.end()) {
    return {read_file(found->second), found->second.string()};
  }
  std::vector<std::string> names;
  for (const ShippedPreset& preset : shipped_presets()) {
    if (preset.name == name_or_file) return {std::string(preset.text), name_or_file + kExtension};
    names.emplace_back(preset.name);
  }
  for (const auto& [name, file] : own) names.push_back(name);
  throw Error("there is no preset of this name", "preset '" + name_or_file + "'",
              suggestion(name_or_file, names));
}

}  // namespace stillmap
