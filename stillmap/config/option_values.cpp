// SPDX-License-Identifier: Apache-2.0
#include "stillmap/config/option_values.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

bool allowed(const OptionInfo& info, const std::string& word) {
  return info.words.empty() ||
         std::find(info.words.begin(), info.words.end(), word) != info.words.end();
}

bool is_numeric(const OptionInfo& info) { return info.range.lowest < info.range.highest; }

std::string refusal(const OptionInfo& info, const std::string& value, const std::string& rule) {
  const std::string unit = info.unit.empty() ? "" : " [" + info.unit + "]";
  return fmt::format("option {} is {}: it must be {}{}", info.path, value, rule, unit);
}

}  // namespace

std::string range_text(const OptionInfo& info) {
  if (is_numeric(info)) return fmt::format("{} to {}", info.range.lowest, info.range.highest);
  return fmt::format("{}", fmt::join(info.words, ", "));
}

std::optional<std::string> range_problem(const OptionInfo&, bool) { return std::nullopt; }

std::optional<std::string> range_problem(const OptionInfo& info, int value) {
  return range_problem(info, static_cast<double>(value));
}

std::optional<std::string> range_problem(const OptionInfo& info, double value) {
  if (value >= info.range.lowest && value <= info.range.highest) return std::nullopt;
  return refusal(info, fmt::format("{}", value), "from " + range_text(info));
}

std::optional<std::string> range_problem(const OptionInfo& info, const std::string& value) {
  if (allowed(info, value)) return std::nullopt;
  return refusal(info, "'" + value + "'", "one of " + range_text(info));
}

std::optional<std::string> range_problem(const OptionInfo& info,
                                         const std::vector<std::string>& value) {
  for (const std::string& word : value) {
    if (allowed(info, word)) continue;
    return fmt::format("option {} has the item '{}': each must be one of {}", info.path, word,
                       range_text(info));
  }
  return std::nullopt;
}

std::string range_advice(const OptionInfo& info) {
  return is_numeric(info) ? "give a value in this range" : "give one of these words";
}

std::string value_text(bool value) { return value ? "true" : "false"; }
std::string value_text(int value) { return std::to_string(value); }
std::string value_text(double value) { return fmt::format("{}", value); }

std::string value_text(const std::string& value) {
  YAML::Emitter out;
  out << value;
  return out.c_str();
}

std::string value_text(const std::vector<std::string>& value) {
  std::vector<std::string> items;
  for (const std::string& item : value) items.push_back(value_text(item));
  return fmt::format("[{}]", fmt::join(items, ", "));
}

}  // namespace stillmap
