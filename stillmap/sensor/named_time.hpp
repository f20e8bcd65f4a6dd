// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>

namespace stillmap {

/// Returns the time that the name of an image without extension tells [s]: seconds with a decimal
/// point, seconds, milli-, micro- or nanoseconds by the number of their digits, a date, the time
/// behind the number as Open3D names images; or the number of a frame, divided by `fps`. None if
/// the name contains no number.
std::optional<double> named_time(std::string name, double fps);

/// Returns the number of the frame that the name of an image tells; none if it tells a time, or
/// nothing.
std::optional<double> named_number(const std::string& name);

}  // namespace stillmap
