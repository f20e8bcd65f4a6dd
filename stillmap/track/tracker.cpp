// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/tracker.hpp"

#include "stillmap/feature/matching.hpp"
#include "stillmap/map/visibility.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>

namespace stillmap {
namespace {

Eigen::Vector3d unproject(const Camera& camera, const Keypoint& k) {
  return camera.unproject(k.u, k.v, k.depth);
}

bool starts_point(const Frame& frame, std::size_t i) {
  return frame.features->keypoints[i].depth > 0 && frame.evidence.weight[i] > 0;
}

/// Per keypoint: not zero where it is left out.
std::vector<std::uint8_t> excluded(const Frame& frame) {
  std::vector<std::uint8_t> result(frame.features->size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = frame.evidence.weight[i] <= 0;
  return result;
}

}  // namespace

Tracker::Tracker(const Camera& camera, const PyramidShape& pyramid, const TrackerOptions& options)
    : camera_(camera), pyramid_(pyramid), options_(options), policy_(options.keyframes) {}

TrackedFramePtr Tracker::track(const FramePtr& frame, const LocalMapPtr& local_map) {
  if (!local_map || !previous_) return start(frame);
  if (local_map != local_map_) adopt(local_map);

  std::optional<Estimate> estimate;
  if (frames_lost_ == 0) estimate = estimate_from_previous(*frame);
  if (!estimate) estimate = estimate_from_reference(*frame);
  if (!estimate)
    return lost(frame, "too few keypoints match the previous frame and the newest keyframe");
  estimate = estimate_in_local_map(*frame, *estimate);
  if (!estimate) {
    return lost(frame,
                fmt::format("fewer than {} landmarks agree on a pose", options_.min_inliers));
  }
  return tracked(frame, *estimate);
}

TrackedFramePtr Tracker::start(const FramePtr& frame) {
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  const std::size_t count = frame->features->size();
  result->landmarks.assign(count, LandmarkId{});
  std::size_t usable = 0;
  for (std::size_t i = 0; i < count; ++i) usable += starts_point(*frame, i);
  if (usable < static_cast<std::size_t>(options_.min_start_points)) {
    result->reason = fmt::format("{} static keypoints with depth, {} are needed to begin a map",
                                 usable, options_.min_start_points);
    return result;
  }
  result->state = TrackState::kStarted;
  result->T_world_camera = T_world_previous_;  // a new map goes on where the old one was lost
  result->proposal =
      KeyframeProposal{frame, KeyframeId{}, T_world_previous_, result->landmarks, {}};
  previous_ = result;
  T_previous_next_ = Pose();
  frames_lost_ = 0;
  return result;
}

TrackedFramePtr Tracker::lost(const FramePtr& frame, const std::string& reason) {
  if (++frames_lost_ > options_.patience) {
    previous_.reset();
    return start(frame);
  }
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->state = TrackState::kLost;
  result->reason = reason;
  result->landmarks.assign(frame->features->size(), LandmarkId{});
  return result;
}

TrackedFramePtr Tracker::tracked(const FramePtr& frame, const Estimate& estimate) {
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->state = TrackState::kTracking;
  result->T_world_camera = estimate.T_world_camera;
  result->reference = local_map_->reference;
  result->T_reference_camera =
      local_map_->keyframes.front().T_world_camera.inverse() * estimate.T_world_camera;
  result->landmarks.assign(frame->features->size(), LandmarkId{});
  for (const Match& match : estimate.matches) result->landmarks[match.keypoint] = match.landmark;
  result->inliers = static_cast<int>(estimate.matches.size());

  const std::size_t newest = std::max(last_proposed_, local_map_->made_for_frame);
  if (policy_.wants(*frame, estimate.T_world_camera, result->landmarks, *local_map_,
                    frame->index() - newest)) {
    result->proposal = KeyframeProposal{frame, result->reference, result->T_reference_camera,
                                        result->landmarks, take_sightings()};
    last_proposed_ = frame->index();
  }
  const bool consecutive = frames_lost_ == 0 && frame->index() == previous_->frame->index() + 1;
  T_previous_next_ = consecutive ? T_world_previous_.inverse() * estimate.T_world_camera : Pose();
  T_world_previous_ = estimate.T_world_camera;
  previous_ = result;
  frames_lost_ = 0;
  return result;
}

void Tracker::adopt(const LocalMapPtr& local_map) {
  const auto spent = take_sightings();
  local_map_ = local_map;
  sightings_ = spent;
  predicted_.assign(local_map->landmarks.size(), 0);
  found_.assign(local_map->landmarks.size(), 0);
  // The map has moved under the previous frame: it moves along with its keyframe.
  const KeyframeId reference =
      previous_->state == TrackState::kStarted ? local_map->reference : previous_->reference;
  if (const LocalKeyframe* keyframe = local_map->find(reference)) {
    T_world_previous_ = keyframe->T_world_camera * previous_->T_reference_camera;
  }
}

std::optional<Tracker::Estimate> Tracker::estimate_from_previous(const Frame& frame) const {
  const Pose guess = T_world_previous_ * T_previous_next_;
  for (const double radius : {options_.motion_radius, 2 * options_.motion_radius}) {
    const auto matches = match_previous(frame, guess, radius);
    if (auto estimate = solve(frame, guess, matches, options_.min_motion_inliers)) return estimate;
  }
  return std::nullopt;
}

std::optional<Tracker::Estimate> Tracker::estimate_from_reference(const Frame& frame) const {
  return solve(frame, T_world_previous_, match_reference(frame), options_.min_motion_inliers);
}

std::optional<Tracker::Estimate> Tracker::estimate_in_local_map(const Frame& frame,
                                                                const Estimate& first) {
  std::vector<Match> matches;
  for (const Match& match : first.matches) {
    if (match.landmark.valid()) matches.push_back(match);
  }
  std::vector<char> in_view(local_map_->landmarks.size(), 0);
  const auto more = match_local(frame, first.T_world_camera, matches, in_view);
  matches.insert(matches.end(), more.begin(), more.end());
  auto estimate = solve(frame, first.T_world_camera, matches, options_.min_inliers);
  if (estimate) count_sightings(in_view, estimate->matches);
  return estimate;
}

std::vector<Tracker::Match> Tracker::match_previous(const Frame& frame, const Pose& T_world_camera,
                                                    double radius) const {
  const Frame& previous = *previous_->frame;
  const Pose T_camera_world = T_world_camera.inverse();
  std::vector<Match> points;
  std::vector<ProjectionQuery> queries;
  for (std::size_t i = 0; i < previous.features->size(); ++i) {
    const Keypoint& k = previous.features->keypoints[i];
    const LandmarkId id = previous_->landmarks[i];
    const LocalLandmark* landmark = id.valid() ? local_map_->find(id) : nullptr;
    if (landmark == nullptr && !starts_point(previous, i)) continue;
    const Eigen::Vector3d p_world =
        landmark != nullptr ? landmark->p_world : T_world_previous_ * unproject(camera_, k);
    const Eigen::Vector3d p = T_camera_world * p_world;
    if (p.z() < kNearPlane) continue;
    const Eigen::Vector2d uv = camera_.project(p);
    if (!camera_.contains(uv.x(), uv.y())) continue;
    queries.push_back({.u = static_cast<float>(uv.x()),
                       .v = static_cast<float>(uv.y()),
                       .radius = static_cast<float>(radius * pyramid_.scale(k.level)),
                       .min_level = k.level - 1,
                       .max_level = k.level + 1,
                       .descriptor = previous.features->descriptors[i],
                       .angle = k.angle});
    points.push_back({0, landmark != nullptr ? id : LandmarkId{}, p_world});
  }
  ProjectionMatchOptions matching;
  matching.max_distance = options_.max_distance;
  matching.ratio = 1;  // neighbours in time: the nearest is the one
  const auto found = match_by_projection(queries, *frame.features, matching, excluded(frame));
  std::vector<Match> matches;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (!found[q]) continue;
    points[q].keypoint = *found[q];
    matches.push_back(points[q]);
  }
  return matches;
}

std::vector<Tracker::Match> Tracker::match_reference(const Frame& frame) const {
  const LocalKeyframe& reference = local_map_->keyframes.front();
  BruteForceMatchOptions matching;
  matching.max_distance = options_.max_distance;
  matching.ratio = options_.ratio;
  const auto pairs =
      match_brute_force(reference.features->descriptors, frame.features->descriptors, matching);
  std::vector<Match> matches;
  for (const auto& pair : pairs) {
    const LandmarkId id = reference.landmarks[pair.a];
    const LocalLandmark* landmark = id.valid() ? local_map_->find(id) : nullptr;
    if (landmark != nullptr) matches.push_back({pair.b, id, landmark->p_world});
  }
  return matches;
}

std::vector<Tracker::Match> Tracker::match_local(const Frame& frame, const Pose& T_world_camera,
                                                 const std::vector<Match>& known,
                                                 std::vector<char>& in_view) const {
  std::vector<std::uint8_t> taken = excluded(frame);
  for (const Match& match : known) {
    taken[match.keypoint] = 1;
    in_view[local_map_->index(match.landmark)] = 1;
  }
  const Viewpoint view(camera_, pyramid_, T_world_camera);
  std::vector<ProjectionQuery> queries;
  std::vector<std::size_t> indices;
  for (std::size_t i = 0; i < local_map_->landmarks.size(); ++i) {
    if (in_view[i]) continue;
    const auto query =
        view.expect(local_map_->landmarks[i], options_.local_radius, options_.min_view_cosine);
    if (!query) continue;
    in_view[i] = 1;
    queries.push_back(*query);
    indices.push_back(i);
  }
  ProjectionMatchOptions matching;
  matching.max_distance = options_.max_distance;
  matching.ratio = options_.ratio;
  matching.check_rotation = false;  // a landmark has no angle of its own
  const auto found = match_by_projection(queries, *frame.features, matching, taken);
  std::vector<Match> matches;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (!found[q]) continue;
    const LocalLandmark& landmark = local_map_->landmarks[indices[q]];
    matches.push_back({*found[q], landmark.id, landmark.p_world});
  }
  return matches;
}

