// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/frame_log.hpp"

#include "stillmap/track/moving_background.hpp"
#include "stillmap/track/moving_majority.hpp"

#include <algorithm>
#include <cmath>
#include <ranges>
#include <utility>

namespace stillmap {
namespace {

/// Longest time without a pose on an uninterrupted path [s].
constexpr double kMaxPause = 0.5;

/// Returns the share of moving keypoints outside the boxes of detected objects [0..1]: the pose
/// does not depend on a detected object, however much of the image it fills. Of all keypoints if
/// fewer than 100 are outside.
double undetected_moving_share(const Frame& frame) {
  constexpr std::size_t kFewest = 100;
  const std::vector<float>& weight = frame.evidence.weight;
  if (!frame.instances) return moving_share(weight);
  std::vector<float> outside;
  for (std::size_t i = 0; i < weight.size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    const cv::Point pixel(cvRound(k.u), cvRound(k.v));
    const auto& instances = frame.instances->instances;
    const auto contains_it = [&](const Instance& object) { return object.box.contains(pixel); };
    if (std::none_of(instances.begin(), instances.end(), contains_it)) outside.push_back(weight[i]);
  }
  return moving_share(outside.size() < kFewest ? weight : outside);
}

/// Returns the component with the pose of a frame; none without a pose or in a dropped map.
std::optional<std::uint32_t> component_in(const Map& map, const FrameRecord& record) {
  const KeyframeId reference = map.current_keyframe(record.reference);
  if (!record.has_pose() || !reference.valid()) return std::nullopt;
  return map.at(reference).component;
}

}  // namespace

std::optional<Pose> pose_in(const Map& map, const FrameRecord& record) {
  if (!component_in(map, record)) return std::nullopt;
  return map.resolve(record.reference, record.T_reference_camera);
}

std::map<std::uint32_t, int> frames_by_component(const std::vector<FrameRecord>& frames) {
  std::map<std::uint32_t, int> number;
  for (const FrameRecord& frame : frames) {
    if (frame.component) ++number[*frame.component];
  }
  return number;
}

Uncertainty uncertainty_of(const TrackedFrame& tracked) {
  const Frame& frame = *tracked.frame;
  if (tracked.contradicts_motion || background_moves(*frame.features, frame.evidence.weight))
    return Uncertainty::kContradiction;
  return undetected_moving_share(frame) > kUncertainMajority ? Uncertainty::kMinority
                                                             : Uncertainty::kNone;
}

std::optional<Eigen::Vector3d> upward(const std::vector<FrameRecord>& frames,
                                      const Trajectory& poses) {
  for (const FrameRecord& frame : std::views::reverse(frames)) {
    if (frame.up.isZero()) continue;
    const auto pose = std::ranges::find(poses, frame.timestamp, &StampedPose::timestamp);
    if (pose == poses.end()) return std::nullopt;
    return Eigen::Vector3d(pose->T_world_camera.quaternion() * frame.up);
  }
  return std::nullopt;
}

void FrameLog::add(const TrackedFrame& tracked, const TrackingTimes& times) {
  const Frame& frame = *tracked.frame;
  FrameRecord record;
  record.index = frame.index();
  record.timestamp = frame.timestamp();
  record.state = tracked.state;
  record.reason = tracked.reason;
  record.reference = tracked.reference;
  record.T_reference_camera = tracked.T_reference_camera;
  record.keypoints = static_cast<int>(frame.features->size());
  record.moving_keypoints = static_cast<int>(
      std::count(frame.evidence.weight.begin(), frame.evidence.weight.end(), 0.0F));
  record.inliers = tracked.inliers;
  record.covariance = tracked.covariance;
  record.T_camera_filtered = tracked.T_camera_filtered;
  record.up = tracked.up.value_or(Eigen::Vector3d::Zero());
  if (frame.instances) record.mask_age = static_cast<int>(frame.instances->age());
  record.relocalized = tracked.relocalized;
  record.tracked_by_odometry = tracked.tracked_by_odometry;
  record.uncertainty = uncertainty_of(tracked);
  record.keyframe = tracked.proposal.has_value() && extends_map_;
  record.dynamics = frame.evidence.dynamics;
  record.times = times;
  const std::scoped_lock lock(mutex_);
  if (tracked.earlier) {
    record_of(tracked.earlier->frame_index).state = TrackState::kTracking;
    earlier_[record.index] = *tracked.earlier;
  }
  if (tracked.has_pose() && tracked.T_world_predicted) correct_predicted(tracked);
  records_.push_back(std::move(record));
}

/// Distributes the error of the poses by IMU or wheels, as known with the first pose after them,
/// over these, by the square of the time since the last pose before.
void FrameLog::correct_predicted(const TrackedFrame& tracked) {
  const Pose T_world_reference = *tracked.T_world_camera * tracked.T_reference_camera.inverse();
  const Pose end = T_world_reference.inverse() * *tracked.T_world_predicted;
  const Pose& correct = tracked.T_reference_camera;
  const Eigen::Vector3d moved = correct.translation() - end.translation(),
                        turned = so3_log(correct.quaternion() * end.quaternion().conjugate());
  const auto before = std::find_if(records_.rbegin(), records_.rend(), [&](const FrameRecord& r) {
    return !r.predicted() || r.reference != tracked.reference;
  });
  if (before == records_.rend()) return;
  const double duration = tracked.frame->timestamp() - before->timestamp;
  for (auto record = records_.rbegin(); record != before; ++record) {
    const double share = std::pow((record->timestamp - before->timestamp) / duration, 2);
    const Pose& T = record->T_reference_camera;
    record->T_reference_camera =
        Pose(so3_exp(share * turned) * T.quaternion(), T.translation() + share * moved);
  }
}

std::size_t FrameLog::position(std::size_t frame_index) const {
  const auto found =
      std::lower_bound(records_.begin(), records_.end(), frame_index,
                       [](const FrameRecord& r, std::size_t index) { return r.index < index; });
  return static_cast<std::size_t>(found - records_.begin());
}

void FrameLog::settle(const std::vector<NewKeyframe>& made) {
  const std::scoped_lock lock(mutex_);
  for (const NewKeyframe& keyframe : made) {
    FrameRecord& frame = record_of(keyframe.frame_index);
    frame.reference = keyframe.id;
    frame.T_reference_camera = Pose();
    if (const auto found = earlier_.find(keyframe.frame_index); found != earlier_.end()) {
      FrameRecord& earlier = record_of(found->second.frame_index);
      earlier.reference = keyframe.id;
      earlier.T_reference_camera = found->second.T_camera_earlier;
    }
  }
}

void FrameLog::confirm(const RelocalizationResult& relocalization) {
  const std::scoped_lock lock(mutex_);
  FrameRecord& lost = record_of(relocalization.frame->index());
  lost.state = TrackState::kTracking;
  lost.reason.clear();
  lost.tracked_by_odometry = false;
  lost.reference = relocalization.local_map->reference;
  lost.T_reference_camera = relocalization.T_reference_camera;
  lost.inliers = relocalization.inliers;
}

void FrameLog::place(std::size_t frame_index, KeyframeId reference, const Pose& T_reference_camera,
                     const PoseEstimate& estimate) {
  const std::scoped_lock lock(mutex_);
  FrameRecord& frame = record_of(frame_index);
  frame.tracked_late = !frame.has_pose() || frame.predicted();
  frame.state = TrackState::kTracking;
  frame.reference = reference;
  frame.T_reference_camera = T_reference_camera;
  frame.inliers = static_cast<int>(estimate.matches.size());
  frame.covariance = estimate.covariance;
}

void FrameLog::set_final_poses(Trajectory poses) {
  const std::scoped_lock lock(mutex_);
  final_poses_ = std::make_shared<const Trajectory>(std::move(poses));
}

LoggedFrames FrameLog::copy() const {
  const std::scoped_lock lock(mutex_);
  LoggedFrames frames;
  frames.final_poses = final_poses_;
  if (!records_.empty()) frames.newest = records_.back();
  frames.placed.reserve(records_.size());
  for (const FrameRecord& r : records_) {
    if (r.has_pose()) frames.placed.push_back({r.timestamp, r.reference, r.T_reference_camera});
  }
  return frames;
}

std::map<std::size_t, Pose> FrameLog::poses(const Map& map) const {
  std::map<std::size_t, Pose> poses;
  for (const FrameRecord& record : records_) {
    if (const auto T_world_camera = pose_in(map, record))
      poses.emplace_hint(poses.end(), record.index, *T_world_camera);
  }
  return poses;
}

std::vector<std::vector<UncertainPose>> FrameLog::paths(const Map& map) const {
  std::vector<std::vector<UncertainPose>> paths;
  std::optional<std::uint32_t> component;  // of the last path
  for (const FrameRecord& record : records_) {
    const auto here = component_in(map, record);
    if (!here) continue;
    const bool goes_on =
        here == component && record.timestamp - paths.back().back().timestamp <= kMaxPause;
    if (!goes_on) paths.emplace_back();
    paths.back().push_back({record.timestamp,
                            map.resolve(record.reference, record.T_reference_camera),
                            record.covariance});
    component = here;
  }
  return paths;
}

std::vector<FrameRecord> FrameLog::records_in(const Map& map) const {
  std::vector<FrameRecord> records = records_;
  for (FrameRecord& record : records) record.component = component_in(map, record);
  return records;
}

void FrameLog::add_times_to(StageTimes& times) const {
  const auto add = [&](std::string_view stage, auto milliseconds) {
    for (const FrameRecord& record : records_) times.add(stage, milliseconds(record.times));
  };
  add("features", [](const TrackingTimes& t) { return t.features; });
  add("waiting for masks", [](const TrackingTimes& t) { return t.masks; });
  add("motion", [](const TrackingTimes& t) { return t.motion; });
  add("pose", [](const TrackingTimes& t) { return t.pose; });
  add("tracking", [](const TrackingTimes& t) { return t.total(); });
  add("waiting for network and map", [](const TrackingTimes& t) { return t.waiting; });
}

}  // namespace stillmap
