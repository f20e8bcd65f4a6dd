// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/config/option_table.hpp"

#include <optional>
#include <string>
#include <type_traits>
#include <vector>

/// Options as text: the name of each type, its range, and the values that it accepts.
namespace stillmap {

template <typename T>
constexpr bool is_text = std::is_same_v<T, std::string>;
template <typename T>
constexpr bool is_list = std::is_same_v<T, std::vector<std::string>>;
template <typename T>
constexpr bool is_number = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;

/// Returns the name of an option's type in messages and documentation.
template <typename T>
constexpr const char* type_name() {
  if constexpr (std::is_same_v<T, bool>) return "true or false";
  if constexpr (std::is_same_v<T, int>) return "whole number";
  if constexpr (std::is_same_v<T, double>) return "number";
  if constexpr (is_text<T>) return "text";
  return "list";
}

/// Returns the values that a number, text or list may have, "50 to 10000" or "lockstep, realtime";
/// empty if all are allowed.
std::string range_text(const OptionInfo& info);

/// Returns the reason why an option may not have a value: "option features.keypoints is 5: it must
/// be from 50 to 10000"; none if it may.
std::optional<std::string> range_problem(const OptionInfo& info, bool value);
std::optional<std::string> range_problem(const OptionInfo& info, int value);
std::optional<std::string> range_problem(const OptionInfo& info, double value);
std::optional<std::string> range_problem(const OptionInfo& info, const std::string& value);
std::optional<std::string> range_problem(const OptionInfo& info,
                                         const std::vector<std::string>& value);

/// Returns the fix of that problem.
std::string range_advice(const OptionInfo& info);

/// Returns a value as YAML that is read back without loss; a list is on one line.
std::string value_text(bool value);
std::string value_text(int value);
std::string value_text(double value);
std::string value_text(const std::string& value);
std::string value_text(const std::vector<std::string>& value);

}  // namespace stillmap
