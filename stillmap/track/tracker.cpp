// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/tracker.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/map/visibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <numeric>

#include <fmt/format.h>

namespace stillmap {
namespace {

Eigen::Vector3d unproject(const Camera& camera, const Keypoint& k) {
  return camera.unproject(k.u, k.v, k.depth);
}

bool starts_point(const Frame& frame, std::size_t i) {
  return frame.features->keypoints[i].depth > 0 && frame.evidence.weight[i] > 0;
}

/// What a map could begin with.
struct StartingPoints {
  int count = 0;
  int parts = 0;  ///< of the 16 parts of the picture, those with three or more
};

StartingPoints starting_points(const Frame& frame, const Camera& camera) {
  constexpr int kSide = 4, kEnough = 3;
  std::array<int, kSide * kSide> in_part{};
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    if (!starts_point(frame, i)) continue;
    const Keypoint& k = frame.features->keypoints[i];
    const auto part = [](float at, int size) {
      return std::clamp(static_cast<int>(kSide * at / static_cast<float>(size)), 0, kSide - 1);
    };
    ++in_part.at(kSide * part(k.v, camera.height) + part(k.u, camera.width));
  }
  return {std::accumulate(in_part.begin(), in_part.end(), 0),
          static_cast<int>(std::count_if(in_part.begin(), in_part.end(),
                                         [](int count) { return count >= kEnough; }))};
}

/// Why a map cannot begin with these; empty if it can.
std::string why_not(const StartingPoints& points, const TrackerOptions& options) {
  if (points.count < options.min_start_points) {
    return fmt::format("{} static keypoints with depth, {} are needed to begin a map", points.count,
                       options.min_start_points);
  }
  if (points.parts < options.min_start_parts) {
    return fmt::format(
        "static keypoints in {} of 16 parts of the picture, {} are needed to begin a map",
        points.parts, options.min_start_parts);
  }
  return {};
}

/// A frame as the tracker would have left it, had it known where it is.
TrackedFramePtr tracked_at(const RelocalizationResult& place) {
  auto result = std::make_shared<TrackedFrame>();
  result->frame = place.frame;
  result->state = TrackState::kTracking;
  result->reference = place.local_map->reference;
  result->T_reference_camera = place.T_reference_camera;
  result->landmarks = place.landmarks;
  result->inliers = place.inliers;
  return result;
}

/// Per keypoint: not zero where it is left out.
std::vector<std::uint8_t> excluded(const Frame& frame) {
  std::vector<std::uint8_t> result(frame.features->size());
  for (std::size_t i = 0; i < result.size(); ++i) result[i] = frame.evidence.weight[i] <= 0;
  return result;
}

/// Log-odds of a landmark's being static where its place is seen to be empty.
constexpr float kEmptyPlace = -3;

/// A reason for having no pose, and before it that nearly all moves, where that is why.
std::string with_what_moves(const std::string& reason, const Frame& frame) {
  const auto& weight = frame.evidence.weight;
  const auto moving = std::count(weight.begin(), weight.end(), 0.0F);
  if (10 * moving < 7 * std::ssize(weight) || weight.empty()) return reason;
  return fmt::format("everything seems to move ({} of {} keypoints): {}", moving, weight.size(),
                     reason);
}

enum class Sight { kUnknown, kCovered, kSeenThrough };

/// What lies where a point should be seen. One that nothing is known of is on its surface, or where
/// there is no depth.
Sight sight_of(const Eigen::Vector3d& p_camera, const CellGrid& grid) {
  if (p_camera.z() < kNearPlane) return Sight::kUnknown;
  const Eigen::Vector2d cell = grid.camera.project(p_camera);
  const auto z = static_cast<float>(p_camera.z());
  const float tolerance = grid.tolerance.at(z);
  bool nearer = true, farther = true;
  for (int dy = -1; dy <= 1; ++dy) {
    for (int dx = -1; dx <= 1; ++dx) {
      const int c = static_cast<int>(std::lround(cell.x())) + dx;
      const int r = static_cast<int>(std::lround(cell.y())) + dy;
      if (c < 0 || r < 0 || c >= grid.depth.cols || r >= grid.depth.rows) return Sight::kUnknown;
      const float seen = grid.depth(r, c);
      if (seen <= 0) return Sight::kUnknown;
      nearer = nearer && seen < z - tolerance;
      farther = farther && seen > z + tolerance;
    }
  }
  if (nearer) return Sight::kCovered;
  return farther ? Sight::kSeenThrough : Sight::kUnknown;
}

}  // namespace

