// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/pipeline/frame_log.hpp"
#include "stillmap/pipeline/map_maker.hpp"
#include "stillmap/slam.hpp"

#include <vector>

/// The parts of a Snapshot, as plain structs made of the system's own types.
namespace stillmap {

/// Adds trajectory, keyframes, landmarks and events: those of the map that the newest of the frames
/// is in. On the map's thread.
void add_map(const MapMaker& maker, const std::vector<PlacedFrame>& frames, Snapshot& snapshot);

/// The tracking result of a frame; its pose is the last one of the snapshot's trajectory.
PoseUpdate pose_update(const FrameRecord& newest, const Snapshot& snapshot);
/// The tracking result of a frame, in the map as the tracker saw it.
PoseUpdate pose_update(const TrackedFrame& tracked);

std::vector<MovingObject> moving_objects(const std::vector<Mover>& movers);
std::vector<MovingObjectTrack> moving_object_tracks(const std::vector<MoverTrack>& tracks);

}  // namespace stillmap
