// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/loop_verification.hpp"
#include "stillmap/map/map.hpp"

#include <span>
#include <vector>

namespace stillmap {

/// Returns keyframes that show a tag which the query shows, too, elsewhere in the map: of each
/// component the one that shows most of its corners. Keyframes that share a landmark with the query
/// are left out. Only corners that two keyframes observed count, on either side.
std::vector<KeyframeId> places_with_same_tags(const Map& map, KeyframeId query);

/// Verifies that the tags around two keyframes are the same ones: their corners are aligned by a
/// rigid motion, which must fit all corners of at least one tag, be determined by them, and, within
/// a component, be possible drift: see why_no_drift(). Changes nothing.
LoopVerification verify_tags(const Map& map, KeyframeId query, KeyframeId candidate);

/// Merges the landmarks of equal corners of tags that two groups of keyframes observe, if they are
/// near each other. Returns their number.
int weld_tags(Map& map, std::span<const KeyframeId> a, std::span<const KeyframeId> b);

}  // namespace stillmap
