// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/tracker.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/keypoint_depths.hpp"
#include "stillmap/geometry/contradiction.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/track/moving_majority.hpp"
#include "stillmap/track/odometry.hpp"
#include "stillmap/track/reference_keyframe_tracking.hpp"
#include "stillmap/track/relocalization_tracking.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns a reason for having no pose, preceded by the share of moving keypoints if that is large.
std::string explain_loss(const std::string& reason, const Frame& frame) {
  const auto& weight = frame.evidence.weight;
  const auto moving = std::count(weight.begin(), weight.end(), 0.0F);
  if (10 * moving < 7 * std::ssize(weight) || weight.empty()) return reason;
  return fmt::format("everything seems to move ({} of {} keypoints): {}", moving, weight.size(),
                     reason);
}

std::shared_ptr<TrackedFrame> without_pose(const FramePtr& frame, TrackState state,
                                           std::string reason) {
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->state = state;
  result->reason = std::move(reason);
  result->landmarks.assign(frame->features->size(), LandmarkId{});
  return result;
}

/// Returns the mean of two motions, weighted by their information.
MotionPrior mean(const MotionPrior& a, const MotionPrior& b) {
  const Matrix6d information = a.information + b.information;
  const Vector6d difference = (a.T_previous_camera.inverse() * b.T_previous_camera).log();
  const Vector6d step = information.ldlt().solve(b.information * difference);
  return {a.T_previous_camera * Pose::exp(step), information};
}

/// Returns the frame without its measured motion, which a wrong pose decided.
std::shared_ptr<Frame> without_measured_motion(const Frame& frame) {
  auto relabeled = std::make_shared<Frame>(frame);
  relabeled->evidence = evidence_of_classes(frame);
  return relabeled;
}

/// Root mean square motion of the first frame's keypoints during its exposure up to which a map is
/// kept [pixels]: the accuracy of a keypoint.
constexpr double kMaxStartMotion = 1;

/// Number of frames in a map up to which measured motion may be false: its landmarks are few, so
/// that a pose may be wrong enough to make the background seem to move. In old maps people who fill
/// the view would be taken for false motion (crowd).
constexpr int kYoungMapFrames = 40;
/// Motion is false if without it at least so many times as many landmarks agree with the pose, and
/// the standard deviation of its position is at most this share: in fast turns of fr1_rpy 1.3 to
/// 2.1 and 0.3 to 0.6. Where people fill the view of a young map the share is 0.7 to 0.95 (crowd).
/// Fewer moving keypoints than kLeastFalseShare do not matter [0..1].
constexpr double kLeastFalseShare = 0.2, kFalseMotionGain = 1.3, kFalseMotionSigma = 0.6;

/// Share of the keypoints that show landmarks from which a camera at rest needs no more keyframes
/// [0..1].
constexpr double kEnoughAtRest = 0.5;

/// Least share of the landmarks in view that agree with the pose of a camera that was lost, as for
/// loops [0..1].
constexpr double kLeastFoundShare = 0.25;

}  // namespace

Tracker::Tracker(const Camera& camera, const PyramidShape& pyramid, const TrackerOptions& options,
                 TrackerStart start)
    : model_{camera, pyramid},
      options_(options),
      start_(start),
      extend_(start != TrackerStart::kInMapOnly),
      calibration_(camera.shutter.value_or(options.shutter)),
      keyframe_policy_(options.keyframes, camera.depth_sensor),
      new_map_policy_(options.new_map),
      statistics_(options.statistics),
      gyro_(options.gyroscope ? camera.imu : std::nullopt),
      dead_reckoning_(options.dead_reckoning ? camera : Camera()) {
  if (options.repeats != RepeatRule::kNone) vocabulary_ = Vocabulary::built_in();
}

std::vector<Finding> Tracker::findings() const {
  std::vector<Finding> findings = dead_reckoning_.findings();
  const std::optional<Finding> gyroscope = gyro_.finding();
  if (!gyroscope) return findings;
  // A wrong gyroscope makes the accelerations wrong, too.
  std::erase_if(findings, [](const Finding& f) { return f.code == "accelerometer-unlike"; });
  findings.insert(findings.begin(), *gyroscope);
  return findings;
}

