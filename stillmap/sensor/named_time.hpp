// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

namespace stillmap {

/// Returns the time in the name of an image without extension [s]: seconds with a decimal point;
/// seconds, milli-, micro- or nanoseconds, according to the number of digits; a date; the time
/// after the number in names of Open3D; or a frame number divided by `fps`. None if the name
/// contains no number.
std::optional<double> named_time(std::string name, double fps);

/// Returns the frame number in the name of an image; none if the name contains a time or no number.
std::optional<double> named_number(const std::string& name);

}  // namespace stillmap