std::optional<Tracker::Estimate> Tracker::solve(const Frame& frame, const Pose& guess,
                                                const std::vector<Match>& matches,
                                                int min_inliers) const {
  std::vector<PoseObservation> observations;
  observations.reserve(matches.size());
  for (const Match& match : matches) {
    const Keypoint& k = frame.features->keypoints[match.keypoint];
    observations.push_back({match.p_world, k.u, k.v, k.depth,
                            static_cast<float>(pyramid_.scale(k.level)),
                            frame.evidence.weight[match.keypoint]});
  }
  const PoseSolution solution = solve_pose(camera_, guess, observations, options_.solver);
  if (!solution.well_posed || solution.inliers < min_inliers) return std::nullopt;
  Estimate estimate{solution.T_world_camera, {}};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (solution.inlier[i]) estimate.matches.push_back(matches[i]);
  }
  return estimate;
}

void Tracker::count_sightings(const std::vector<char>& in_view, const std::vector<Match>& inliers) {
  for (std::size_t i = 0; i < in_view.size(); ++i) predicted_[i] += in_view[i];
  for (const Match& match : inliers) {
    ++found_[local_map_->index(match.landmark)];
  }
}

std::vector<Sighting> Tracker::take_sightings() {
  std::vector<Sighting> sightings = std::move(sightings_);
  sightings_.clear();
  for (std::size_t i = 0; i < predicted_.size(); ++i) {
    if (predicted_[i] > 0) {
      sightings.push_back({local_map_->landmarks[i].id, predicted_[i], found_[i]});
      predicted_[i] = found_[i] = 0;
    }
  }
  return sightings;
}

}  // namespace stillmap
