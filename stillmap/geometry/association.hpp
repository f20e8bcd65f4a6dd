// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <utility>
#include <vector>

namespace stillmap {

/// Associates two lists of timestamps by the rule of the TUM RGB-D benchmark (Sturm et al., IROS
/// 2012, and its tools): candidates are all (a, b) with |a - b| < max_difference, strictly; they
/// are selected by increasing difference, ties by smaller a, then smaller b (then by list
/// position), and each timestamp is used once.
///
/// @param a, b            timestamps [s], in any order; those that are not finite are never paired
/// @param max_difference  maximum difference [s]
/// @return indices into (a, b), by increasing timestamp of a; O(n log n + candidates)
std::vector<std::pair<std::size_t, std::size_t>> associate(std::span<const double> a,
                                                           std::span<const double> b,
                                                           double max_difference = 0.02);

}  // namespace stillmap
