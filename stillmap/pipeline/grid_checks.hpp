// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/error.hpp"

#include <cmath>
#include <string>

#include <Eigen/Core>
#include <fmt/format.h>

namespace stillmap {

/// Throws Error unless a length is positive, or at least 0, and finite.
/// @param name  such as "the side of a cell"
inline void require_positive(double meters, const char* name, const char* where) {
  if (meters > 0 && std::isfinite(meters)) return;
  throw Error(fmt::format("{} is {} m", name, meters), where, "give a positive one");
}
inline void require_not_negative(double meters, const char* name, const char* where) {
  if (meters >= 0 && std::isfinite(meters)) return;
  throw Error(fmt::format("{} is {} m", name, meters), where, "give 0 or a positive one");
}

/// Throws Error for a grid of more cells than fit into the memory of a small computer.
/// @param sizes  of the grid [m]
template <typename Sizes>
void require_few_cells(const Sizes& sizes, double cell, const char* where) {
  constexpr double kMostCells = 1e8;
  if ((sizes / cell).prod() < kMostCells) return;
  std::string text = fmt::format("{:g}", sizes[0]);
  for (int axis = 1; axis < sizes.size(); ++axis) text += fmt::format(" x {:g}", sizes[axis]);
  throw Error(fmt::format("{} m have too many cells of {:g} m", text, cell), where,
              "give larger cells");
}

/// Throws Error if a position is not finite.
template <typename Positions>
void require_finite(const Positions& positions, const char* where) {
  for (const auto& p : positions)
    if (!p.allFinite()) throw Error("a position is not finite", where, "leave it out");
}

}  // namespace stillmap
