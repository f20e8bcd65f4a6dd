// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/loop/loop_correction.hpp"
#include "stillmap/loop/loop_detector.hpp"
#include "stillmap/loop/loop_verification.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/loop/relocalizer.hpp"
#include "stillmap/motion/frame.hpp"

namespace stillmap {

struct PlaceOptions {
  bool loops = true;  ///< whether loops are closed, and maps joined
  RelocalizerOptions relocalizer;
  LoopDetectorOptions detector;
  LoopVerificationOptions verification;
  LoopCorrectionOptions correction;
  /// Whether every keyframe is held against the other maps by itself, and not only in a row.
  bool connect_at_once = true;
  int connect_by = 20;  ///< keyframes of a map apart that are held against the others at the end
  STILLMAP_FIELDS(loops, relocalizer, detector, verification, correction, connect_at_once,
                  connect_by)
};

/// The places of a map, to be recognized by how they look. Belongs to the thread that owns the map.
class Places {
 public:
  explicit Places(const PlaceOptions& options);

  /// Takes in a keyframe: those of its keypoints that show a landmark, for what shows none moves,
  /// or has not been seen again. Forgets the keyframes that the map no longer holds.
  void add(const Map& map, KeyframeId keyframe);

  /// Whether the place of the keyframe added last has been seen before, in its own component (a
  /// loop) or in another one; certain, or nothing.
  std::optional<LoopMatch> recognize(const Map& map, KeyframeId newest);

  /// Whether some keyframe of a component shows a place of another one: those of its keyframes that
  /// show most landmarks are asked, each for itself, and not only in a row as they came.
  std::optional<LoopMatch> connect(const Map& map, std::uint32_t component) const;

  /// Where a frame of a lost camera was: see stillmap::relocalize().
  RelocalizationVerification find(const Map& map, const Frame& frame) const;

 private:
  std::optional<LoopMatch> match_other_component(const Map& map, KeyframeId query) const;

  PlaceOptions options_;
  PlaceIndex index_;
  LoopDetector detector_;
  std::uint32_t component_ = 0;  // of the keyframe asked about last
};

}  // namespace stillmap
