// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/features.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace stillmap {

/// Index that means no keypoint.
inline constexpr std::uint32_t kNoMatch = std::numeric_limits<std::uint32_t>::max();

/// The two nearest descriptors of a set; ties in favor of the first.
struct NearestTwo {
  std::uint32_t best = kNoMatch,
                second = kNoMatch;  ///< Indices; kNoMatch if the set is too small.
  /// Hamming distances [bits]; 257 if there is none.
  int best_distance = 257, second_distance = 257;
};

/// Returns the two nearest to `query` among descriptors[i] for i in `candidates`.
NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> descriptors,
                       std::span<const std::uint32_t> candidates, CpuPath path = best_cpu_path());

/// Returns the two nearest to `query` among all of `descriptors`.
NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> descriptors,
                       CpuPath path = best_cpu_path());

/// A match; a and b are indices into the two matched sets.
struct DescriptorMatch {
  std::uint32_t a = kNoMatch, b = kNoMatch;
  int distance = 257;  ///< Hamming
  bool operator==(const DescriptorMatch&) const = default;
};

struct BruteForceMatchOptions {
  int max_distance = 100;  ///< Hamming, inclusive
  /// The best distance must be < ratio * second best (Lowe 2004); 1 or more disables the test.
  double ratio = 0.8;
  bool cross_check = true;  ///< Whether a must also be the best match of b.
};

/// Returns for each a its nearest b that passes the tests, ordered by a. Without cross_check one b
/// may match several a. Ties in favor of the lower index.
std::vector<DescriptorMatch> match_brute_force(std::span<const Descriptor> a,
                                               std::span<const Descriptor> b,
                                               const BruteForceMatchOptions& options = {},
                                               CpuPath path = best_cpu_path());

/// Keeps the matches whose change of angle, keypoints_b[b].angle - keypoints_a[a].angle, lies in
/// one of the three fullest of 30 bins of 12 degrees; ties in favor of the lower bin. A bin with
/// less than a tenth of the fullest bin's matches is never kept. Preserves the order.
std::vector<DescriptorMatch> keep_consistent_rotations(std::span<const DescriptorMatch> matches,
                                                       std::span<const Keypoint> keypoints_a,
                                                       std::span<const Keypoint> keypoints_b);

/// Search for a descriptor near (u, v) at some pyramid levels.
struct ProjectionQuery {
  float u = 0, v = 0;                ///< Predicted position [pixels].
  float radius = 0;                  ///< Half the side of the search square [pixels].
  int min_level = 0, max_level = 0;  ///< Pyramid levels, both inclusive.
  Descriptor descriptor{};
  /// Angle of the descriptor [rad]; NaN: unknown, excluded from the rotation check.
  float angle = std::numeric_limits<float>::quiet_NaN();
};

struct ProjectionMatchOptions {
  int max_distance = 100;  ///< Hamming, inclusive
  double ratio = 1;  ///< Ratio test bound: see match_by_projection(); 1 or more disables the test.
  bool check_rotation = false;  ///< Whether matches with a rare change of angle are rejected.
};

/// Returns one result per query, in order: the index of a keypoint or nothing.
///
/// 1. Candidates are the keypoints with |du| <= radius, |dv| <= radius and min_level <= level <=
///    max_level that are not in `taken`. The two nearest by Hamming distance are found; ties in
/// favor
///    of the lower keypoint index.
/// 2. The best is rejected if its distance exceeds max_distance, or if the second best is at the
///    same level and best >= ratio * second best. (At another level the second best is usually the
///    same corner.)
/// 3. A keypoint that several queries select goes to the one with the smallest distance, the first
/// of
///    equals; the others get no match.
/// 4. With check_rotation, matches whose query has an angle are rejected if their change of angle
/// is
///    not dominant (see keep_consistent_rotations()). Their keypoints are not reassigned.
///
/// @param taken  empty, or one value per keypoint: nonzero keypoints are no candidates
/// A query whose position or radius is not finite gets no match.
std::vector<std::optional<std::uint32_t>> match_by_projection(
    std::span<const ProjectionQuery> queries, const Features& features,
    const ProjectionMatchOptions& options = {}, std::span<const std::uint8_t> taken = {},
    CpuPath path = best_cpu_path());

}  // namespace stillmap
