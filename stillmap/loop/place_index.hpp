// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/vocabulary.hpp"
#include "stillmap/map/map.hpp"

#include <map>
#include <memory>
#include <span>
#include <vector>

namespace stillmap {

/// Appearance similarity of a keyframe to the query: similarity(), 0 to 1.
struct PlaceScore {
  KeyframeId keyframe;
  double score = 0;
};

/// Inverted index from visual words to keyframes (Sivic and Zisserman, ICCV 2003; Nister and
/// Stewenius, CVPR 2006), for all components. Only keypoints with a static weight above 0 are
/// indexed. Used by the thread that owns the Map. Results depend on the content only, not on the
/// order of insertion.
class PlaceIndex {
 public:
  explicit PlaceIndex(std::shared_ptr<const Vocabulary> vocabulary)
      : vocabulary_(std::move(vocabulary)), keyframes_with_(vocabulary_->words()) {}

  const Vocabulary& vocabulary() const { return *vocabulary_; }
  std::size_t size() const { return bags_.size(); }

  /// Adds a keyframe, or replaces it if it is in the index.
  void insert(const Keyframe& keyframe) {
    insert(keyframe.id, *keyframe.features, keyframe.static_weight);
  }
  /// @param weights  one per keypoint; keypoints with weight 0 or less are excluded
  void insert(KeyframeId id, const Features& features, std::span<const float> weights);
  /// Removes a keyframe; unknown ids are ignored.
  void erase(KeyframeId id);
  /// Removes the keyframes that the map no longer contains.
  void erase_missing(const Map& map);

  /// Returns the keyframe's bag of words; null if it is not in the index.
  const BagOfWords* find(KeyframeId id) const;

  /// Returns the score of every keyframe that shares a word with the query; sorted by id.
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

/// Minimum ratio of an island's score to the best island of its component, for loop candidates
/// [0..1] (Mur-Artal, Montiel and Tardos, TRO 2015, section V.E).
inline constexpr double kLoopIslandShare = 0.75;

/// A candidate for the place of the query.
struct PlaceCandidate {
  KeyframeId keyframe;      ///< Keyframe of the island that is most similar to the query.
  double score = 0;         ///< Similarity of that keyframe [0..1].
  double island_score = 0;  ///< Sum of the similarities over the island.
};

/// Returns the places most similar to the query, best first (ties by sequence); candidates of
/// several components alternate, beginning with the component of the most similar keyframe. A
/// component has at most five candidates.
/// Keyframes of one place share the score between them, so islands are scored: a keyframe with its
/// covisible keyframes (islands in time: Galvez-Lopez and Tardos, TRO 2012, section V.C; in
/// covisibility: Mur-Artal, Montiel and Tardos, TRO 2015, section V.E). The best keyframe of each
/// island is the candidate. Islands compete within their component only, since islands of a new
/// component are small.
/// @param excluded     sorted by id; neither candidates nor part of an island
/// @param min_score    minimum score of a keyframe for its island to be evaluated
/// @param island_share minimum ratio of an island's score to the best island of its component
/// [0..1]
std::vector<PlaceCandidate> find_places(const Map& map, const PlaceIndex& index,
                                        const BowVector& query,
                                        std::span<const KeyframeId> excluded, double min_score,
                                        double island_share = kLoopIslandShare);

}  // namespace stillmap
