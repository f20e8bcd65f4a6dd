// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/still_surface.hpp"

#include "stillmap/track/previous_frame_tracking.hpp"

#include <algorithm>
#include <memory>

namespace stillmap {
namespace {

/// Time for which points are compared [s]. Speed from which they move, besides the error of the
/// poses' velocity [m/s], [sigma], and turn [rad/s].
constexpr double kTime = 0.3, kMaxSpeed = 0.05, kMaxSigmas = 2.5, kMaxTurn = 0.05;

/// Returns the pose of a frame by the points of an earlier one; none if too few agree.
std::optional<Pose> pose_by_points(const TrackingModel& model, const FramePtr& first,
                                   const Pose& T_world_first, const Frame& frame,
                                   const Pose& T_world_camera) {
  auto previous = std::make_shared<TrackedFrame>();
  previous->frame = first;
  previous->state = TrackState::kTracking;
  previous->landmarks.assign(first->features->size(), LandmarkId{});
  TrackerState state;
  state.previous = previous;
  state.T_world_previous = T_world_first;
  state.T_previous_next = T_world_first.inverse() * T_world_camera;
  const auto pose =
      track_previous_frame(model, state, *frame.features, frame.evidence.weight, true);
  if (!pose) return std::nullopt;
  return pose->estimate.T_world_camera;
}

}  // namespace

std::optional<Eigen::Vector3d> StillSurface::add(const TrackingModel& model, const FramePtr& frame,
                                                 const Pose& T_world_camera,
                                                 double velocity_sigma) {
  const FramePtr first = first_;
  const double seconds = first ? frame->timestamp() - first->timestamp() : 0;
  const auto seen =
      first ? pose_by_points(model, first, T_world_first_, *frame, T_world_camera) : std::nullopt;
  if (seen) {
    const Eigen::Vector3d moved = seen->translation() - T_world_camera.translation();
    const double time = std::max(seconds, kTime);
    const double max_speed = kMaxSpeed + kMaxSigmas * velocity_sigma;
    const double turned = (T_world_camera.inverse() * *seen).angle();
    if (moved.norm() < max_speed * time && turned < kMaxTurn * time)
      return seconds < kTime ? std::nullopt : std::optional<Eigen::Vector3d>(moved / seconds);
  }
  first_ = frame;
  T_world_first_ = T_world_camera;
  return std::nullopt;
}

}  // namespace stillmap
