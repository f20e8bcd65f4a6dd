// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <algorithm>
#include <charconv>
#include <limits>
#include <optional>
#include <string_view>

namespace stillmap {

/// A number at the beginning of a text.
struct LeadingNumber {
  double value = 0;       ///< May be infinite or NaN ("inf", "nan"); infinite if out of range.
  std::string_view rest;  ///< The text after the number.
};

/// Returns the decimal number at the beginning of a text, after blanks; none if there is none.
/// Unlike std::strtod and streams, it ignores the locale: the decimal separator is a point.
inline std::optional<LeadingNumber> leading_number(std::string_view text) {
  text.remove_prefix(std::min(text.find_first_not_of(" \t"), text.size()));
  if (text.starts_with('+')) text.remove_prefix(1);
  double value = 0;
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error == std::errc::invalid_argument) return std::nullopt;
  if (error == std::errc::result_out_of_range) value = std::numeric_limits<double>::infinity();
  text.remove_prefix(static_cast<std::size_t>(end - text.data()));
  return LeadingNumber{value, text};
}

/// Returns the number if the whole text is one number; none otherwise.
inline std::optional<double> number_of(std::string_view text) {
  const auto number = leading_number(text);
  return number && number->rest.empty() ? std::optional(number->value) : std::nullopt;
}

}  // namespace stillmap