void Tracker::predict_motion(const RgbdFrame& image) {
  state_.motion_prior.reset();
  dead_reckoning_.propagate(image, gyro_.contradicted());
  if (!state_.previous || frames_lost_ > 0) return;
  const double before = state_.previous->frame->timestamp();
  const auto rotation = gyro_.motion(image, before, state_.previous->covariance);
  const auto expected = dead_reckoning_.expected();
  state_.motion_prior = rotation;
  if (expected) {
    state_.motion_prior = MotionPrior{state_.T_world_previous.inverse() * expected->T_world_camera,
                                      expected->covariance.inverse()};
    if (rotation) state_.motion_prior = mean(*state_.motion_prior, *rotation);
  }
  if (!rotation) return;
  const Pose next(rotation->T_previous_camera.quaternion(), state_.T_previous_next.translation());
  state_.twist = next.log() / (image.timestamp - before);
}

Vector6d Tracker::twist_of(const RgbdFrame& image,
                           const std::optional<InitialPose>& initial) const {
  if (!state_.previous || frames_lost_ > 0) return Vector6d::Zero();
  if (!initial) return state_.twist;
  const double dt = image.timestamp - state_.previous->frame->timestamp();
  return (state_.T_world_previous.inverse() * initial->estimate.T_world_camera).log() / dt;
}

void Tracker::compensate_motion(Frame& frame, const std::optional<InitialPose>& initial,
                                const LocalMapPtr& local_map) const {
  frame.twist = twist_of(*frame.image, initial);
  const ShutterTiming& timing = calibration_.timing();
  if (options_.compensate_exposure)
    frame.exposure = {frame.twist, {timing.readout, frame.image->depth_delay + timing.depth_delay}};
  const MotionCompensation compensation(*frame.image, model_.camera, frame.twist);
  frame.features =
      options_.compensate_exposure && compensation.has_effect(timing)
          ? std::make_shared<Features>(compensation.features(*frame.recorded_features, timing))
          : frame.recorded_features;
  frame.depth_error = local_map ? local_map->depth_error : nullptr;
  frame.features = without_depth_error(frame.features, frame.depth_error, nullptr, model_.camera);
}

std::optional<InitialPose> Tracker::predict_pose(const Features& features,
                                                 const LocalMapPtr& local_map,
                                                 const std::vector<float>& weights) {
  const TraceScope scope(span::kInitialPose);
  if (!local_map || !state_.previous) return std::nullopt;
  if (local_map != state_.local_map) adopt(local_map);
  if (frames_lost_ > 0) return std::nullopt;
  note_rest(features);
  auto pose =
      track_previous_frame(model_, state_, features, weights, options_.previous_frame_points);
  if (!pose) return std::nullopt;
  EgoMotion motion = ego_motion(features, *pose);
  return InitialPose{std::move(pose->estimate), std::move(motion)};
}

/// Takes the pose of a camera at rest as the prior of its motion, in place of that by IMU or
/// wheels.
void Tracker::note_rest(const Features& features) {
  if (!options_.rest) return;
  const auto rest = rest_.pose(model_, features, *state_.local_map);
  state_.at_rest = rest.has_value();
  if (!rest) return;
  state_.motion_prior =
      MotionPrior{state_.T_world_previous.inverse() * rest->T_world_camera, rest->information};
}

