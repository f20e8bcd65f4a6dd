// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/association.hpp"

#include <algorithm>
#include <cmath>
#include <tuple>

namespace stillmap {
namespace {

using Pair = std::pair<std::size_t, std::size_t>;

struct Candidate {
  double difference;  // seconds
  double stamp_a, stamp_b;
  Pair indices;

  auto key() const { return std::tie(difference, stamp_a, stamp_b, indices); }
  bool operator<(const Candidate& other) const { return key() < other.key(); }
};

std::vector<std::size_t> finite_by_stamp(std::span<const double> stamps) {
  std::vector<std::size_t> order;
  order.reserve(stamps.size());
  for (std::size_t i = 0; i < stamps.size(); ++i) {
    if (std::isfinite(stamps[i])) order.push_back(i);
  }
  std::stable_sort(order.begin(), order.end(),
                   [&](std::size_t i, std::size_t j) { return stamps[i] < stamps[j]; });
  return order;
}

std::vector<Candidate> candidates_of(std::span<const double> a, std::span<const double> b,
                                     double max_difference) {
  const auto order_a = finite_by_stamp(a), order_b = finite_by_stamp(b);
  std::vector<Candidate> candidates;
  candidates.reserve(order_a.size());
  // First b that is late enough for this a, and therefore for all later ones.
  std::size_t first = 0;
  for (const std::size_t i : order_a) {
    while (first < order_b.size() && a[i] - b[order_b[first]] >= max_difference) ++first;
    for (std::size_t k = first; k < order_b.size(); ++k) {
      const std::size_t j = order_b[k];
      const double difference = std::abs(a[i] - b[j]);
      if (difference >= max_difference) break;
      candidates.push_back({difference, a[i], b[j], {i, j}});
    }
  }
  return candidates;
}

}  // namespace

std::vector<Pair> associate(std::span<const double> a, std::span<const double> b,
                            double max_difference) {
  std::vector<Candidate> candidates = candidates_of(a, b, max_difference);
  std::sort(candidates.begin(), candidates.end());
  std::vector<bool> used_a(a.size()), used_b(b.size());
  std::vector<Candidate> taken;
  for (const Candidate& candidate : candidates) {
    const auto [i, j] = candidate.indices;
    if (used_a[i] || used_b[j]) continue;
    used_a[i] = used_b[j] = true;
    taken.push_back(candidate);
  }
  std::sort(taken.begin(), taken.end(), [](const Candidate& x, const Candidate& y) {
    return std::tie(x.stamp_a, x.indices) < std::tie(y.stamp_a, y.indices);
  });
  std::vector<Pair> pairs;
  pairs.reserve(taken.size());
  for (const Candidate& candidate : taken) pairs.push_back(candidate.indices);
  return pairs;
}

}  // namespace stillmap
