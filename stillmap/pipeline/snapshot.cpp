// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/snapshot.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace stillmap {
namespace {

/// Returns the component that the newest frame is in; none if it has no keyframe yet.
std::optional<std::uint32_t> component_of_newest(const Map& map,
                                                 const std::vector<PlacedFrame>& frames) {
  if (frames.empty()) return std::nullopt;
  const KeyframeId keyframe = map.current_keyframe(frames.back().reference);
  if (!keyframe.valid()) return std::nullopt;
  return map.at(keyframe).component;
}

Trajectory trajectory_in(const Map& map, std::uint32_t component,
                         const std::vector<PlacedFrame>& frames) {
  Trajectory trajectory;
  for (const PlacedFrame& frame : frames) {
    const KeyframeId keyframe = map.current_keyframe(frame.reference);
    if (!keyframe.valid() || map.at(keyframe).component != component) continue;
    trajectory.push_back({frame.timestamp, map.resolve(frame.reference, frame.T_reference_camera)});
  }
  return trajectory;
}

MovingObject moving_object(int id, const std::string& class_name, const MoverSample& sample) {
  return {.id = id,
          .class_name = class_name,
          .timestamp = sample.timestamp,
          .observed = sample.observed,
          .centroid = sample.centroid,
          .velocity = sample.velocity,
          .box = sample.box};
}

PoseState pose_state(TrackState state) {
  if (state == TrackState::kWaiting) return PoseState::kNoMap;
  if (state == TrackState::kPredicted) return PoseState::kPredicted;
  return state == TrackState::kLost ? PoseState::kLost : PoseState::kTracked;
}

/// Returns whether the pose is in the world of the saved map loaded last.
bool in_saved_map(const TrackedFrame& tracked, const MapView& view) {
  const bool begins_component = tracked.proposal && !tracked.proposal->reference.valid();
  if (!tracked.T_world_filtered() || begins_component) return false;
  const LocalMapPtr& map = tracked.relocalized ? view.found->local_map : view.local_map;
  return map && map->of_saved_map;
}

}  // namespace

void add_map(const MapMaker& maker, const std::vector<PlacedFrame>& frames, Snapshot& snapshot) {
  snapshot.events = maker.events();
  const Map& map = maker.map();
  const auto component = component_of_newest(map, frames);
  if (!component) {  // A new map consists of its first frame.
    if (!frames.empty())
      snapshot.trajectory = {{frames.back().timestamp, frames.back().T_reference_camera}};
    return;
  }
  snapshot.trajectory = trajectory_in(map, *component, frames);
  for (const KeyframeId id : keyframes_of(map, *component)) {
    const Keyframe& k = map.at(id);
    snapshot.keyframes.push_back({k.frame_index, k.timestamp, k.T_world_camera});
  }
  map.for_each_landmark([&](const Landmark& l) {
    if (map.at(l.observations.front().keyframe).component != *component) return;
    snapshot.landmarks.push_back({l.p_world, static_probability(l.static_log_odds),
                                  static_cast<int>(l.observations.size())});
  });
}

PoseUpdate pose_update(const FrameRecord& newest, const Snapshot& snapshot) {
  PoseUpdate update{.frame_index = newest.index,
                    .timestamp = newest.timestamp,
                    .state = pose_state(newest.state),
                    .T_world_camera = std::nullopt,
                    .reason = newest.reason,
                    .inliers = newest.inliers,
                    .relocalized = newest.relocalized,
                    .certain = !newest.uncertain(),
                    .covariance = newest.covariance};
  if (newest.has_pose() && !snapshot.trajectory.empty())
    update.T_world_camera = snapshot.trajectory.back().T_world_camera * newest.T_camera_filtered;
  return update;
}

PoseUpdate pose_update(const TrackedFrame& tracked, const MapView& view) {
  const bool searched = !tracked.has_pose() && !view.not_found.empty();
  return {.frame_index = tracked.frame->index(),
          .timestamp = tracked.frame->timestamp(),
          .state = pose_state(tracked.state),
          .T_world_camera = tracked.T_world_filtered(),
          .T_previous_camera = tracked.T_previous_camera,
          .reason = searched ? tracked.reason + "; " + view.not_found : tracked.reason,
          .inliers = tracked.inliers,
          .relocalized = tracked.relocalized,
          .certain = tracked.has_pose() && uncertainty_of(tracked) == Uncertainty::kNone,
          .in_saved_map = in_saved_map(tracked, view),
          .covariance = tracked.covariance};
}

ObservedFrame observed_frame(const TrackedFrame& tracked, const MapView& view) {
  const Frame& frame = *tracked.frame;
  ObservedFrame observed{.update = pose_update(tracked, view),
                         .images = frame.image,
                         .keypoints = {},
                         .objects = frame.instances,
                         .moving = frame.evidence.moving_pixels};
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    observed.keypoints.push_back(
        {.u = k.u,
         .v = k.v,
         .depth = k.depth,
         .static_probability = static_probability(frame.evidence.static_log_odds[i]),
         .moving = frame.evidence.weight[i] <= 0,
         .matched = i < tracked.landmarks.size() && tracked.landmarks[i].valid()});
  }
  return observed;
}

std::vector<MovingObject> moving_objects(const std::vector<Mover>& movers) {
  std::vector<MovingObject> objects;
  for (const Mover& mover : movers)
    objects.push_back(moving_object(mover.id, mover.class_name, mover.now));
  return objects;
}

std::vector<MovingObjectTrack> moving_object_tracks(const std::vector<MoverTrack>& tracks) {
  std::vector<MovingObjectTrack> result;
  for (const MoverTrack& track : tracks) {
    MovingObjectTrack& object = result.emplace_back();
    object.id = track.id;
    object.class_name = track.class_name;
    object.class_confidence = track.class_confidence;
    for (const MoverSample& sample : track.samples)
      object.samples.push_back(moving_object(track.id, track.class_name, sample));
  }
  return result;
}

}  // namespace stillmap