TrackedFramePtr Tracker::track(const FramePtr& frame, const std::optional<InitialPose>& initial,
                               const LocalMapPtr& local_map,
                               const std::optional<RelocalizationResult>& found) {
  const TraceScope scope(span::kPose);
  if (!local_map || !state_.previous) return track_without_map(frame, found);
  if (local_map != state_.local_map) adopt(local_map);
  if (initial && started_in_motion(*frame)) return restart_map(frame, *initial);

  if (frames_lost_ > 0) note_rest(*frame->features);
  if (const auto pose = pose_of_lost(frame)) return tracked(frame, *pose, false);
  const std::optional<PoseEstimate> first =
      initial ? initial->estimate
              : track_reference_keyframe(model_, *local_map, state_.T_world_previous, *frame);
  if (first) {
    const auto pose = pose_in_map(*frame, *first, initial.has_value());
    if (pose && agrees_with_prediction(*pose)) {
      if (const auto motion = motion_against_map(frame, *pose)) return replace_map(*frame, *motion);
      calibrate_shutter(frame, initial, *pose);
      if (auto still = pose_without_motion(*frame, *first, *pose))
        return tracked(still->frame, still->pose, false);
      return tracked(frame, *pose, false);
    }
  }
  if (found) {
    if (auto result = relocalized(frame, *found, initial)) return result;
  }
  if (initial && !extend_ && options_.tracked_by_odometry) {
    const auto odometry = track_by_odometry(model_, *frame, initial->estimate);
    if (odometry) return tracked_by_odometry(frame, *odometry);
  }
  const std::string reason =
      first ? fmt::format("fewer than {} landmarks agree on a pose", options_.min_inliers)
            : "too few keypoints match the previous frame and the newest keyframe";
  return lost(frame, explain_loss(reason, *frame));
}

/// Returns the pose by the points of the previous frame as a prior, in a map that is not extended
/// and of which too few landmarks are in view for a pose by them alone; none if most keypoints
/// move.
std::optional<PosePrior> Tracker::odometry_prior(const Frame& frame,
                                                 const PoseEstimate& initial) const {
  constexpr double kAlike = 4;  // factor of the variance, for errors that the points share
  const auto is_landmark = [](const PointMatch& match) { return match.landmark.valid(); };
  if (extend_ || !options_.tracked_by_odometry || state_.motion_prior ||
      moving_share(frame.evidence.weight) >= kMovingMajority ||
      std::ranges::count_if(initial.matches, is_landmark) >= kSureInliers ||
      std::ssize(initial.matches) < 2 * kSureInliers)
    return std::nullopt;
  return PosePrior{initial.T_world_camera, (kAlike * initial.covariance).inverse()};
}

/// Returns the pose by the landmarks of the map; none if they contradict the odometry, as where the
/// map ends and many of their matches are wrong.
/// @param continues  `first` is a pose by the previous frame
std::optional<LocalMapPose> Tracker::pose_in_map(const Frame& frame, const PoseEstimate& first,
                                                 bool continues) const {
  const auto pose_near = [&](const std::optional<PosePrior>& prior) {
    return refine_in_local_map(model_, *state_.local_map, frame, first, options_.min_inliers,
                               options_.previous_frame_points, prior);
  };
  auto pose = pose_near(state_.prior());
  const auto odometry = continues ? odometry_prior(frame, first) : std::nullopt;
  if (!pose || !odometry || odometry->chi2(pose->estimate.T_world_camera) < kContradiction)
    return pose;
  pose = pose_near(odometry);
  return pose && pose->estimate.contradicts_prior ? std::nullopt : pose;
}

/// Returns the frame and its pose without the measured motion of its parts, if many more landmarks
/// agree with that pose: then a wrong pose made the background seem to move.
std::optional<Tracker::Relabeled> Tracker::pose_without_motion(const Frame& frame,
                                                               const PoseEstimate& first,
                                                               const LocalMapPose& pose) const {
  if (!options_.erase_seen_through || frames_in_map_ >= kYoungMapFrames ||
      moving_share(frame.evidence.weight) < kLeastFalseShare)
    return std::nullopt;
  const FramePtr relabeled = without_measured_motion(frame);
  const auto still =
      refine_in_local_map(model_, *state_.local_map, *relabeled, first, options_.min_inliers,
                          options_.previous_frame_points, state_.prior());
  const auto inliers = [](const LocalMapPose& p) {
    return static_cast<double>(p.estimate.matches.size());
  };
  const auto sigma = [](const LocalMapPose& p) {  // of the position [m]
    return std::sqrt(p.estimate.covariance.topLeftCorner<3, 3>().trace());
  };
  if (!still || still->estimate.contradicts_prior ||
      inliers(*still) < kFalseMotionGain * inliers(pose) ||
      sigma(*still) > kFalseMotionSigma * sigma(pose))
    return std::nullopt;
  return Relabeled{relabeled, *still};
}

