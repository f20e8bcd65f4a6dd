// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/repeated_landmarks.hpp"

#include "stillmap/map/visibility.hpp"

#include <algorithm>
#include <cmath>
#include <compare>
#include <optional>
#include <vector>

namespace stillmap {
namespace {

/// Maximum distance of the two projections [pixels at level 0].
constexpr double kRadius = 2.0;
/// Maximum difference of the two predicted disparities [pixels].
constexpr double kMaxDisparity = 1.0;
/// Maximum Hamming distance of the two descriptors [bits].
constexpr int kMaxDistance = 50;
/// Minimum cosine between the two mean viewing directions.
constexpr double kMinNormalCosine = 0.5;

bool sees(const Landmark& landmark, KeyframeId keyframe) {
  return std::any_of(landmark.observations.begin(), landmark.observations.end(),
                     [&](const Observation& o) { return o.keyframe == keyframe; });
}

bool seen_together(const Landmark& a, const Landmark& b) {
  return std::any_of(a.observations.begin(), a.observations.end(),
                     [&](const Observation& o) { return sees(b, o.keyframe); });
}

// Removal by node.

struct NodeLandmark {
  std::uint32_t node = 0;
  LandmarkId id;
  auto operator<=>(const NodeLandmark&) const = default;
};

/// Returns the local landmarks that the keyframe does not observe, by node.
std::vector<NodeLandmark> others_by_node(const Map& map, KeyframeId keyframe,
                                         std::span<const LandmarkId> local,
                                         const Vocabulary& vocabulary) {
  std::vector<NodeLandmark> others;
  for (const LandmarkId id : local) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr || sees(*landmark, keyframe)) continue;
    others.push_back({vocabulary.node(landmark->descriptor, kDirectIndexLevel), id});
  }
  std::sort(others.begin(), others.end());
  return others;
}

struct Resembling {
  LandmarkId id;
  int distance = 0;  ///< Hamming distance [bits].
};

/// Returns the nearest of the other landmarks in the descriptor's node; nothing if the node is
/// empty.
std::optional<Resembling> nearest_in_node(const Map& map, const Descriptor& descriptor,
                                          const std::vector<NodeLandmark>& others,
                                          const Vocabulary& vocabulary) {
  const auto in_node =
      std::ranges::equal_range(others, vocabulary.node(descriptor, kDirectIndexLevel),
                               std::ranges::less(), &NodeLandmark::node);
  std::optional<Resembling> nearest;
  for (const NodeLandmark& other : in_node) {
    const int d = distance(descriptor, map.at(other.id).descriptor);
    if (!nearest || d < nearest->distance) nearest = Resembling{other.id, d};
  }
  return nearest;
}

/// Returns the median distance, for an even number the mean of the middle two.
/// @param pairs  at least one
double median_distance(const std::vector<Resembling>& pairs) {
  std::vector<int> distances;
  distances.reserve(pairs.size());
  for (const Resembling& pair : pairs) distances.push_back(pair.distance);
  std::sort(distances.begin(), distances.end());
  const std::size_t upper = distances.size() / 2, lower = (distances.size() - 1) / 2;
  return (distances[lower] + distances[upper]) / 2.0;
}

// Merging by place.

/// Expected appearance of a landmark in the keyframe.
struct Appearance {
  LandmarkId id;
  double u = 0, v = 0, disparity = 0;  ///< Expected position and disparity [pixels].
  int level = 0;
  double radius = 0;  ///< Radius within which another landmark is at the same place [pixels].
};

std::vector<Appearance> appearances(const Map& map, KeyframeId keyframe,
                                    std::span<const LandmarkId> local) {
  constexpr double kAnyDirection = -1;
  const LandmarkProjector view(map.camera(), map.pyramid(), map.at(keyframe).T_world_camera);
  std::vector<Appearance> all;
  for (const LandmarkId id : local) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    const auto query = view.expect(*landmark, kRadius, kAnyDirection);
    if (!query) continue;
    all.push_back({id, query->u, query->v, map.camera().bf() / view.depth(landmark->p_world),
                   query->min_level + 1, query->radius});
  }
  std::sort(all.begin(), all.end(), [](const Appearance& a, const Appearance& b) {
    return a.u != b.u ? a.u < b.u : a.id < b.id;
  });
  return all;
}

bool one_place(const Appearance& a, const Appearance& b) {
  const double radius = std::min(a.radius, b.radius);
  return std::abs(a.u - b.u) <= radius && std::abs(a.v - b.v) <= radius &&
         std::abs(a.disparity - b.disparity) <= kMaxDisparity && std::abs(a.level - b.level) <= 1;
}

struct Twins {
  int distance = 0;  ///< Hamming distance [bits].
  LandmarkId a, b;
  auto operator<=>(const Twins&) const = default;
};

std::optional<Twins> twins(const Landmark& a, const Landmark& b) {
  const int d = distance(a.descriptor, b.descriptor);
  if (d > kMaxDistance || a.normal.dot(b.normal) < kMinNormalCosine) {
    return std::nullopt;
  }
  return Twins{d, std::min(a.id, b.id), std::max(a.id, b.id)};
}

/// Returns all pairs that agree in place and appearance, most similar first.
std::vector<Twins> find_twins(const Map& map, const std::vector<Appearance>& all) {
  std::vector<Twins> found;
  for (auto a = all.begin(); a != all.end(); ++a) {
    for (auto b = a + 1; b != all.end() && b->u - a->u <= a->radius; ++b) {
      if (!one_place(*a, *b)) continue;
      if (const auto pair = twins(map.at(a->id), map.at(b->id))) found.push_back(*pair);
    }
  }
  std::sort(found.begin(), found.end());
  return found;
}

}  // namespace

RepeatedReport remove_repeated_by_node(Map& map, KeyframeId keyframe,
                                       std::span<const LandmarkId> local,
                                       const Vocabulary& vocabulary) {
  const auto others = others_by_node(map, keyframe, local, vocabulary);
  std::vector<Resembling> pairs;
  for (const LandmarkId id : map.at(keyframe).landmarks) {
    if (!id.valid()) continue;
    const auto nearest = nearest_in_node(map, map.at(id).descriptor, others, vocabulary);
    if (nearest) pairs.push_back(*nearest);
  }
  RepeatedReport report{.pairs = static_cast<int>(pairs.size())};
  if (pairs.empty()) return report;
  const double median = median_distance(pairs);
  for (const Resembling& pair : pairs) {
    if (pair.distance == 0 || pair.distance >= median || map.find(pair.id) == nullptr) continue;
    map.erase(pair.id);
    ++report.gone;
  }
  return report;
}

RepeatedReport join_repeated_by_place(Map& map, KeyframeId keyframe,
                                      std::span<const LandmarkId> local) {
  const auto found = find_twins(map, appearances(map, keyframe, local));
  RepeatedReport report{.pairs = static_cast<int>(found.size())};
  for (const Twins& pair : found) {
    const Landmark* a = map.find(pair.a);
    const Landmark* b = map.find(pair.b);
    // An earlier merge may have erased either one or added a keyframe that observes both.
    if (a == nullptr || b == nullptr || seen_together(*a, *b)) continue;
    const bool keep_a = a->observations.size() >= b->observations.size();
    map.merge(keep_a ? pair.a : pair.b, keep_a ? pair.b : pair.a);
    ++report.gone;
  }
  return report;
}

}  // namespace stillmap
