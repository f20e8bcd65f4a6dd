// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

namespace stillmap {

/// Returns the unit of timestamps that count from 1970 [s]: 1, 1e-3, 1e-6 or 1e-9, the one with
/// which they are of the years 2001 to 2100 and at most a minute apart (median); 1 if there is
/// none, such as for stamps that count from the start of a recording.
/// @param stamps  in any order; those that are not finite are ignored
double unit_of_stamps(std::span<const double> stamps);

}  // namespace stillmap
