// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/tag_matching.hpp"

#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/map/tag_landmarks.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>
#include <set>

#include <Eigen/Eigenvalues>
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Number of observations from which a corner's position is accurate enough.
constexpr std::size_t kObservations = 2;
/// Number of covisible keyframes whose tags are used with those of a keyframe.
constexpr int kWindow = 10;
/// Maximum RMS distance of the aligned corners [m].
constexpr double kMaxError = 0.03;
/// Maximum distance of another tag's corners after the alignment by one tag, at that tag [m] and
/// per distance from it [m/m]: the rotation by one tag is inaccurate.
constexpr double kMaxOffset = 0.05, kMaxOffsetPerMeter = 0.1;
/// Standard deviation of a corner's position: constant [m], and per that of a depth reading.
constexpr double kFloorSigma = 0.001, kPlaneSigma = 0.1;
/// Maximum standard deviation of the rotation about any axis [rad]: a small tag far away says
/// little.
constexpr double kMaxRotationSigma = 0.04;
/// Maximum distance of two landmarks of one corner that are merged [m].
constexpr double kWeldDistance = 0.1;

/// Returns the tags around a keyframe whose corners are known well.
std::map<TagName, TagLandmarks> tags_around(const Map& map, KeyframeId center) {
  std::vector<const Landmark*> landmarks;
  for (const LandmarkId id : landmarks_seen_by(map, with_best_covisible(map, center, kWindow))) {
    const Landmark& landmark = map.at(id);
    if (landmark.observations.size() >= kObservations) landmarks.push_back(&landmark);
  }
  return tags_among(landmarks);
}

/// The corners of a tag in the world frames of the query's and of the candidate's side, and the
/// variances of their differences [m^2].
struct TagPair {
  Eigen::Matrix<double, 3, 4> query, candidate;
  Eigen::Vector4d variance;
};

/// Returns the variance of the position of a tag's corner [m^2]. It is the error of the plane that
/// the depths within the tag give it (with_tag_corners()), and the same in all frames.
double variance_of(const Map& map, const Landmark& corner) {
  double nearest = std::numeric_limits<double>::infinity();
  for (const Observation& o : corner.observations) {
    const Pose& T_world_camera = map.at(o.keyframe).T_world_camera;
    nearest = std::min(nearest, (T_world_camera.inverse() * corner.p_world).z());
  }
  const double sigma = kFloorSigma + kPlaneSigma * map.camera().depth_sensor.sigma(nearest);
  return sigma * sigma;
}

Eigen::Matrix<double, 3, 4> corners_of(const TagLandmarks& tag) {
  Eigen::Matrix<double, 3, 4> corners;
  for (int i = 0; i < 4; ++i) corners.col(i) = tag[static_cast<std::size_t>(i)]->p_world;
  return corners;
}

/// Returns the tags that both sides have as different landmarks.
std::vector<TagPair> tag_pairs(const Map& map, KeyframeId query, KeyframeId candidate) {
  const auto of_query = tags_around(map, query);
  const auto of_candidate = tags_around(map, candidate);
  std::vector<TagPair> pairs;
  for (const auto& [name, here] : of_query) {
    const auto there = of_candidate.find(name);
    if (there == of_candidate.end()) continue;
    const bool shared = std::ranges::any_of(
        here, [&](const Landmark* l) { return std::ranges::count(there->second, l) > 0; });
    if (shared) continue;
    TagPair& pair = pairs.emplace_back(corners_of(here), corners_of(there->second));
    for (std::size_t i = 0; i < here.size(); ++i)
      pair.variance[static_cast<Eigen::Index>(i)] =
          variance_of(map, *here[i]) + variance_of(map, *there->second[i]);
  }
  return pairs;
}

Pose alignment(const std::vector<TagPair>& pairs) {
  const auto count = static_cast<Eigen::Index>(4 * pairs.size());
  Eigen::Matrix3Xd query(3, count), candidate(3, count);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    query.middleCols<4>(static_cast<Eigen::Index>(4 * i)) = pairs[i].query;
    candidate.middleCols<4>(static_cast<Eigen::Index>(4 * i)) = pairs[i].candidate;
  }
  return align_points(candidate, query);
}

/// Returns the RMS distance of a tag's corners from their places after an alignment [m].
double error(const TagPair& pair, const Pose& T_candidate_query) {
  double squares = 0;
  for (int i = 0; i < 4; ++i)
    squares += (pair.candidate.col(i) - T_candidate_query * pair.query.col(i)).squaredNorm();
  return std::sqrt(squares / 4);
}

/// Returns the tags that agree with the alignment by one of them.
std::vector<TagPair> agreeing(const std::vector<TagPair>& pairs, const TagPair& center) {
  const Pose T = alignment({center});
  std::vector<TagPair> agree;
  if (error(center, T) > kMaxError) return agree;
  for (const TagPair& pair : pairs) {
    const double meters = (pair.query.rowwise().mean() - center.query.rowwise().mean()).norm();
    if (error(pair, T) < kMaxOffset + kMaxOffsetPerMeter * meters) agree.push_back(pair);
  }
  return agree;
}

