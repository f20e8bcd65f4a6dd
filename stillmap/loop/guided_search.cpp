// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/guided_search.hpp"

#include "stillmap/map/visibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Maximum Hamming distance of a match, inclusive [bits].
constexpr int kMaxDistance = 60;
/// Ratio test between the best and the second best match: see ProjectionMatchOptions.
constexpr double kRatio = 0.9;
/// Minimum cosine of the angle between a landmark's mean and current viewing direction.
constexpr double kMinViewCosine = 0.5;

/// Returns whether a point expected at `depth` [m] is occluded: a keypoint near its projection is
/// clearly closer, or moving.
bool hidden(const ImageView& image, const ProjectionQuery& query, double depth) {
  constexpr float kOcclusionRadius = 16;  // Radius in which keypoints can occlude a point [pixels].
  // Ratio to the expected depth below which a keypoint is in front.
  constexpr double kInFront = 0.85;
  bool found = false;
  image.features.grid.for_each_near(
      query.u, query.v, kOcclusionRadius, 0, 255, [&](std::uint32_t i) {
        const float there = image.features.keypoints[i].depth;
        found |= image.static_weight[i] <= 0 || (there > 0 && there < kInFront * depth);
      });
  return found;
}

/// Returns the least Hamming distance of the keypoints near a point expected at `depth` [m] whose
/// depth agrees [bits]; nothing without such keypoints.
std::optional<int> closest_on_surface(const ImageView& image, const ProjectionQuery& query,
                                      double depth) {
  constexpr double kSameDepth = 0.05;  // Largest relative difference of depths of one surface.
  std::optional<int> closest;
  image.features.grid.for_each_near(
      query.u, query.v, query.radius, query.min_level, query.max_level, [&](std::uint32_t i) {
        const double there = image.features.keypoints[i].depth;
        if (image.static_weight[i] <= 0 || std::abs(there - depth) > kSameDepth * depth) return;
        const int bits = distance(image.features.descriptors[i], query.descriptor);
        closest = std::min(bits, closest.value_or(bits));
      });
  return closest;
}

constexpr int kColumns = 6, kRows = 5, kRegions = kColumns * kRows;  // of an image

std::size_t region_of(const Camera& camera, float u, float v) {
  const int x = std::clamp(static_cast<int>(u) * kColumns / camera.width, 0, kColumns - 1);
  const int y = std::clamp(static_cast<int>(v) * kRows / camera.height, 0, kRows - 1);
  return static_cast<std::size_t>(y * kColumns + x);
}

/// Calls a function with each landmark that should be in the image, and its query.
template <typename Function>
void for_each_expected(const Map& map, std::span<const LandmarkId> landmarks,
                       const LandmarkProjector& view, double radius, const Function& function) {
  for (const LandmarkId id : landmarks) {
    const Landmark* landmark = map.find(id);
    if (landmark == nullptr) continue;
    if (const auto query = view.expect(*landmark, radius, kMinViewCosine))
      function(*landmark, *query);
  }
}

std::vector<std::uint8_t> unusable(const ImageView& image) {
  std::vector<std::uint8_t> taken;
  for (const float weight : image.static_weight) taken.push_back(weight <= 0);
  return taken;
}

}  // namespace

std::vector<KeyframeId> with_best_covisible(const Map& map, KeyframeId center, int most,
                                            int min_shared) {
  std::vector<KeyframeId> keyframes = {center};
  for (const Covisible& c : map.covisible(center, min_shared)) {
    if (std::ssize(keyframes) <= most) keyframes.push_back(c.keyframe);
  }
  return keyframes;
}

GuidedSearch search_landmarks(const Map& map, std::span<const LandmarkId> landmarks,
                              const ImageView& image, const Pose& T_world_camera, double radius) {
  const LandmarkProjector view(map.camera(), map.pyramid(), T_world_camera);
  std::vector<ProjectionQuery> queries;
  std::vector<const Landmark*> searched;
  for_each_expected(map, landmarks, view, radius,
                    [&](const Landmark& landmark, const ProjectionQuery& query) {
                      queries.push_back(query);
                      searched.push_back(&landmark);
                    });
  ProjectionMatchOptions matching;
  matching.max_distance = kMaxDistance;
  matching.ratio = kRatio;
  const auto found = match_by_projection(queries, image.features, matching, unusable(image));
  GuidedSearch result;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (found[q]) result.matches.push_back({*found[q], searched[q]->id});
    if (found[q] || !hidden(image, queries[q], view.depth(searched[q]->p_world)))
      result.expected.push_back({queries[q].u, queries[q].v, found[q].has_value()});
  }
  return result;
}

