// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

#include <yaml-cpp/yaml.h>

namespace stillmap {

/// Returns whether a text is XML of OpenCV's FileStorage: its root is <opencv_storage>.
bool is_opencv_xml(const std::string& text);

/// Converts the elements below the root to YAML: named elements to a map, elements named "_" to a
/// list, and texts without quotation marks. A matrix is a map with its numbers as the text of
/// `data`. Throws Error that names the file for elements that do not end or are nested too deeply.
YAML::Node parse_opencv_xml(const std::string& text, const std::filesystem::path& file);

}  // namespace stillmap
