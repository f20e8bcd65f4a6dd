// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/pipeline/frame_log.hpp"
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/pipeline/mapping.hpp"
#include "stillmap/slam.hpp"

#include <vector>

/// Conversion of the system's own types to the plain structs of a Snapshot.
namespace stillmap {

/// Adds trajectory, keyframes, landmarks and events of the component that the newest frame is in.
/// Called on the map's thread.
void add_map(const MapMaker& maker, const std::vector<PlacedFrame>& frames, Snapshot& snapshot);

/// Returns the tracking result of a frame; its pose is the last one of the snapshot's trajectory.
PoseUpdate pose_update(const FrameRecord& newest, const Snapshot& snapshot);
/// Returns the tracking result of a frame, with its pose in the tracker's map, of which it saw the
/// view.
PoseUpdate pose_update(const TrackedFrame& tracked, const MapView& view);
ObservedFrame observed_frame(const TrackedFrame& tracked, const MapView& view);

std::vector<MovingObject> moving_objects(const std::vector<Mover>& movers);
std::vector<MovingObjectTrack> moving_object_tracks(const std::vector<MoverTrack>& tracks);

}  // namespace stillmap
