// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/matching.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numbers>
#include <optional>

namespace stillmap {
namespace {

/// Calls index(0) ... index(count - 1) for the descriptors to compare, in order.
template <typename Index>
STILLMAP_KERNEL NearestTwo nearest_two_of(const Descriptor& query, const Descriptor* descriptors,
                                          std::size_t count, Index&& index) {
  NearestTwo two;
  for (std::size_t i = 0; i < count; ++i) {
    const std::uint32_t k = index(i);
    const Descriptor& d = descriptors[k];
    const int bits = __builtin_popcountll(query[0] ^ d[0]) + __builtin_popcountll(query[1] ^ d[1]) +
                     __builtin_popcountll(query[2] ^ d[2]) + __builtin_popcountll(query[3] ^ d[3]);
    if (bits >= two.second_distance) continue;
    if (bits < two.best_distance) {
      two.second = two.best;
      two.second_distance = two.best_distance;
      two.best = k;
      two.best_distance = bits;
    } else {
      two.second = k;
      two.second_distance = bits;
    }
  }
  return two;
}

NearestTwo among_portable(const Descriptor& query, const Descriptor* descriptors,
                          std::span<const std::uint32_t> candidates) {
  return nearest_two_of(query, descriptors, candidates.size(),
                        [&](std::size_t i) STILLMAP_ALWAYS_INLINE { return candidates[i]; });
}
STILLMAP_TARGET_AVX2 NearestTwo among_avx2(const Descriptor& query, const Descriptor* descriptors,
                                           std::span<const std::uint32_t> candidates) {
  return nearest_two_of(query, descriptors, candidates.size(),
                        [&](std::size_t i) STILLMAP_ALWAYS_INLINE { return candidates[i]; });
}
NearestTwo all_portable(const Descriptor& query, std::span<const Descriptor> descriptors) {
  return nearest_two_of(query, descriptors.data(), descriptors.size(),
                        [](std::size_t i)
                            STILLMAP_ALWAYS_INLINE { return static_cast<std::uint32_t>(i); });
}
STILLMAP_TARGET_AVX2 NearestTwo all_avx2(const Descriptor& query,
                                         std::span<const Descriptor> descriptors) {
  return nearest_two_of(query, descriptors.data(), descriptors.size(),
                        [](std::size_t i)
                            STILLMAP_ALWAYS_INLINE { return static_cast<std::uint32_t>(i); });
}

bool ambiguous(const NearestTwo& two, double ratio) {
  return ratio < 1 && two.second != kNoMatch && two.best_distance >= ratio * two.second_distance;
}

/// Histogram of angles with 30 bins, of which the three fullest are used.
class RotationHistogram {
 public:
  static int bin_of(float change) {
    const float turns = change / (2 * std::numbers::pi_v<float>);
    const int bin = static_cast<int>((turns - std::floor(turns)) * kBins);
    return std::min(bin, kBins - 1);
  }
  void add(int bin) { ++counts_[bin]; }

  /// Returns whether a bin is dominant.
  std::array<bool, 30> dominant() const {
    std::array<int, kBins> order{};
    for (int i = 0; i < kBins; ++i) order[i] = i;
    std::stable_sort(order.begin(), order.end(),
                     [&](int a, int b) { return counts_[a] > counts_[b]; });
    std::array<bool, kBins> kept{};
    for (int i = 0; i < 3; ++i) kept[order[i]] = 10 * counts_[order[i]] >= counts_[order[0]];
    return kept;
  }

 private:
  static constexpr int kBins = 30;
  std::array<int, kBins> counts_{};
};

/// The keypoint that a query selects.
struct Candidate {
  std::uint32_t keypoint = kNoMatch;
  int distance = 257;
  explicit operator bool() const { return keypoint != kNoMatch; }
};

/// Returns the keypoint that each query selects, before conflicts are resolved.
class CandidateSearch {
 public:
  CandidateSearch(const Features& features, const ProjectionMatchOptions& options,
                  std::span<const std::uint8_t> taken, CpuPath path)
      : features_(features), options_(options), taken_(taken), path_(path) {}

  Candidate operator()(const ProjectionQuery& q) {
    if (!std::isfinite(q.u + q.v + q.radius)) return {};
    near_.clear();
    features_.grid.for_each_near(q.u, q.v, q.radius, q.min_level, q.max_level,
                                 [&](std::uint32_t i) {
                                   if (taken_.empty() || taken_[i] == 0) near_.push_back(i);
                                 });
    std::sort(near_.begin(), near_.end());
    const NearestTwo two = nearest_two(q.descriptor, features_.descriptors, near_, path_);
    if (two.best == kNoMatch || two.best_distance > options_.max_distance) return {};
    if (same_level(two) && ambiguous(two, options_.ratio)) return {};
    return {two.best, two.best_distance};
  }

