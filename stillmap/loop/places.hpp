// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/loop/relocaliser.hpp"
#include "stillmap/motion/frame.hpp"

namespace stillmap {

struct PlaceOptions {
  RelocaliserOptions relocaliser;
  STILLMAP_FIELDS(relocaliser)
};

/// The places of a map, to be recognised by how they look. Belongs to the thread that owns the map.
class Places {
 public:
  explicit Places(const PlaceOptions& options);

  /// Takes in a keyframe: those of its keypoints that show a landmark, for what shows none moves,
  /// or has not been seen again. Forgets the keyframes that the map no longer holds.
  void add(const Map& map, KeyframeId keyframe);

  /// Where a frame of a lost camera was: see stillmap::relocalise().
  RelocalisationVerdict find(const Map& map, const Frame& frame) const;

 private:
  PlaceOptions options_;
  PlaceIndex index_;
};

}  // namespace stillmap
