// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/loop/place_index.hpp"

#include <vector>

namespace stillmap {

struct LoopDetectorOptions {
  /// Of the query's score with the neighbor it resembles most, what a candidate must reach: how
  /// alike two views of one place look depends on the place (Galvez-Lopez and Tardos, TRO 2012, eq.
  /// 3). Chosen by measurement, see docs/results.md.
  double relative_score = 0.4;
  int neighbor_shared = 15;  ///< landmarks shared with a keyframe that make it a neighbor
  /// Keyframes one after the other that must find the same place before it counts; 1: at once. A
  /// component that has fewer: all.
  int consistent = 3;
  int group_shared = 15;  ///< landmarks shared that make a keyframe one of a candidate's group
  PlaceQueryOptions query;
  STILLMAP_FIELDS(relative_score, neighbor_shared, consistent, group_shared, query)
};

/// Watches keyframe after keyframe for a place seen before. A candidate counts when the keyframes
/// before this one found places that see landmarks in common with it (group consistency: Mur-Artal,
/// Montiel and Tardos, TRO 2015, section VII.A). What shares a landmark with the query is its
/// surroundings and no loop. Keyframes of other components are candidates like any: verify_loop()
/// tells a loop from a merge.
/// Synchronous, remembers the last call only; feed it every keyframe of the tracked component in
/// the order of their making. Deterministic.
class LoopDetector {
 public:
  explicit LoopDetector(const LoopDetectorOptions& options = {}) : options_(options) {}

  /// The places that count, best first. The query must be in the index.
  std::vector<PlaceCandidate> detect(const Map& map, const PlaceIndex& index, KeyframeId query);

  /// Forgets the keyframes before: after a loss, and after a loop was closed.
  void reset() { chains_.clear(); }

 private:
  /// A place found by so many keyframes in a row.
  struct Chain {
    std::vector<KeyframeId> group;  ///< sorted
    int length = 1;
  };

  Chain continued(const Map& map, KeyframeId candidate) const;

  LoopDetectorOptions options_;
  std::vector<Chain> chains_;
};

/// The score that a candidate must reach, by the query's neighbors (see LoopDetectorOptions); 0
/// where it has none.
double score_to_reach(const Map& map, const PlaceIndex& index, KeyframeId query,
                      const LoopDetectorOptions& options);

}  // namespace stillmap
