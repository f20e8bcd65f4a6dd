// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <filesystem>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <yaml-cpp/yaml.h>

namespace stillmap {

/// Accepted names of one value, ours or the usual one first.
using Keys = std::vector<std::string>;

/// The values of a camera file (YAML, JSON, or XML of OpenCV) by their keys. Nested keys are joined
/// by a point: Camera.fx. All functions throw Error with file, key and fix if the value is of
/// another type.
class CameraValues {
 public:
  /// Throws Error if the file cannot be read or has another format.
  explicit CameraValues(const std::filesystem::path& file);

  /// Returns the keys of the top level.
  const Keys& keys() const { return keys_; }
  const std::filesystem::path& file() const { return file_; }
  std::string where(const std::string& key) const;

  /// Returns the first of these keys that the file has.
  std::optional<std::string> find(const Keys& names) const;
  bool has(const Keys& names) const { return find(names).has_value(); }
  /// Returns the top-level key that is one of these names, ignoring case and underscores. Names are
  /// given in lower case without underscores: cameramatrix finds camera_matrix and cameraMatrix.
  std::optional<std::string> find_alike(const Keys& names) const;

  std::string text(const std::string& key) const;
  double number(const Keys& names) const;
  double number_or(const Keys& names, double otherwise) const;
  int whole(const Keys& names) const;
  std::vector<double> numbers(const std::string& key) const;
  /// Returns the numbers of `key`, of its subkey `data` (matrices of ROS and OpenCV), or of its
  /// rows.
  /// @param size  expected number of numbers; 0: any
  std::vector<double> matrix(const std::string& key, std::size_t size) const;

 private:
  void add(const std::string& prefix, const YAML::Node& map, int levels);
  const YAML::Node& at(const std::string& key) const;
  double to_number(const YAML::Node& node, const std::string& key) const;
  void append_numbers(const YAML::Node& node, const std::string& key,
                      std::vector<double>& numbers) const;

  std::filesystem::path file_;
  Keys keys_;
  std::vector<std::pair<std::string, YAML::Node>> values_;  // of all levels
};

/// Returns the text of a camera file as UTF-8. Throws Error if it cannot be read, is too large, or
/// is not text.
std::string camera_text(const std::filesystem::path& file);

/// Fix for files that are no camera files.
inline constexpr const char* kCameraFix =
    "give a camera file with width, height, fx, fy, cx, cy, depth_factor, or a preset's name";

}  // namespace stillmap
