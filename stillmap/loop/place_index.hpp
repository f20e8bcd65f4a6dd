// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/map.hpp"

#include <map>
#include <memory>
#include <span>
#include <vector>

namespace stillmap {

/// How much a keyframe looks like the query: similarity(), 0 to 1.
struct PlaceScore {
  KeyframeId keyframe;
  double score = 0;
};

/// Which keyframes look like this one? An inverted index from words to keyframes (Sivic and
/// Zisserman, ICCV 2003; Nister and Stewenius, CVPR 2006), of all components alike. Only keypoints
/// with a static weight above 0 enter. Belongs to the owner of the Map, and is told what is added
/// to it and erased. What it answers depends on what it holds, not on the order of insertion.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary)
      : vocabulary_(std::move(vocabulary)), keyframes_with_(vocabulary_->words()) {}

  const Vocabulary& vocabulary() const { return *vocabulary_; }
  std::size_t size() const { return bags_.size(); }

  /// Adds a keyframe; one that is there already is taken out first.
  void insert(const Keyframe& keyframe) {
    insert(keyframe.id, *keyframe.features, keyframe.static_weight);
  }
  /// @param weights  one per keypoint: those of weight 0 or less do not enter
  void insert(KeyframeId id, const Features& features, std::span<const float> weights);
  /// Takes a keyframe out; unknown ones are passed over.
  void erase(KeyframeId id);
  /// Takes out all that the map no longer holds.
  void erase_missing(const Map& map);

  /// The keyframe's bag; null if it is not in the index.
  const BagOfWords* find(KeyframeId id) const;

  /// Every keyframe that shares a word with the query, and its score; sorted by id.
  std::vector<PlaceScore> scores(const BowVector& query) const;

 private:
  struct Entry {
    KeyframeId keyframe;
    float weight;
  };
  std::shared_ptr<const Vocabulary> vocabulary_;
  std::map<KeyframeId, BagOfWords> bags_;
  std::vector<std::vector<Entry>> keyframes_with_;  // by word; sorted by keyframe
};

struct PlaceQueryOptions {
  int group = 10;  ///< best covisible keyframes whose scores count for a keyframe's island
  /// Of the score of its component's best island, for another to be a candidate too.
  double island_share = 0.75;
  int max_candidates = 5;  ///< of one component at most, the best
  int max_of_all = 15;     ///< of all components together
  int max_scored = 60;     ///< keyframes looked at, those of highest score
  STILLMAP_FIELDS(group, island_share, max_candidates, max_of_all, max_scored)
};

/// A place that may be the query's.
struct PlaceCandidate {
  KeyframeId keyframe;      ///< of its island the one that looks most like the query
  double score = 0;         ///< similarity of that one
  double island_score = 0;  ///< sum over the island
};

/// The places that look like the query, best first (ties by sequence); of several components by
/// turns, beginning with that of the keyframe most alike. Keyframes of one place share
/// the score between them, so what counts is an island: a keyframe with those that see the same
/// landmarks (Galvez-Lopez and Tardos, TRO 2012, section V.C, has islands in time; Mur-Artal,
/// Montiel and Tardos, TRO 2015, section V.E, in covisibility). Of each island the best keyframe is
/// the candidate. Islands are compared within their component only: one of a map that has just
/// begun is small, and no worse a place for it.
/// @param excluded   sorted by id: never candidates, and without part in an island
/// @param min_score  of a keyframe, for its island to be looked at
std::vector<PlaceCandidate> find_places(const Map& map, const PlaceIndex& index,
                                        const BowVector& query,
                                        std::span<const KeyframeId> excluded, double min_score,
                                        const PlaceQueryOptions& options = {});

}  // namespace stillmap
