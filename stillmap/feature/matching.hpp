// SPDX-License-Identifier: Apache-2.0

#pragma once
#include "stillmap/feature/features.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace stillmap {

struct ProjectionQuery {
  float u = 0, v = 0, radius = 0;
  int min_level = 0, max_level = 7;
  Descriptor descriptor{};
  float angle = std::numeric_limits<float>::quiet_NaN();
};
struct ProjectionMatchOptions {
  int max_distance = 100;
  double ratio = 1.0;
  bool check_rotation = false;
};
std::vector<std::optional<std::uint32_t>> match_by_projection(
    std::span<const ProjectionQuery> queries, const Features& features,
    const ProjectionMatchOptions& options);
struct BruteForceMatchOptions {
  int max_distance = 100;
  double ratio = 0.8;
  bool cross_check = true;
};
struct IndexPair {
  std::uint32_t a, b;
};
std::vector<IndexPair> match_brute_force(std::span<const Descriptor> a,
                                         std::span<const Descriptor> b,
                                         const BruteForceMatchOptions& options);

}  // namespace stillmap
