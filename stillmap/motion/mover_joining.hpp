// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/mover_tracker.hpp"

#include <vector>

namespace stillmap {

/// Returns the tracks of a recording with one track per object: joins the tracks of an object that
/// was hidden or out of view in between. The tracker decides at the first detections of a new
/// track; here each track has all its evidence.
///
/// - Tracks that are within each other in most of the frames that detect both are one object,
///   detected twice.
/// - Tracks that are never detected in the same frame may be one object, if
///   a person can walk from the end of the one to the start of the other in the time between, and
///   if their colors are alike. Tracks detected at two places at the same time are different
///   objects.
/// - Pairs are joined in the order of their cost, and after each the costs of the joined track are
///   computed anew.
/// - Tracks of less than half a second are left out then, unless they moved by a meter.
///
/// A joined track has the id of its first part. Deterministic.
/// @param tracks by id
std::vector<MoverTrack> joined_movers(std::vector<MoverTrack> tracks);

}  // namespace stillmap