Tracker::Tracker(const Camera& camera, const PyramidShape& pyramid, const TrackerOptions& options,
                 TrackerStart start)
    : camera_(camera),
      pyramid_(pyramid),
      options_(options),
      start_(start),
      policy_(options.keyframes, camera.depth_sensor) {}

std::optional<InitialPose> Tracker::follow(const Features& features, const LocalMapPtr& local_map) {
  const TraceScope scope("follow");
  if (!local_map || !previous_) return std::nullopt;
  if (local_map != local_map_) adopt(local_map);
  if (frames_lost_ > 0) return std::nullopt;
  return follow_previous(features);
}

std::optional<InitialPose> Tracker::follow_previous(const Features& features) const {
  const Pose guess = T_world_previous_ * T_previous_next_;
  for (const double radius : {options_.motion_radius, 2 * options_.motion_radius}) {
    const auto followed = match_previous(features, guess, radius);
    if (auto initial = initial_pose(features, followed, guess)) return initial;
  }
  return std::nullopt;
}

TrackedFramePtr Tracker::track(const FramePtr& frame, const std::optional<InitialPose>& initial,
                               const LocalMapPtr& local_map,
                               const std::optional<RelocalizationResult>& found) {
  const TraceScope scope("pose");
  if (!local_map || !previous_) return begin(frame, found);
  if (local_map != local_map_) adopt(local_map);

  std::optional<Estimate> estimate;
  if (initial) estimate = Estimate{initial->motion.T_world_camera, initial->matches};
  if (!estimate) estimate = estimate_from_reference(*frame);
  const bool followed = estimate.has_value();
  if (estimate) estimate = estimate_in_local_map(*frame, *estimate);
  const bool lost_here = !estimate;
  if (lost_here && found) estimate = estimate_from_place(*frame, *found);
  if (estimate) return tracked(frame, *estimate, lost_here);
  if (const auto odometry = estimate_beside(*frame, initial)) return beside(frame, *odometry);
  const std::string reason =
      followed ? fmt::format("fewer than {} landmarks agree on a pose", options_.min_inliers)
               : "too few keypoints match the previous frame and the newest keyframe";
  return lost(frame, with_what_moves(reason, *frame));
}

TrackedFramePtr Tracker::begin(const FramePtr& frame,
                               const std::optional<RelocalizationResult>& found) {
  if (start_ == TrackerStart::kNewMap) return start(frame);
  if (found) {
    if (const auto estimate = estimate_from_place(*frame, *found)) {
      return tracked(frame, *estimate, true);
    }
  }
  return lost(frame, "not recognized yet in the map that was loaded");
}

TrackedFramePtr Tracker::start(const FramePtr& frame) {
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->landmarks.assign(frame->features->size(), LandmarkId{});
  result->reason = why_not(starting_points(*frame, camera_), options_);
  if (!result->reason.empty()) return result;
  result->state = TrackState::kStarted;
  result->T_world_camera = T_world_previous_;  // a new map goes on where the old one was lost
  result->proposal =
      KeyframeProposal{frame, KeyframeId{}, T_world_previous_, result->landmarks, {}};
  if (local_map_ && frames_in_map_ < options_.min_map_frames)
    result->proposal->abandoned = local_map_->reference;
  frames_in_map_ = 1;
  previous_ = result;
  T_previous_next_ = Pose();
  frames_lost_ = could_have_begun_ = covered_ = 0;
  return result;
}

/// Counts the frame, which has no pose; whether a map is to begin with it.
bool Tracker::may_begin(const Frame& frame) {
  if (!why_not(starting_points(frame, camera_), options_).empty()) return false;
  if (covered(frame) && ++covered_ <= options_.covered_patience) return false;
  return ++could_have_begun_ > options_.patience && start_ != TrackerStart::kInMapOnly;
}

/// Whether something has come before the camera: what should be seen from the last pose is hidden
/// by something within reach, and much nearer. (Of a camera that was carried elsewhere about half
/// would be hidden, but by things as far away as those of any room.)
bool Tracker::covered(const Frame& frame) const {
  constexpr double kReach = 1.2;       // meters: a person there fills half of a Kinect's view
  constexpr double kMuchNearer = 0.6;  // of the depth
  if (!local_map_) return false;
  const LandmarkProjector view(camera_, pyramid_, T_world_previous_);
  int expected = 0, hidden = 0;
  for (const LocalLandmark& landmark : local_map_->landmarks) {
    const auto query = view.expect(landmark, options_.local_radius, options_.min_view_cosine);
    if (!query) continue;
    const float seen = frame.cells->depth(frame.cells->cell_of(query->u, query->v));
    ++expected;
    const double much_nearer = kMuchNearer * view.depth(landmark.p_world);
    hidden += seen > 0 && seen < std::min(kReach, much_nearer);
  }
  return hidden > options_.covered_share * expected;
}

