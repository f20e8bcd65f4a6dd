// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_values.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/sensor/opencv_xml.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <cctype>
#include <cmath>
#include <set>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

/// Largest accepted file [bytes]: settings have a few thousand, a camera with its poses a million.
constexpr std::size_t kLargestFile = std::size_t{4} << 20;
/// Number of levels of keys that are read below the top level.
constexpr int kLevels = 2;

bool is_key_letter(char c) {
  return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == ' ';
}

// OpenCV accepts more than the YAML standard, and settings files rely on it: tabs, no blank after
// a colon, the header '%YAML:1.0' (kept as a comment, so that line numbers stay valid).
std::string as_standard_yaml(std::string text) {
  if (const auto at = text.find("%YAML"); at < 4) text[at] = '#';
  std::replace(text.begin(), text.end(), '\t', ' ');
  std::istringstream lines(text);
  std::string standard;
  for (std::string line; std::getline(lines, line); standard += line + '\n') {
    const auto key_ends = std::find_if_not(line.begin(), line.end(), is_key_letter);
    if (key_ends != line.end() && *key_ends == ':') line.insert(key_ends + 1, ' ');
  }
  return standard;
}

YAML::Node parse(const fs::path& file) {
  const std::string text = camera_text(file);
  if (is_opencv_xml(text)) return parse_opencv_xml(text, file);
  try {
    return YAML::Load(as_standard_yaml(text));
  } catch (const YAML::Exception& e) {
    const std::string line = e.mark.is_null() ? "" : fmt::format(":{}", e.mark.line + 1);
    throw Error("is not YAML: " + e.msg, file.string() + line, "write one 'key: value' a line");
  }
}

/// Returns a key in lower case and without underscores.
std::string plain(const std::string& key) {
  std::string plain;
  for (const char c : key) {
    if (c != '_') plain += static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  }
  return plain;
}

}  // namespace

std::string camera_text(const fs::path& file) {
  std::string text = as_utf8(read_file(file));
  if (text.size() > kLargestFile)
    throw Error("is too large for a camera", file.string(), kCameraFix);
  if (text.find('\0') != std::string::npos)
    throw Error("is not a camera file: it is not text", file.string(), kCameraFix);
  return text;
}

CameraValues::CameraValues(const fs::path& file) : file_(file) {
  const YAML::Node root = parse(file);
  if (!root.IsMap()) {
    throw Error("is not a camera file: expected lines like 'fx: 535.4'", file_.string(),
                kCameraFix);
  }
  std::set<std::string> seen;
  for (const auto& entry : root) {
    keys_.push_back(entry.first.as<std::string>(""));
    if (!seen.insert(keys_.back()).second)
      throw Error("is given twice", where(keys_.back()), "keep only the valid one");
  }
  add("", root, kLevels);
}

void CameraValues::add(const std::string& prefix, const YAML::Node& map, int levels) {
  for (const auto& entry : map) {
    const std::string key = prefix + entry.first.as<std::string>("");
    values_.emplace_back(key, entry.second);
    if (entry.second.IsMap() && levels > 0) add(key + '.', entry.second, levels - 1);
  }
}

std::string CameraValues::where(const std::string& key) const {
  return fmt::format("{}, key '{}'", file_.string(), printable(key));
}

std::optional<std::string> CameraValues::find(const Keys& names) const {
  for (const auto& name : names) {
    if (std::any_of(values_.begin(), values_.end(), [&](const auto& v) { return v.first == name; }))
      return name;
  }
  return std::nullopt;
}

std::optional<std::string> CameraValues::find_alike(const Keys& names) const {
  for (const auto& name : names) {
    const auto key = std::find_if(keys_.begin(), keys_.end(),
                                  [&](const std::string& each) { return plain(each) == name; });
    if (key != keys_.end()) return *key;
  }
  return std::nullopt;
}

const YAML::Node& CameraValues::at(const std::string& key) const {
  return std::find_if(values_.begin(), values_.end(), [&](const auto& v) { return v.first == key; })
      ->second;
}

std::string CameraValues::text(const std::string& key) const {
  const YAML::Node& node = at(key);
  if (!node.IsScalar()) throw Error("expected a name", where(key), "write it as one word");
  return node.Scalar();
}

double CameraValues::number(const Keys& names) const {
  const auto key = find(names);
  if (!key) {
    throw Error(fmt::format("the key '{}' is missing", names.front()), file_.string(),
                fmt::format("add a line '{}: VALUE'", fmt::join(names, ": VALUE' or '")));
  }
  return to_number(at(*key), *key);
}

double CameraValues::number_or(const Keys& names, double otherwise) const {
  const auto key = find(names);
  return key ? to_number(at(*key), *key) : otherwise;
}

int CameraValues::whole(const Keys& names) const {
  const double value = number(names);
  if (value != std::round(value) || std::abs(value) > 1e6) {
    throw Error(fmt::format("expected a whole number, found {}", value), where(*find(names)),
                "give the image size in pixels");
  }
  return static_cast<int>(value);
}

std::vector<double> CameraValues::numbers(const std::string& key) const {
  const YAML::Node& node = at(key);
  if (!node.IsSequence())
    throw Error("expected a list of numbers", where(key), "write it as [k1, k2, p1, p2, k3]");
  std::vector<double> values;
  for (const auto& item : node) values.push_back(to_number(item, key));
  return values;
}

std::vector<double> CameraValues::matrix(const std::string& key, std::size_t size) const {
  const YAML::Node& node = at(key);
  std::vector<double> values;
  append_numbers(node.IsMap() ? node["data"] : node, key, values);
  if (size > 0 && values.size() != size) {
    throw Error(fmt::format("expected {} numbers, found {}", size, values.size()), where(key),
                "write the file again with the program that made it");
  }
  return values;
}

/// Appends the numbers of a list, of a list of rows, or of a text (XML).
void CameraValues::append_numbers(const YAML::Node& node, const std::string& key,
                                  std::vector<double>& numbers) const {
  if (!node.IsDefined()) return;
  if (node.IsScalar()) {
    std::istringstream words(node.Scalar());
    for (std::string word; words >> word;) numbers.push_back(to_number(YAML::Node(word), key));
  } else if (node.IsSequence()) {
    for (const auto& item : node) {
      if (!item.IsSequence()) {
        numbers.push_back(to_number(item, key));
        continue;
      }
      for (const auto& number : item) numbers.push_back(to_number(number, key));
    }
  }
}

double CameraValues::to_number(const YAML::Node& node, const std::string& key) const {
  double value = 0;
  if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) {
    throw Error(
        fmt::format("expected a number, found {}",
                    node.IsScalar() ? "'" + printable(node.Scalar()) + "'" : "something else"),
        where(key), "write a decimal number");
  }
  if (!std::isfinite(value)) {
    throw Error(fmt::format("'{}' is not finite", printable(node.Scalar())), where(key),
                "write a number");
  }
  return value;
}

}  // namespace stillmap