MatchConsistency consistency(const Camera& camera, std::span<const ExpectedLandmark> expected) {
  // Matched share below which an image region counts as blank [0..1].
  constexpr double kBlankShare = 0.15;
  struct Part {
    int expected = 0, found = 0;
  };
  std::array<Part, kRegions> parts;
  Part all;
  for (const ExpectedLandmark& e : expected) {
    Part& part = parts[region_of(camera, e.u, e.v)];
    ++part.expected, ++all.expected;
    part.found += e.found, all.found += e.found;
  }
  if (all.expected == 0) return {0, 1};
  int blank = 0;
  for (const Part& part : parts) {
    if (part.found <= kBlankShare * part.expected) blank += part.expected;
  }
  return {static_cast<double>(all.found) / all.expected, static_cast<double>(blank) / all.expected};
}

TextureAgreement& TextureAgreement::operator+=(const TextureAgreement& other) {
  regions += other.regions, alike += other.alike;
  return *this;
}

bool TextureAgreement::of_one_place() const {
  constexpr int kFewRegions = 10;
  constexpr double kLeastShare = 0.375;  // chosen by measurement, see lab/records/loops.md
  return regions < kFewRegions || alike >= kLeastShare * regions;
}

bool TextureAgreement::of_another_place() const {
  constexpr int kManyRegions = 100;
  constexpr double kMostShare = 0.3;  // chosen by measurement, see lab/records/loops.md
  return regions >= kManyRegions && alike < kMostShare * regions;
}

std::string TextureAgreement::text() const {
  return fmt::format("texture of another place: {:.0f} % of the similar descriptors are equal",
                     100 * alike / std::max(1, regions));
}

TextureAgreement texture_agreement(const Map& map, std::span<const LandmarkId> landmarks,
                                   const ImageView& image, const Pose& T_world_camera,
                                   double radius) {
  constexpr int kEqual = 40;  // Hamming distance of equal texture, exclusive [bits].
  constexpr int kSeen = 5;    // Number of landmarks seen in a region.
  const LandmarkProjector view(map.camera(), map.pyramid(), T_world_camera);
  struct Region {
    int seen = 0, similar = 0, equal = 0;
  };
  std::array<Region, kRegions> regions;
  for_each_expected(
      map, landmarks, view, radius, [&](const Landmark& landmark, const ProjectionQuery& query) {
        const auto closest = closest_on_surface(image, query, view.depth(landmark.p_world));
        if (!closest) return;
        Region& region = regions[region_of(map.camera(), query.u, query.v)];
        ++region.seen;
        region.similar += *closest <= kMaxDistance;
        region.equal += *closest < kEqual;
      });
  TextureAgreement agreement;
  for (const Region& region : regions) {
    if (region.seen < kSeen) continue;
    ++agreement.regions;
    agreement.alike += static_cast<double>(region.equal) / std::max(1, region.similar);
  }
  return agreement;
}

MatchedPose solve_matches(const Map& map, std::span<const LandmarkMatch> matches,
                          const ImageView& image, const Pose& T_world_camera_guess) {
  std::vector<PoseObservation> observations;
  for (const LandmarkMatch& match : matches) {
    const Keypoint& k = image.features.keypoints[match.keypoint];
    observations.push_back({.p_world = map.at(match.landmark).p_world,
                            .u = k.u,
                            .v = k.v,
                            .depth = k.depth,
                            .scale = static_cast<float>(map.pyramid().scale(k.level)),
                            .weight = image.static_weight[match.keypoint]});
  }
  MatchedPose result;
  result.solution = solve_pose(map.camera(), T_world_camera_guess, observations);
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (!result.solution.inlier[i]) continue;
    result.inliers.push_back(matches[i]);
    result.contradicted += observations[i].depth > 0 && !result.solution.depth_inlier[i];
  }
  return result;
}

}  // namespace stillmap
