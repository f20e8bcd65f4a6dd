// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/map/relocalization_result.hpp"
#include "stillmap/track/local_map_tracking.hpp"
#include "stillmap/track/tracker_state.hpp"

#include <optional>

namespace stillmap {

struct RelocalizedPose {
  TrackerState state;  ///< the recognized frame as previous frame, in the map of its place
  LocalMapPose pose;   ///< of the newest frame
};

/// Confirms a relocalization by a second frame: tracks the newest frame from the recognized one and
/// refines it in the local map of the place. Returns none if too few landmarks agree.
/// @param min_landmarks see refine_in_local_map()
std::optional<RelocalizedPose> track_from_relocalization(const TrackingModel& model,
                                                         const RelocalizationResult& found,
                                                         const Frame& frame, int min_landmarks);

}  // namespace stillmap
