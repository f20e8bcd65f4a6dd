// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace stillmap {

/// Pairs two lists of time stamps by the rule of the TUM RGB-D benchmark (Sturm et al., IROS 2012,
/// and the benchmark's own tools): candidates are all (a, b) with |a - b| < max_difference,
/// strictly; they are taken by growing difference, ties by smaller a, then smaller b (then by place
/// in the list), and each stamp is used once.
///
/// @param a, b           seconds, in any order; stamps that are not finite are never paired
/// @param max_difference seconds
/// @return indices into (a, b), by growing stamp of a. O(n log n + candidates).
std::vector<std::pair<std::size_t, std::size_t>> associate(std::span<const double> a,
                                                           std::span<const double> b,
                                                           double max_difference = 0.02);

}  // namespace stillmap