/// Returns the most tags that one rigid motion fits.
std::vector<TagPair> consensus(const std::vector<TagPair>& pairs) {
  std::vector<TagPair> best;
  for (const TagPair& center : pairs) {
    std::vector<TagPair> agree = agreeing(pairs, center);
    const Pose T = agree.empty() ? Pose() : alignment(agree);
    const bool fits =
        std::ranges::all_of(agree, [&](const TagPair& pair) { return error(pair, T) < kMaxError; });
    if (fits && agree.size() > best.size()) best = std::move(agree);
  }
  return best;
}

/// Returns the largest standard deviation of the rotation that aligns tags, about any axis [rad].
double rotation_sigma(const std::vector<TagPair>& pairs) {
  Eigen::Vector3d center = Eigen::Vector3d::Zero();
  for (const TagPair& pair : pairs)
    center += pair.query.rowwise().mean() / static_cast<double>(pairs.size());
  Eigen::Matrix3d information = Eigen::Matrix3d::Zero();
  for (const TagPair& pair : pairs) {
    for (int i = 0; i < 4; ++i) {
      const Eigen::Vector3d d = pair.query.col(i) - center;
      information +=
          (d.squaredNorm() * Eigen::Matrix3d::Identity() - d * d.transpose()) / pair.variance[i];
    }
  }
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> solver(information);
  return 1 / std::sqrt(solver.eigenvalues()[0]);
}

/// Returns the landmarks of corners of tags that keyframes observe.
std::map<TagCorner, LandmarkId> corners_seen_by(const Map& map,
                                                std::span<const KeyframeId> keyframes) {
  std::map<TagCorner, LandmarkId> corners;
  for (const LandmarkId id : landmarks_seen_by(map, keyframes)) {
    if (const auto corner = tag_corner_of(map.at(id).descriptor)) corners.emplace(*corner, id);
  }
  return corners;
}

}  // namespace

std::vector<KeyframeId> places_with_same_tags(const Map& map, KeyframeId query) {
  std::set<TagName> shown;
  for (const auto& [corner, id] : corners_seen_by(map, std::span(&query, 1)))
    shown.insert(corner.tag);
  if (shown.empty()) return {};
  std::map<KeyframeId, int> corners;  // by keyframe
  map.for_each_landmark([&](const Landmark& landmark) {
    const auto corner = tag_corner_of(landmark.descriptor);
    if (!corner || !shown.contains(corner->tag)) return;
    if (landmark.observations.size() < kObservations) return;
    for (const Observation& o : landmark.observations) ++corners[o.keyframe];
  });
  corners.erase(query);
  for (const Covisible& c : map.covisible(query)) corners.erase(c.keyframe);
  std::map<std::uint32_t, KeyframeId> best;  // by component
  for (const auto& [id, count] : corners) {
    const auto [place, first] = best.emplace(map.at(id).component, id);
    if (!first && count > corners.at(place->second)) place->second = id;
  }
  std::vector<KeyframeId> places;
  for (const auto& [component, id] : best) places.push_back(id);
  return places;
}

LoopVerification verify_tags(const Map& map, KeyframeId query, KeyframeId candidate) {
  const std::vector<TagPair> pairs = tag_pairs(map, query, candidate);
  if (pairs.empty()) return {std::nullopt, "no common tag is seen well on both sides", 0};
  const std::vector<TagPair> fitting = consensus(pairs);
  if (fitting.empty())
    return {std::nullopt, fmt::format("no rigid motion fits the tags ({})", pairs.size()), 1};
  if (const double sigma = rotation_sigma(fitting); sigma > kMaxRotationSigma) {
    return {std::nullopt, fmt::format("the tags determine the rotation to {:.3f} rad only", sigma),
            2};
  }
  const Pose& T_world_query = map.at(query).T_world_camera;
  const Pose T_world_matched = alignment(fitting) * T_world_query;
  LoopMatch match;
  match.query = query;
  match.candidate = candidate;
  match.T_candidate_query = map.at(candidate).T_world_camera.inverse() * T_world_matched;
  match.same_component = map.at(query).component == map.at(candidate).component;
  match.inliers = static_cast<int>(4 * fitting.size());
  if (match.same_component) {
    if (std::string reason = why_no_drift(map, query, candidate, T_world_matched); !reason.empty())
      return {std::nullopt, std::move(reason), 3};
  }
  return {std::move(match), "", 4};
}

int weld_tags(Map& map, std::span<const KeyframeId> a, std::span<const KeyframeId> b) {
  int merged = 0;
  const auto of_b = corners_seen_by(map, b);
  for (const auto& [corner, in_a] : corners_seen_by(map, a)) {
    const auto found = of_b.find(corner);
    if (found == of_b.end() || found->second == in_a) continue;
    const Landmark &first = map.at(in_a), &second = map.at(found->second);
    if ((first.p_world - second.p_world).norm() > kWeldDistance) continue;
    const bool keep_first = first.observations.size() >= second.observations.size();
    map.merge(keep_first ? in_a : found->second, keep_first ? found->second : in_a);
    ++merged;
  }
  return merged;
}

}  // namespace stillmap
