// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/features.hpp"

#include <cstdint>
#include <limits>
#include <optional>
#include <span>
#include <vector>

namespace stillmap {

/// No keypoint.
inline constexpr std::uint32_t kNoMatch = std::numeric_limits<std::uint32_t>::max();

/// The two nearest of a set of descriptors. Equal distances: the one that comes first in the set.
struct NearestTwo {
  std::uint32_t best = kNoMatch,
                second = kNoMatch;                 ///< indices; kNoMatch where the set is too small
  int best_distance = 257, second_distance = 257;  ///< Hamming; 257 where there is none
};

/// Nearest two to `query` among descriptors[i] for i in `candidates`.
NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> descriptors,
                       std::span<const std::uint32_t> candidates, CpuPath path = best_cpu_path());

/// Nearest two to `query` among all of `descriptors`.
NearestTwo nearest_two(const Descriptor& query, std::span<const Descriptor> descriptors,
                       CpuPath path = best_cpu_path());

/// a and b are indices into the two sets that were matched.
struct DescriptorMatch {
  std::uint32_t a = kNoMatch, b = kNoMatch;
  int distance = 257;  ///< Hamming
  bool operator==(const DescriptorMatch&) const = default;
};

struct BruteForceMatchOptions {
  int max_distance = 100;  ///< Hamming, inclusive
  double ratio = 0.8;  ///< best must be < ratio * second best (Lowe 2004); 1 or more: no ratio test
  bool cross_check = true;  ///< a's best is b, and b's best is a
  STILLMAP_FIELDS(max_distance, ratio, cross_check)
};

/// For each a its nearest b, where that passes the tests of the options. Ordered by a. Without
/// cross_check one b may serve several a. Ties go to the lower index.
std::vector<DescriptorMatch> match_brute_force(std::span<const Descriptor> a,
                                               std::span<const Descriptor> b,
                                               const BruteForceMatchOptions& options = {},
                                               CpuPath path = best_cpu_path());

/// Keeps the matches whose change of angle, keypoints_b[b].angle - keypoints_a[a].angle, falls into
/// one of the three fullest of 30 bins around the circle; of equal bins the lower. Order is kept.
/// The bins are 12 degrees; a bin with less than a tenth of the fullest one's matches is never
/// kept.
std::vector<DescriptorMatch> keep_consistent_rotations(std::span<const DescriptorMatch> matches,
                                                       std::span<const Keypoint> keypoints_a,
                                                       std::span<const Keypoint> keypoints_b);

/// "This descriptor should be seen near (u, v), on one of these levels."
struct ProjectionQuery {
  float u = 0, v = 0;                ///< predicted position [pixels]
  float radius = 0;                  ///< half side of the search square [pixels]
  int min_level = 0, max_level = 0;  ///< pyramid levels, both inclusive
  Descriptor descriptor{};
  /// Angle the descriptor was taken at [radians]; NaN: unknown, left out of the rotation check.
  float angle = std::numeric_limits<float>::quiet_NaN();
};

struct ProjectionMatchOptions {
  int max_distance = 100;       ///< Hamming, inclusive
  double ratio = 1;             ///< see match_by_projection; 1 or more: no ratio test
  bool check_rotation = false;  ///< refuse changes of angle that few others share
  STILLMAP_FIELDS(max_distance, ratio, check_rotation)
};

/// One answer per query, in their order: the index of a keypoint or none.
///
/// 1. Candidates are the keypoints with |du| <= radius, |dv| <= radius and min_level <= level <=
///    max_level that are not in `taken`. The two nearest by Hamming distance are found; of equal
///    distances the lower keypoint index comes first.
/// 2. The best is refused if its distance is above max_distance; or if the second best lies on the
///    same level and best >= ratio * second best. (On another level the second best usually is the
///    same corner again.)
/// 3. A keypoint wanted by several queries goes to the one with the smallest distance, of equals to
///    the first; the others get no match.
/// 4. With check_rotation, of the matches whose query has an angle those are refused whose change
///    of angle is not among the dominant ones (see keep_consistent_rotations). Their keypoints are
///    not handed out again.
///
/// @param taken  empty, or one value per keypoint: one that is not zero is no candidate
/// A query whose position or radius is not finite gets no match.
std::vector<std::optional<std::uint32_t>> match_by_projection(
    std::span<const ProjectionQuery> queries, const Features& features,
    const ProjectionMatchOptions& options = {}, std::span<const std::uint8_t> taken = {},
    CpuPath path = best_cpu_path());

}  // namespace stillmap