/// Returns the pose of a lost camera from the landmarks near its pose at rest, or that by IMU or
/// wheels. What covers most of them would decide the poses of the next frames, so that there is
/// none until it is gone.
std::optional<LocalMapPose> Tracker::pose_of_lost(const FramePtr& frame) const {
  if (frames_lost_ == 0) return std::nullopt;
  // Otherwise the images decide alone: wheels that slip unnoticed would have them confirm a wrong
  // pose.
  const auto rest = state_.at_rest ? state_.prior() : std::nullopt;
  std::optional<Pose> expected_pose;
  if (rest)
    expected_pose = rest->T_world_camera;
  else if (const auto predicted = dead_reckoning_.pose())
    expected_pose = predicted->T_world_camera;
  if (!expected_pose || is_occluded(model_, *state_.local_map, *expected_pose, *frame))
    return std::nullopt;
  auto pose = refine_in_local_map(model_, *state_.local_map, *frame, {*expected_pose, {}},
                                  options_.min_inliers, false, rest);
  if (!pose) return std::nullopt;
  const auto expected = std::count(pose->expected.begin(), pose->expected.end(), 1);
  const bool agrees =
      agrees_with_prediction(*pose) && static_cast<double>(pose->estimate.matches.size()) >=
                                           kLeastFoundShare * static_cast<double>(expected);
  return agrees ? pose : std::nullopt;
}

/// Returns false for a pose of a lost camera that contradicts that by IMU or wheels: somebody near
/// may decide it.
bool Tracker::agrees_with_prediction(const LocalMapPose& pose) const {
  const auto predicted = frames_lost_ > 0 ? dead_reckoning_.pose() : std::nullopt;
  if (!predicted) return true;
  const PosePrior prior{predicted->T_world_camera, predicted->covariance.inverse()};
  return prior.chi2(pose.estimate.T_world_camera) < kContradiction;
}

/// Does nothing if the timing is known, or for a frame that does not continue the previous one.
void Tracker::calibrate_shutter(const FramePtr& frame, const std::optional<InitialPose>& initial,
                                const LocalMapPose& pose) {
  if (!options_.compensate_exposure || model_.camera.shutter || !frame->recorded_features) return;
  if (initial) {
    calibration_.add(model_, frame, pose.estimate.T_world_camera, initial->motion.previous);
  } else {
    calibration_.interrupt();
  }
}

TrackedFramePtr Tracker::track_without_map(const FramePtr& frame,
                                           const std::optional<RelocalizationResult>& found) {
  if (start_ == TrackerStart::kNewMap && extend_) return start_map(frame, state_.T_world_previous);
  if (found) {
    if (auto result = relocalized(frame, *found, std::nullopt)) return result;
  }
  const bool loaded = start_ != TrackerStart::kNewMap;
  return lost(frame, loaded ? "not recognized yet in the map that was loaded" : "there is no map");
}

/// Returns null, and leaves the state as it is, if the frame does not confirm the relocalization.
TrackedFramePtr Tracker::relocalized(const FramePtr& frame, const RelocalizationResult& found,
                                     const std::optional<InitialPose>& initial) {
  auto confirmed = track_from_relocalization(model_, found, *frame, options_.min_inliers);
  if (!confirmed) return nullptr;
  statistics_.adopt(found.local_map);
  state_ = std::move(confirmed->state);
  rest_ = {};
  start_verification_ = {};
  if (initial) {
    const Pose T_camera_world = confirmed->pose.estimate.T_world_camera.inverse();
    T_odometry_world_ = T_odometry_world_ * initial->estimate.T_world_camera * T_camera_world;
  }
  return tracked(frame, confirmed->pose, true);
}