TrackedFramePtr Tracker::lost(const FramePtr& frame, const std::string& reason) {
  ++frames_lost_;
  if (may_begin(*frame)) return start(frame);
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->state = TrackState::kLost;
  result->reason = reason;
  result->landmarks.assign(frame->features->size(), LandmarkId{});
  return result;
}

/// A frame with a pose, and the landmarks that agree with it.
std::shared_ptr<TrackedFrame> Tracker::placed(const FramePtr& frame,
                                              const Estimate& estimate) const {
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
  return result;
}

TrackedFramePtr Tracker::tracked(const FramePtr& frame, const Estimate& estimate,
                                 bool relocalized) {
  const auto result = placed(frame, estimate);
  result->relocalized = relocalized;
  frames_in_map_ = relocalized ? options_.min_map_frames : frames_in_map_ + 1;

  const std::size_t newest = std::max(last_proposed_, local_map_->made_for_frame);
  if (policy_.wants(*frame, estimate.T_world_camera, result->landmarks, *local_map_,
                    frame->index() - newest)) {
    result->proposal = KeyframeProposal{frame, result->reference, result->T_reference_camera,
                                        result->landmarks, take_sightings()};
    last_proposed_ = frame->index();
  }
  carried_.clear();
  go_on_from(result);
  return result;
}

/// A frame that sees too little of the map, placed by what the frames before it showed.
TrackedFramePtr Tracker::beside(const FramePtr& frame, const Estimate& estimate) {
  const auto result = placed(frame, estimate);
  result->tracked_by_odometry = true;
  carried_.assign(frame->features->size(), std::nullopt);
  for (const Match& match : estimate.matches) carried_[match.keypoint] = match.p_world;
  go_on_from(result);
  return result;
}

void Tracker::go_on_from(const TrackedFramePtr& tracked) {
  const bool consecutive =
      frames_lost_ == 0 && tracked->frame->index() == previous_->frame->index() + 1;
  T_previous_next_ = consecutive ? T_world_previous_.inverse() * *tracked->T_world_camera : Pose();
  T_world_previous_ = *tracked->T_world_camera;
  previous_ = tracked;
  frames_lost_ = could_have_begun_ = covered_ = 0;
}

void Tracker::stand(const Stance& stance) {
  previous_ = stance.previous;
  T_previous_next_ = Pose();
  carried_ = stance.carried;
  stance.local_map ? adopt(stance.local_map) : local_map_.reset();
}

