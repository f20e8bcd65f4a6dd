// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/named_time.hpp"

#include "stillmap/base/number.hpp"

#include <chrono>
#include <cmath>
#include <regex>
#include <sstream>

namespace stillmap {
namespace {

std::optional<double> finite_number_of(const std::string& text) {
  const auto value = number_of(text);
  return value && std::isfinite(*value) ? value : std::nullopt;
}

/// Returns the seconds since 1970 of a name such as 2024-05-17_12-30-11.033, IMG_20240517_123011033
/// or 2024-05-17T12:30:11.033Z; the time zone is ignored.
std::optional<double> named_date(const std::string& name) {
  static const std::regex kDate(
      R"((?:^|\D)((?:19|20)\d\d)[-.]?(\d\d)[-.]?(\d\d)[-_T ](\d\d)[-:.]?(\d\d)[-:.]?(\d\d)[-_.,]?(\d*)Z?$)");
  std::smatch found;
  if (!std::regex_search(name, found, kDate)) return std::nullopt;
  const auto number = [&](std::size_t part) { return number_of(found[part].str()).value_or(0); };
  const std::chrono::year_month_day date{std::chrono::year(static_cast<int>(number(1))),
                                         std::chrono::month(static_cast<unsigned>(number(2))),
                                         std::chrono::day(static_cast<unsigned>(number(3)))};
  if (!date.ok() || number(4) >= 24 || number(5) >= 60 || number(6) > 60) return std::nullopt;
  const auto days = std::chrono::sys_days(date).time_since_epoch().count();
  const double fraction = number_of("0." + found[7].str() + "0").value_or(0);
  return ((days * 24 + number(4)) * 60 + number(5)) * 60 + number(6) + fraction;
}

/// Returns the number in a name with parts separated by underscores: the last one with a decimal
/// point, such as the time in VIDEO_6792.023, otherwise the first one, such as that in 000038_rgb;
/// the name itself if there is none.
std::string number_in(const std::string& name) {
  std::istringstream parts(name);
  std::string first = name, decimal;
  for (std::string part; std::getline(parts, part, '_');) {
    if (!number_of(part)) continue;
    if (first == name) first = part;
    if (part.find('.') != std::string::npos) decimal = part;
  }
  return decimal.empty() ? first : decimal;
}

}  // namespace

std::optional<double> named_time(std::string name, double fps) {
  if (const auto date = named_date(name)) return date;
  const auto digit = name.find_first_of("0123456789");
  if (digit == std::string::npos) return std::nullopt;
  name = number_in(name.substr(digit));
  // Number and time in microseconds, as Open3D's recorder names images: 0000012-000000400421.
  constexpr std::size_t kMicrosecondDigits = 12;
  if (const auto dash = name.find('-'); name.size() == dash + 1 + kMicrosecondDigits) {
    const auto time = finite_number_of(name.substr(dash + 1));
    return time ? std::optional(*time / 1e6) : std::nullopt;
  }
  const bool decimal = name.find('.') != std::string::npos;
  const auto number = finite_number_of(name);
  if (!number || decimal) return number;
  constexpr std::size_t kNanoseconds = 18, kMicroseconds = 15, kMilliseconds = 12, kSeconds = 9;
  if (name.size() > kNanoseconds) return *number / 1e9;  // digits of times since 2001
  if (name.size() > kMicroseconds) return *number / 1e6;
  if (name.size() > kMilliseconds) return *number / 1e3;
  if (name.size() > kSeconds) return number;
  return *number / fps;
}

std::optional<double> named_number(const std::string& name) {
  // Only the time of a frame number depends on the rate, except for number 0.
  const auto number = named_time(name, 1), half = named_time(name, 2);
  return number && (*number != *half || *number == 0) ? number : std::nullopt;
}

}  // namespace stillmap
