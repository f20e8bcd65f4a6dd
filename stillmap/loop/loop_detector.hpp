// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/place_index.hpp"

#include <vector>

namespace stillmap {

/// Detects loop candidates. A candidate is accepted if the preceding keyframes found places that
/// observe common landmarks with it (group consistency: Mur-Artal, Montiel and Tardos, TRO 2015,
/// section VII.A). Keyframes that share a landmark with the query are never candidates. Keyframes
/// of other components are treated alike: verify_loop() distinguishes a loop from a merge.
/// Synchronous and deterministic; must be called for every keyframe of the tracked component in
/// creation order.
class LoopDetector {
 public:
  /// @param consistent number of consecutive keyframes that must find the same place; 1 accepts at
  ///                   once. In a smaller component: all of its keyframes.
  explicit LoopDetector(int consistent) : consistent_(consistent) {}

  /// Returns the accepted places, best first. The query must be in the index.
  std::vector<PlaceCandidate> detect(const Map& map, const PlaceIndex& index, KeyframeId query);

  /// Forgets the preceding keyframes: after tracking loss and after a loop closure.
  void reset() { chains_.clear(); }

 private:
  /// A place found by `length` consecutive keyframes.
  struct Chain {
    std::vector<KeyframeId> group;  ///< Sorted by id.
    int length = 1;
  };

  Chain continued(const Map& map, KeyframeId candidate) const;

  int consistent_;
  std::vector<Chain> chains_;
};

}  // namespace stillmap