void Tracker::adopt(const LocalMapPtr& local_map) {
  const TraceScope scope("new snapshot");
  const auto spent = take_sightings();
  std::vector<float> log_odds;
  for (const LocalLandmark& landmark : local_map->landmarks) {
    const LocalLandmark* known = local_map_ ? local_map_->find(landmark.id) : nullptr;
    log_odds.push_back(known != nullptr ? static_log_odds_[local_map_->index(landmark.id)]
                                        : landmark.static_log_odds);
  }
  static_log_odds_ = std::move(log_odds);
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

std::optional<InitialPose> Tracker::initial_pose(const Features& features,
                                                 const std::vector<Continuation>& followed,
                                                 const Pose& guess) const {
  std::vector<Match> landmarks, all;
  for (const Continuation& c : followed) {
    if (c.match.weight <= 0) continue;
    all.push_back(c.match);
    if (c.match.landmark.valid()) landmarks.push_back(c.match);
  }
  // Landmarks have been static for a while; a point of one frame may be anything.
  auto estimate = solve(features, guess, landmarks, options_.sure_inliers);
  if (!estimate) estimate = solve(features, guess, all, options_.min_motion_inliers);
  if (!estimate) return std::nullopt;
  return InitialPose{ego_motion(features, followed, estimate->T_world_camera), estimate->matches};
}

EgoMotion Tracker::ego_motion(const Features& features, const std::vector<Continuation>& followed,
                              const Pose& T_world_camera) const {
  EgoMotion motion{T_world_camera, T_world_previous_,
                   std::vector<std::int32_t>(features.size(), -1),
                   std::vector<float>(features.size(), 0.0F)};
  for (const Continuation& c : followed) {
    motion.previous[c.match.keypoint] = static_cast<std::int32_t>(c.previous);
    if (!c.match.landmark.valid()) continue;
    motion.landmark_log_odds[c.match.keypoint] =
        static_log_odds_[local_map_->index(c.match.landmark)];
  }
  return motion;
}

std::optional<Tracker::Estimate> Tracker::estimate_from_reference(const Frame& frame) const {
  return solve(*frame.features, T_world_previous_, match_reference(frame),
               options_.min_motion_inliers);
}

std::optional<Tracker::Estimate> Tracker::estimate_in_local_map(const Frame& frame,
                                                                const Estimate& first) {
  std::vector<Match> matches;
  for (const Match& match : first.matches) {
    if (match.landmark.valid() && frame.evidence.weight[match.keypoint] > 0) {
      matches.push_back(match);
    }
  }
  std::vector<char> in_view(local_map_->landmarks.size(), 0);
  const auto more = match_local(frame, first.T_world_camera, matches, in_view);
  matches.insert(matches.end(), more.begin(), more.end());
  for (Match& match : matches) match.weight = frame.evidence.weight[match.keypoint];
  auto estimate = solve(*frame.features, first.T_world_camera, matches, options_.min_inliers);
  if (!estimate) estimate = estimate_with_points(frame, first, std::move(matches));
  if (estimate) count_sightings(frame, *estimate, in_view);
  return estimate;
}

/// Too few landmarks are seen, as in a moment of blur: points of the previous frame help to hold
/// the pose. They alone do not, for they may all be on one thing that moves.
std::optional<Tracker::Estimate> Tracker::estimate_with_points(const Frame& frame,
                                                               const Estimate& first,
                                                               std::vector<Match> matches) const {
  for (Match match : first.matches) {
    match.weight = frame.evidence.weight[match.keypoint];
    if (!match.landmark.valid() && match.weight > 0) matches.push_back(match);
  }
  auto estimate = solve(*frame.features, first.T_world_camera, matches, options_.sure_inliers);
  if (!estimate) return std::nullopt;
  std::erase_if(estimate->matches, [](const Match& match) { return !match.landmark.valid(); });
  const auto landmarks = static_cast<int>(estimate->matches.size());
  return landmarks < options_.min_motion_inliers ? std::nullopt : estimate;
}

/// A second frame's word for the place: it is followed from the recognized one, and agrees with the
/// landmarks around. Without it everything stays as it was.
std::optional<Tracker::Estimate> Tracker::estimate_from_place(const Frame& frame,
                                                              const RelocalizationResult& found) {
  const Stance before{local_map_, previous_, carried_};
  stand({found.local_map, tracked_at(found), {}});
  std::optional<Estimate> estimate;
  if (const auto initial = follow_previous(*frame.features)) {
    estimate = Estimate{initial->motion.T_world_camera, initial->matches};
  } else {
    estimate = estimate_from_reference(frame);
  }
  if (estimate) estimate = estimate_in_local_map(frame, *estimate);
  if (estimate && static_cast<int>(estimate->matches.size()) >= options_.sure_inliers)
    return estimate;
  stand(before);
  return std::nullopt;
}

/// Where keypoint i of the previous frame, which has a depth or was carried, shows its point.
Eigen::Vector3d Tracker::seen_before(std::size_t i) const {
  if (i < carried_.size() && carried_[i]) return *carried_[i];
  return T_world_previous_ * unproject(camera_, previous_->frame->features->keypoints[i]);
}

std::optional<Tracker::Estimate> Tracker::estimate_beside(
    const Frame& frame, const std::optional<InitialPose>& initial) const {
  if (!initial || start_ != TrackerStart::kInMapOnly || !options_.tracked_by_odometry)
    return std::nullopt;
  std::vector<Match> matches;
  for (Match match : initial->matches) {
    match.weight = frame.evidence.weight[match.keypoint];
    if (match.weight > 0) matches.push_back(match);
  }
  return solve(*frame.features, initial->motion.T_world_camera, matches, options_.sure_inliers);
}

std::vector<Tracker::Continuation> Tracker::match_previous(const Features& features,
                                                           const Pose& T_world_camera,
                                                           double radius) const {
  const TraceScope scope("match");
  const Frame& previous = *previous_->frame;
  const Pose T_camera_world = T_world_camera.inverse();
  std::vector<Continuation> points;
  std::vector<ProjectionQuery> queries;
  for (std::size_t i = 0; i < previous.features->size(); ++i) {
    const Keypoint& k = previous.features->keypoints[i];
    const LandmarkId id = previous_->landmarks[i];
    const LocalLandmark* landmark = id.valid() ? local_map_->find(id) : nullptr;
    const bool carried = i < carried_.size() && carried_[i];
    if (landmark == nullptr && k.depth <= 0 && !carried) continue;
    const Eigen::Vector3d p_world = landmark != nullptr ? landmark->p_world : seen_before(i);
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
    points.push_back(
        {static_cast<std::uint32_t>(i),
         {0, landmark != nullptr ? id : LandmarkId{}, p_world, previous.evidence.weight[i]}});
  }
  ProjectionMatchOptions matching;
  matching.max_distance = options_.max_distance;
  matching.ratio = 1;  // neighbors in time: the nearest is the one
  const auto found = match_by_projection(queries, features, matching, {});
  std::vector<Continuation> followed;
  for (std::size_t q = 0; q < queries.size(); ++q) {
    if (!found[q]) continue;
    points[q].match.keypoint = *found[q];
    followed.push_back(points[q]);
  }
  return followed;
}

std::vector<Tracker::Match> Tracker::match_reference(const Frame& frame) const {
  const TraceScope scope("match");
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
    if (landmark == nullptr) continue;
    matches.push_back({pair.b, id, landmark->p_world, frame.evidence.weight[pair.b]});
  }
  return matches;
}