 private:
  bool same_level(const NearestTwo& two) const {
    return two.second != kNoMatch &&
           features_.keypoints[two.best].level == features_.keypoints[two.second].level;
  }

  const Features& features_;
  const ProjectionMatchOptions& options_;
  std::span<const std::uint8_t> taken_;
  CpuPath path_;
  std::vector<std::uint32_t> near_;
};

/// Keeps each keypoint for its nearest query only.
void resolve_conflicts(std::vector<Candidate>& outputs, std::size_t keypoints) {
  constexpr std::size_t kNobody = std::numeric_limits<std::size_t>::max();
  std::vector<std::size_t> owner(keypoints, kNobody);
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (!outputs[i]) continue;
    std::size_t& holder = owner[outputs[i].keypoint];
    if (holder != kNobody && outputs[holder].distance <= outputs[i].distance) {
      outputs[i] = {};
      continue;
    }
    if (holder != kNobody) outputs[holder] = {};
    holder = i;
  }
}

void refuse_odd_rotations(std::span<const ProjectionQuery> queries, const Features& features,
                          std::vector<Candidate>& outputs) {
  const auto bin_of = [&](std::size_t i) -> std::optional<int> {
    if (!outputs[i] || !std::isfinite(queries[i].angle)) return std::nullopt;
    return RotationHistogram::bin_of(features.keypoints[outputs[i].keypoint].angle -
                                     queries[i].angle);
  };
  RotationHistogram histogram;
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (const auto bin = bin_of(i)) histogram.add(*bin);
  }
  const auto dominant = histogram.dominant();
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (const auto bin = bin_of(i); bin && !dominant[*bin]) outputs[i] = {};
  }
}

}  // namespace

NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> descriptors,
                       std::span<const std::uint32_t> candidates, CpuPath path) {
  return path == CpuPath::kAvx2 ? among_avx2(query, descriptors.data(), candidates)
                                : among_portable(query, descriptors.data(), candidates);
}

NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> descriptors,
                       CpuPath path) {
  return path == CpuPath::kAvx2 ? all_avx2(query, descriptors) : all_portable(query, descriptors);
}

std::vector<DescriptorMatch> match_brute_force(std::span<const Descriptor> a,
                                               std::span<const Descriptor> b,
                                               const BruteForceMatchOptions& options,
                                               CpuPath path) {
  std::vector<std::uint32_t> back(options.cross_check ? b.size() : 0, kNoMatch);
  const auto best_for = [&](std::uint32_t j) {  // Best a of b, computed on first use.
    if (back[j] == kNoMatch) back[j] = nearest_two(b[j], a, path).best;
    return back[j];
  };
  std::vector<DescriptorMatch> matches;
  for (std::uint32_t i = 0; i < a.size(); ++i) {
    const NearestTwo two = nearest_two(a[i], b, path);
    if (two.best == kNoMatch || two.best_distance > options.max_distance) continue;
    if (ambiguous(two, options.ratio)) continue;
    if (options.cross_check && best_for(two.best) != i) continue;
    matches.push_back({i, two.best, two.best_distance});
  }
  return matches;
}

std::vector<DescriptorMatch> keep_consistent_rotations(std::span<const DescriptorMatch> matches,
                                                       std::span<const Keypoint> keypoints_a,
                                                       std::span<const Keypoint> keypoints_b) {
  const auto bin_of = [&](const DescriptorMatch& m) {
    return RotationHistogram::bin_of(keypoints_b[m.b].angle - keypoints_a[m.a].angle);
  };
  RotationHistogram histogram;
  for (const DescriptorMatch& m : matches) histogram.add(bin_of(m));
  const auto dominant = histogram.dominant();
  std::vector<DescriptorMatch> kept;
  std::copy_if(matches.begin(), matches.end(), std::back_inserter(kept),
               [&](const DescriptorMatch& m) { return dominant[bin_of(m)]; });
  return kept;
}

std::vector<std::optional<std::uint32_t>> match_by_projection(
    std::span<const ProjectionQuery> queries, const Features& features,
    const ProjectionMatchOptions& options, std::span<const std::uint8_t> taken, CpuPath path) {
  CandidateSearch search(features, options, taken, path);
  std::vector<Candidate> outputs;
  outputs.reserve(queries.size());
  for (const ProjectionQuery& q : queries) outputs.push_back(search(q));
  resolve_conflicts(outputs, features.size());
  if (options.check_rotation) refuse_odd_rotations(queries, features, outputs);

  std::vector<std::optional<std::uint32_t>> matches(queries.size());
  for (std::size_t i = 0; i < outputs.size(); ++i) {
    if (outputs[i]) matches[i] = outputs[i].keypoint;
  }
  return matches;
}

}  // namespace stillmap
