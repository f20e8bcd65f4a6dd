// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/loop/place_index.hpp"

#include <vector>

namespace stillmap {

struct LoopDetectorOptions {
  /// Minimum ratio of a candidate's score to the query's best score with a neighbor, since the
  /// similarity of two views of one place depends on the place (Galvez-Lopez and Tardos, TRO 2012,
  /// eq. 3). Chosen by measurement, see docs/results.md.
  double relative_score = 0.4;
  int neighbor_shared = 15;  ///< Number of shared landmarks that makes a keyframe a neighbor.
  /// Number of consecutive keyframes that must find the same place; 1 accepts at once. In a smaller
  /// component: all of its keyframes.
  int consistent = 3;
  /// Number of shared landmarks that makes a keyframe part of a candidate's group.
  int group_shared = 15;
  PlaceQueryOptions query;
};

/// Detects loop candidates. A candidate is accepted if the preceding keyframes found places that
/// observe common landmarks with it (group consistency: Mur-Artal, Montiel and Tardos, TRO 2015,
/// section VII.A). Keyframes that share a landmark with the query are never candidates. Keyframes
/// of other components are treated alike: verify_loop() distinguishes a loop from a merge.
/// Synchronous and deterministic; must be called for every keyframe of the tracked component in
/// creation order.
class LoopDetector {
 public:
  explicit LoopDetector(const LoopDetectorOptions& options = {}) : options_(options) {}

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

  LoopDetectorOptions options_;
  std::vector<Chain> chains_;
};

/// Returns the score that a candidate must reach, derived from the query's neighbors (see
/// LoopDetectorOptions); 0 without neighbors.
double score_to_reach(const Map& map, const PlaceIndex& index, KeyframeId query,
                      const LoopDetectorOptions& options);

}  // namespace stillmap