std::vector<Tracker::Match> Tracker::match_local(const Frame& frame, const Pose& T_world_camera,
                                                 const std::vector<Match>& known,
                                                 std::vector<char>& in_view) const {
  const TraceScope scope("match");
  std::vector<std::uint8_t> taken = excluded(frame);
  for (const Match& match : known) {
    taken[match.keypoint] = 1;
    in_view[local_map_->index(match.landmark)] = 1;
  }
  const LandmarkProjector view(camera_, pyramid_, T_world_camera);
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
    matches.push_back({*found[q], landmark.id, landmark.p_world, 1});
  }
  return matches;
}

std::optional<Tracker::Estimate> Tracker::solve(const Features& features, const Pose& guess,
                                                const std::vector<Match>& matches,
                                                int min_inliers) const {
  std::vector<PoseObservation> observations;
  observations.reserve(matches.size());
  for (const Match& match : matches) {
    const Keypoint& k = features.keypoints[match.keypoint];
    observations.push_back({match.p_world, k.u, k.v, k.depth,
                            static_cast<float>(pyramid_.scale(k.level)), match.weight});
  }
  const PoseSolution solution = solve_pose(camera_, guess, observations);
  if (!solution.well_posed || solution.inliers < min_inliers) return std::nullopt;
  Estimate estimate{solution.T_world_camera, {}};
  for (std::size_t i = 0; i < matches.size(); ++i) {
    if (solution.inlier[i]) estimate.matches.push_back(matches[i]);
  }
  return estimate;
}

/// What the frame shows of each landmark that should be in view: the landmark itself, something
/// nearer that covers it (which says nothing of it), or that the place where it was is empty.
void Tracker::count_sightings(const Frame& frame, const Estimate& estimate,
                              const std::vector<char>& in_view) {
  const TraceScope scope("visibility_counts");
  const Pose T_camera_world = estimate.T_world_camera.inverse();
  const auto memory = static_cast<float>(options_.landmark_memory);
  const auto note = [&](std::size_t i, float log_odds) {
    static_log_odds_[i] += (1 - memory) * (std::clamp(log_odds, -6.0F, 6.0F) - static_log_odds_[i]);
  };
  for (std::size_t i = 0; i < in_view.size(); ++i) {
    if (!in_view[i]) continue;
    const Sight sight = sight_of(T_camera_world * local_map_->landmarks[i].p_world, *frame.cells);
    predicted_[i] += sight != Sight::kCovered;
    if (sight == Sight::kSeenThrough) note(i, kEmptyPlace);
  }
  const auto& measured = frame.evidence.measured_log_odds.empty()
                             ? frame.evidence.static_log_odds
                             : frame.evidence.measured_log_odds;
  for (const Match& match : estimate.matches) {
    const std::size_t i = local_map_->index(match.landmark);
    ++found_[i];
    note(i, measured[match.keypoint]);
  }
}

std::vector<VisibilityCount> Tracker::take_sightings() {
  std::vector<VisibilityCount> visibility_counts = std::move(sightings_);
  sightings_.clear();
  for (std::size_t i = 0; i < predicted_.size(); ++i) {
    if (predicted_[i] > 0) {
      visibility_counts.push_back(
          {local_map_->landmarks[i].id, predicted_[i], found_[i], static_log_odds_[i]});
      predicted_[i] = found_[i] = 0;
    }
  }
  return visibility_counts;
}

}  // namespace stillmap
