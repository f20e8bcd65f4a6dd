// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/tag_corners.hpp"
#include "stillmap/map/map.hpp"

#include <array>
#include <map>
#include <span>

namespace stillmap {

/// The landmarks of a tag's corners, in the order of Tag::corners.
using TagLandmarks = std::array<const Landmark*, 4>;

/// Returns the tags all of whose corners are among the landmarks. Of several landmarks of one
/// corner, the one with most observations is returned, or else the first.
std::map<TagName, TagLandmarks> tags_among(std::span<const Landmark* const> landmarks);

/// Lets a keyframe observe the landmarks of the tags in its image that are in its component where
/// the keyframe sees them; keypoints with a landmark are left as they are.
void observe_tags(Map& map, KeyframeId keyframe);

}  // namespace stillmap
