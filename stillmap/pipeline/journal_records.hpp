// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/bytes.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/pipeline/frame_log.hpp"
#include "stillmap/pipeline/relative_place.hpp"
#include "stillmap/slam.hpp"

/// Entries of a run's journal as bytes. The functions that read throw Error for invalid values.
namespace stillmap {

/// The sample of a mover, in the world of the frame's pose at that time.
struct PlacedSample {
  MoverSample sample;
  Pose T_world_camera;
};

void put_frame(ByteWriter& out, const FrameRecord& record);
FrameRecord get_frame(ByteReader& in);

void put_place(ByteWriter& out, const RelativePlace& place);
RelativePlace get_place(ByteReader& in);

void put_event(ByteWriter& out, const MapEvent& event);
MapEvent get_event(ByteReader& in);

/// Writes a track without its samples.
void put_identity(ByteWriter& out, const MoverTrack& track);
MoverTrack get_identity(ByteReader& in);

void put_sample(ByteWriter& out, const PlacedSample& sample);
PlacedSample get_sample(ByteReader& in);

}  // namespace stillmap