/// Returns a frame that starts a map.
std::shared_ptr<TrackedFrame> Tracker::starting_frame(const FramePtr& frame,
                                                      const Pose& T_world_camera) const {
  auto result = without_pose(frame, TrackState::kStarted, "");
  result->T_world_camera = T_world_camera;
  result->T_odometry_world = T_odometry_world_;
  result->proposal = KeyframeProposal{frame, KeyframeId{}, T_world_camera, result->landmarks, {}};
  return result;
}

/// @param T_world_camera  known best: the world of the map continues that of the previous one
TrackedFramePtr Tracker::start_map(const FramePtr& frame, const Pose& T_world_camera) {
  std::string reason = reason_against_new_map(*frame, model_.camera);
  if (!reason.empty()) return without_pose(frame, TrackState::kWaiting, std::move(reason));
  auto result = starting_frame(frame, T_world_camera);
  if (state_.local_map && frames_in_map_ < kMinMapFrames)
    result->proposal->abandoned = state_.local_map->reference;
  begin_map(frame, result, Pose());
  end_loss();
  return result;
}

/// Returns whether the previous frame started the map, and the motion of the camera, known since
/// this frame, moved the keypoints from which it was made.
bool Tracker::started_in_motion(const Frame& frame) const {
  const Frame& first = *state_.previous->frame;
  return options_.compensate_exposure && first.recorded_features && !state_.velocity_known() &&
         frame.index() == first.index() + 1 &&
         reason_against_new_map(frame, model_.camera).empty() &&
         MotionCompensation(*first.image, model_.camera, frame.twist)
                 .rms(*first.recorded_features, calibration_.timing()) > kMaxStartMotion;
}

/// Returns the pose T_newest_earlier of a frame, tracked backward from the newest one with the
/// newest velocity.
Pose Tracker::tracked_backward(const Frame& earlier, const Pose& T_world_earlier) const {
  TrackerState state = state_;
  state.motion_prior.reset();  // of the forward motion
  const Pose T_newest_world = state.T_world_previous.inverse();
  state.T_previous_next = T_newest_world * T_world_earlier;
  const MotionCompensation compensation(*earlier.image, model_.camera, state.twist);
  const auto pose = track_previous_frame(
      model_, state, compensation.features(*earlier.recorded_features, calibration_.timing()), {},
      options_.previous_frame_points);
  return pose ? T_newest_world * pose->estimate.T_world_camera : state.T_previous_next;
}

/// Starts the map again at its second frame, whose keypoints are compensated for the camera's
/// motion, unlike those of the first. The first frame is tracked backward.
TrackedFramePtr Tracker::restart_map(const FramePtr& frame, const InitialPose& initial) {
  const TrackedFramePtr first = state_.previous;
  const Pose T_world_first = state_.T_world_previous;
  auto result = starting_frame(frame, initial.estimate.T_world_camera);
  result->proposal->replaced = state_.local_map->reference;
  state_.previous = result;
  state_.T_world_previous = *result->T_world_camera;
  state_.twist = frame->twist;
  const Pose T_newest_first = tracked_backward(*first->frame, T_world_first);
  result->earlier = {first->frame->index(), T_newest_first};
  state_.T_previous_next = T_newest_first.inverse();
  // The first frame keeps its pose in the world.
  state_.T_world_previous = T_world_first * state_.T_previous_next;
  result->T_world_camera = state_.T_world_previous;
  result->proposal->T_reference_camera = state_.T_world_previous;
  start_verification_.begin(frame, state_.T_world_previous);
  dead_reckoning_.correct({frame->timestamp(), state_.T_world_previous}, false);
  return result;
}

/// Returns whether a pose agrees with the motion of the wheels, or with a camera at rest.
bool Tracker::is_confirmed(const PoseEstimate& estimate) const {
  return (dead_reckoning_.by_wheels() || state_.at_rest) && !estimate.contradicts_prior;
}

/// Returns another motion of the camera, if the map was started on moving objects.
std::optional<StartVerification::Motion> Tracker::motion_against_map(const FramePtr& frame,
                                                                     const LocalMapPose& pose) {
  if (!options_.erase_seen_through || is_confirmed(pose.estimate)) return std::nullopt;
  return start_verification_.contradiction(model_, frame, pose.estimate.T_world_camera);
}

