// SPDX-License-Identifier: Apache-2.0

#include "stillmap/feature/matching.hpp"
namespace stillmap {
std::vector<std::optional<std::uint32_t>> match_by_projection(
    std::span<const ProjectionQuery> queries, const Features& features,
    const ProjectionMatchOptions& options) {
  std::vector<std::optional<std::uint32_t>> result(queries.size());
  std::vector<int> owner(features.size(), -1), owner_distance(features.size(), 257);
  for (std::size_t q = 0; q < queries.size(); ++q) {
    const auto& query = queries[q];
    int best = 257, second = 257, best_level = -1, second_level = -2;
    std::uint32_t best_i = 0;
    features.grid.for_each_near(query.u, query.v, query.radius, query.min_level, query.max_level,
                                [&](std::uint32_t i) {
                                  const int d = distance(query.descriptor, features.descriptors[i]);
                                  const int level = features.keypoints[i].level;
                                  if (d < best) {
                                    second = best;
                                    second_level = best_level;
                                    best = d;
                                    best_level = level;
                                    best_i = i;
                                  } else if (d < second) {
                                    second = d;
                                    second_level = level;
                                  }
                                });
    if (best > options.max_distance) continue;
    if (best_level == second_level && best > options.ratio * second) continue;
    if (best >= owner_distance[best_i]) continue;
    if (owner[best_i] >= 0) result[owner[best_i]].reset();
    owner[best_i] = static_cast<int>(q);
    owner_distance[best_i] = best;
    result[q] = best_i;
  }
  if (options.check_rotation) {
    std::vector<int> histogram(30, 0);
    const auto bin = [&](std::size_t q) {
      float d = queries[q].angle - features.keypoints[*result[q]].angle;
      const float turn = 6.2831853f;
      d -= turn * std::floor(d / turn);
      return std::min(29, static_cast<int>(d / turn * 30));
    };
    for (std::size_t q = 0; q < queries.size(); ++q)
      if (result[q] && std::isfinite(queries[q].angle)) ++histogram[bin(q)];
    std::vector<int> order(30);
    for (int i = 0; i < 30; ++i) order[i] = i;
    std::sort(order.begin(), order.end(), [&](int a, int b) {
      return histogram[a] != histogram[b] ? histogram[a] > histogram[b] : a < b;
    });
    for (std::size_t q = 0; q < queries.size(); ++q) {
      if (!result[q] || !std::isfinite(queries[q].angle)) continue;
      const int b = bin(q);
      if (b != order[0] && b != order[1] && b != order[2]) result[q].reset();
    }
  }
  return result;
}
std::vector<IndexPair> match_brute_force(std::span<const Descriptor> a,
                                         std::span<const Descriptor> b,
                                         const BruteForceMatchOptions& options) {
  const auto nearest = [&](const Descriptor& x, std::span<const Descriptor> in) {
    int best = 257, second = 257;
    std::uint32_t bi = 0;
    for (std::uint32_t i = 0; i < in.size(); ++i) {
      const int d = distance(x, in[i]);
      if (d < best) {
        second = best;
        best = d;
        bi = i;
      } else if (d < second)
        second = d;
    }
    return std::tuple(bi, best, second);
  };
  std::vector<IndexPair> result;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    const auto [j, best, second] = nearest(a[i], b);
    if (best > options.max_distance || best > options.ratio * second) continue;
    if (options.cross_check && std::get<0>(nearest(b[j], a)) != i) continue;
    result.push_back({i, j});
  }
  return result;
}
}  // namespace stillmap
