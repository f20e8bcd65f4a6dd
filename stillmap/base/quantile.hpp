// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>

namespace stillmap {

/// Returns the q-quantile (q from 0 to 1) of values in any order, interpolated linearly between the
/// two nearest; 0 for none. Linear time.
double quantile(std::span<const double> values, double q);

}  // namespace stillmap