/// Replaces a map that was started on moving objects by one that starts with this frame, from what
/// stands in it.
TrackedFramePtr Tracker::replace_map(const Frame& frame, const StartVerification::Motion& motion) {
  const auto relabeled = without_measured_motion(frame);
  for (std::size_t i = 0; i < motion.stands.size(); ++i)
    if (motion.stands[i] == 0) relabeled->evidence.weight[i] = 0;
  auto result = starting_frame(relabeled, motion.T_world_camera);
  result->proposal->replaced = state_.local_map->reference;
  begin_map(relabeled, result, motion.T_previous_next);
  return result;
}

/// Takes the frame as the first of its map.
void Tracker::begin_map(const FramePtr& frame, const TrackedFramePtr& first,
                        const Pose& T_previous_next) {
  state_.previous = first;
  state_.T_world_previous = *first->T_world_camera;
  state_.T_previous_next = T_previous_next;
  state_.twist.setZero();
  frames_in_map_ = 1;
  rest_.add(*first);
  consistency_.reset();
  filter_.reset();
  start_verification_.begin(frame, state_.T_world_previous);
  dead_reckoning_.correct({frame->timestamp(), state_.T_world_previous}, false);
}

TrackedFramePtr Tracker::lost(const FramePtr& frame, const std::string& reason) {
  ++frames_lost_;
  if (const auto predicted = dead_reckoning_.pose()) return lost_at(frame, reason, *predicted);
  if (extend_ && !rest_.may_last(frame->timestamp()) &&
      new_map_policy_.wants_map(model_, state_.local_map, state_.T_world_previous, *frame)) {
    return start_map(frame, T_world_lost_.value_or(state_.T_world_previous));
  }
  return without_pose(frame, TrackState::kLost, reason);
}

/// Continues the map with what a lost camera sees, if that stands still, or returns the frame with
/// its pose by IMU or wheels.
TrackedFramePtr Tracker::lost_at(const FramePtr& frame, const std::string& reason,
                                 const UncertainPose& predicted) {
  const Pose& T_world_camera = predicted.T_world_camera;
  const auto velocity_error =
      still_surface_.add(model_, frame, T_world_camera, dead_reckoning_.velocity_sigma());
  if (velocity_error && extend_ && reason_against_new_map(*frame, model_.camera).empty() &&
      !is_occluded(model_, *state_.local_map, T_world_camera, *frame)) {
    dead_reckoning_.correct_velocity(*velocity_error);
    const UncertainPose corrected = dead_reckoning_.pose().value_or(predicted);
    if (!is_certain(corrected)) return start_map(frame, corrected.T_world_camera);
    return continue_map(frame, corrected, T_world_camera);
  }
  auto result = without_pose(frame, TrackState::kPredicted, reason);
  result->T_previous_camera =
      T_world_lost_.value_or(state_.T_world_previous).inverse() * T_world_camera;
  T_world_lost_ = result->T_world_predicted = T_world_camera;
  result->reference = state_.local_map->reference;
  result->T_reference_camera =
      state_.local_map->keyframes.front().T_world_camera.inverse() * T_world_camera;
  result->covariance = predicted.covariance;
  return result;
}

/// Makes the frame a keyframe of the map, none of whose landmarks it shows.
/// @param T_world_predicted  its pose as those before were predicted
TrackedFramePtr Tracker::continue_map(const FramePtr& frame, const UncertainPose& pose,
                                      const Pose& T_world_predicted) {
  const auto result = frame_at(frame, {pose.T_world_camera, {}, pose.covariance});
  result->T_world_predicted = T_world_predicted;
  if (T_world_lost_) result->T_previous_camera = T_world_lost_->inverse() * T_world_predicted;
  result->proposal = KeyframeProposal{frame, result->reference, result->T_reference_camera,
                                      result->landmarks, statistics_.take()};
  result->proposal->unseen = true;
  last_proposed_ = frame->index();
  consistency_.reset();
  filter_.reset();
  set_previous(result);
  return result;
}

