// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/loop_correction.hpp"
#include "stillmap/loop/loop_detector.hpp"
#include "stillmap/loop/loop_verification.hpp"
#include "stillmap/loop/place_index.hpp"
#include "stillmap/loop/relocalizer.hpp"
#include "stillmap/motion/frame.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

struct PlaceOptions {
  bool loops = true;  ///< Whether loops are closed and components merged.
  /// Number of consecutive keyframes that must find the same place: see LoopDetector.
  int consistent = 3;
  /// Whether every single keyframe is compared with the other components, without requiring
  /// consecutive detections.
  bool connect_at_once = true;
  /// Number of keyframes of each separate component that are compared with the others at the end of
  /// the run.
  int connect_by = 20;
};

/// A keyframe compared with one of another component that looks alike.
struct PlaceComparison {
  KeyframeId query, candidate;
  LoopVerification verification;
  /// Whether another comparison of the same components shows the same motion between them.
  bool confirmed = false;
};

/// Place recognition for loop closing, merging and relocalization. Used by the thread that owns the
/// map.
class Places {
 public:
  explicit Places(const PlaceOptions& options);

  /// Adds the keypoints of a keyframe that show a landmark; the others may be moving or were never
  /// matched. Removes keyframes that the map no longer contains.
  void add(const Map& map, KeyframeId keyframe);

  /// Returns a verified loop or merge for the keyframe that was added last.
  std::optional<LoopMatch> recognize(const Map& map, KeyframeId newest);

  /// Returns a verified merge of a component with another one. Its keyframes with most landmarks
  /// are tried one by one, without requiring consecutive detections, then all those with tags.
  std::optional<LoopMatch> connect(const Map& map, std::uint32_t component) const;

  /// Returns why no place of another component is recognized in a keyframe: the test that the most
  /// similar one fails.
  std::string why_unknown(const Map& map, KeyframeId query) const;

  /// Compares each keyframe with the most similar keyframes of the other components, and with those
  /// that show the same tags. The keyframes of one component are tried until one is verified.
  /// Ordered by the id of the query.
  std::vector<PlaceComparison> compare_components(const Map& map) const;

  /// Verifies that two keyframes show the same place: see verify_loop().
  LoopVerification verify(const Map& map, KeyframeId query, KeyframeId candidate) const {
    return verify_loop(map, index_, query, candidate);
  }

  /// Relocalizes a frame: see stillmap::relocalize().
  RelocalizationVerification find(const Map& map, const Frame& frame) const;

 private:
  std::vector<PlaceCandidate> places_in_other_components(const Map& map, KeyframeId query) const;
  std::optional<LoopMatch> match_other_component(const Map& map, KeyframeId query) const;
  static std::optional<LoopMatch> match_tags(const Map& map, KeyframeId query);

  PlaceOptions options_;
  PlaceIndex index_;
  LoopDetector detector_;
  std::uint32_t component_ = 0;  // Component of the last query.
};

}  // namespace stillmap