/// Returns a frame with a pose and the landmarks that agree with it.
std::shared_ptr<TrackedFrame> Tracker::frame_at(const FramePtr& frame,
                                                const PoseEstimate& estimate) const {
  const LocalKeyframe& reference = state_.local_map->keyframes.front();
  auto result = std::make_shared<TrackedFrame>();
  result->frame = frame;
  result->state = TrackState::kTracking;
  result->T_world_camera = estimate.T_world_camera;
  result->T_odometry_world = T_odometry_world_;
  result->reference = state_.local_map->reference;
  result->T_reference_camera = reference.T_world_camera.inverse() * estimate.T_world_camera;
  result->landmarks.assign(frame->features->size(), LandmarkId{});
  for (const PointMatch& match : estimate.matches)
    result->landmarks[match.keypoint] = match.landmark;
  result->inliers = static_cast<int>(estimate.matches.size());
  result->covariance = estimate.covariance;
  return result;
}

TrackedFramePtr Tracker::tracked(const FramePtr& frame, const LocalMapPose& pose,
                                 bool relocalized) {
  statistics_.count(*frame, pose);
  const LocalMap& local_map = *state_.local_map;
  const auto result = frame_at(frame, pose.estimate);
  result->relocalized = relocalized;
  result->confirmed = is_confirmed(pose.estimate);
  if (!relocalized) result->T_previous_camera = motion_since_previous(pose.estimate.T_world_camera);
  if (model_.camera.imu) compare_gyroscope(*result, pose.estimate);
  if (!relocalized) note_prediction(*result);
  judge(*result);
  dead_reckoning_.correct({frame->timestamp(), pose.estimate.T_world_camera, result->covariance},
                          !relocalized);
  result->up = dead_reckoning_.up_in_camera();
  frames_in_map_ = relocalized ? std::max(kMinMapFrames, kYoungMapFrames) : frames_in_map_ + 1;

  const std::size_t newest = std::max(last_proposed_, local_map.made_for_frame);
  // Another keyframe of the same view would tell nothing new, and its pose would not be as exact.
  const bool known_view =
      state_.at_rest &&
      result->inliers >= kEnoughAtRest * static_cast<double>(frame->features->size());
  if (!result->contradicts_motion && !known_view &&
      keyframe_policy_.wants_keyframe(*frame, pose.estimate.T_world_camera, result->landmarks,
                                      local_map, frame->index() - newest)) {
    result->proposal = KeyframeProposal{frame, result->reference, result->T_reference_camera,
                                        result->landmarks, statistics_.take()};
    if (vocabulary_) {
      result->proposal->repeated =
          repeated_landmarks(local_map, pose.estimate.matches, options_.repeats, *vocabulary_);
    }
    last_proposed_ = frame->index();
  }
  rest_.add(*result);
  state_.odometry_points.clear();
  set_previous(result);
  return result;
}

/// Passes the rotation by the images alone, which the gyroscope has no part in.
/// @param by_both  the frame's pose
void Tracker::compare_gyroscope(const TrackedFrame& tracked, const PoseEstimate& by_both) {
  const auto before = std::exchange(T_world_by_images_, std::nullopt);
  if (!tracked.T_previous_camera) return;
  const auto pose = estimate_pose(model_, *tracked.frame->features, by_both.T_world_camera,
                                  by_both.matches, kMinInliers);
  if (!pose) return;
  T_world_by_images_ = pose->T_world_camera;
  if (!before) return;
  const auto mounted = gyro_.compare(*tracked.frame->image, before->inverse() * *T_world_by_images_,
                                     pose->covariance);
  if (mounted) dead_reckoning_.mount(*mounted);
}

TrackedFramePtr Tracker::tracked_by_odometry(const FramePtr& frame, const PoseEstimate& estimate) {
  const auto result = frame_at(frame, estimate);
  result->tracked_by_odometry = true;
  result->T_previous_camera = motion_since_previous(estimate.T_world_camera);
  judge(*result);
  state_.odometry_points.assign(frame->features->size(), std::nullopt);
  for (const PointMatch& match : estimate.matches)
    state_.odometry_points[match.keypoint] = match.p_world;
  set_previous(result);
  return result;
}

/// Notes the pose by dead reckoning of the first frame with a pose after frames without.
void Tracker::note_prediction(TrackedFrame& tracked) const {
  const auto predicted = T_world_lost_ ? dead_reckoning_.pose() : std::nullopt;
  if (!predicted) return;
  tracked.T_world_predicted = predicted->T_world_camera;
  tracked.T_previous_camera = T_world_lost_->inverse() * predicted->T_world_camera;
}

/// Returns T_previous_camera; none if the camera was lost.
std::optional<Pose> Tracker::motion_since_previous(const Pose& T_world_camera) const {
  if (frames_lost_ > 0) return std::nullopt;
  return state_.T_world_previous.inverse() * T_world_camera;
}

/// Compares a pose with the motion of the camera before it, and filters it by that motion.
void Tracker::judge(TrackedFrame& tracked) {
  if (tracked.relocalized || frames_lost_ > 0) filter_.reset();
  if (tracked.relocalized) consistency_.reset();
  const Pose T_world_camera = *tracked.T_world_camera;
  const double timestamp = tracked.frame->timestamp();
  const auto enlarged =
      options_.consistency_test
          ? consistency_.contradiction({timestamp, T_world_camera, tracked.covariance})
          : std::nullopt;
  if (enlarged) {
    tracked.covariance = *enlarged;
    tracked.contradicts_motion = true;
  }
  if (!options_.filter_poses) return;
  tracked.T_camera_filtered =
      T_world_camera.inverse() * filter_.add({timestamp, T_world_camera, tracked.covariance});
}

void Tracker::set_previous(const TrackedFramePtr& tracked) {
  const bool consecutive =
      frames_lost_ == 0 && tracked->frame->index() == state_.previous->frame->index() + 1;
  state_.T_previous_next =
      consecutive ? state_.T_world_previous.inverse() * *tracked->T_world_camera : Pose();
  const double dt = tracked->frame->timestamp() - state_.previous->frame->timestamp();
  state_.twist = state_.T_previous_next.log() / dt;
  state_.T_world_previous = *tracked->T_world_camera;
  state_.previous = tracked;
  end_loss();
}

/// Notes that the camera has a pose by its images.
void Tracker::end_loss() {
  frames_lost_ = 0;
  new_map_policy_.reset();
  still_surface_.reset();
  T_world_lost_.reset();
}

/// Takes over a new snapshot of the map. The previous frame moves along with its keyframe.
void Tracker::adopt(const LocalMapPtr& local_map) {
  const TraceScope scope("new snapshot");
  statistics_.adopt(local_map);
  state_.local_map = local_map;
  const auto pose = pose_in(*local_map, *state_.previous);
  if (!pose) return;
  const Pose T_corrected_world = *pose * state_.T_world_previous.inverse();
  consistency_.move(T_corrected_world);
  filter_.move(T_corrected_world);
  start_verification_.move(T_corrected_world);
  dead_reckoning_.move(T_corrected_world);
  T_odometry_world_ = T_odometry_world_ * T_corrected_world.inverse();
  for (std::optional<Pose>* moved : {&T_world_lost_, &T_world_by_images_})
    if (*moved) *moved = T_corrected_world * **moved;
  state_.T_world_previous = *pose;
}

EgoMotion Tracker::ego_motion(const Features& features, const PreviousFramePose& pose) const {
  EgoMotion motion{
      T_odometry_world_ * pose.estimate.T_world_camera, T_odometry_world_ * state_.T_world_previous,
      std::vector<std::int32_t>(features.size(), -1), std::vector<float>(features.size(), 0.0F)};
  for (const FrameMatch& m : pose.matches) {
    motion.previous[m.match.keypoint] = static_cast<std::int32_t>(m.previous);
    if (!m.match.landmark.valid()) continue;
    motion.landmark_log_odds[m.match.keypoint] = statistics_.static_log_odds(m.match.landmark);
  }
  return motion;
}

}  // namespace stillmap
