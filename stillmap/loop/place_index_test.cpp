// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/place_index.hpp"

#include "stillmap/loop/loop_detector.hpp"

#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

constexpr std::size_t kWords = 64;

/// A vocabulary with known words: the descriptor of word w belongs to word w.
Descriptor descriptor_of(std::size_t word) {
  std::mt19937_64 rng(word + 1);
  return {rng(), rng(), rng(), rng()};
}

std::shared_ptr<const Vocabulary> known_words() {
  std::vector<std::uint8_t> children(kWords + 1, 0);
  children[0] = kWords;
  std::vector<Descriptor> descriptors;
  for (std::size_t w = 0; w < kWords; ++w) descriptors.push_back(descriptor_of(w));
  return std::make_shared<const Vocabulary>(children, descriptors,
                                            std::vector<float>(kWords, 1.0F));
}

/// Keyframes with given words; consecutive keyframes share landmarks if requested.
class PlaceIndexTest : public ::testing::Test {
 protected:
  KeyframeId add(const std::vector<std::size_t>& words, std::vector<float> weights = {},
                 std::uint32_t component = 0) {
    auto features = std::make_shared<Features>();
    for (const std::size_t w : words) features->descriptors.push_back(descriptor_of(w));
    features->keypoints.resize(words.size());
    Keyframe keyframe;
    keyframe.component = component;
    if (weights.empty()) weights.assign(words.size(), 1);
    keyframe.static_weight = std::move(weights);
    keyframe.features = std::move(features);
    const Keyframe& added = map_.add_keyframe(std::move(keyframe));
    index_.insert(added);
    return added.id;
  }

  /// Makes two keyframes share landmarks at their first `count` keypoints.
  void share(KeyframeId a, KeyframeId b, std::uint32_t count) {
    for (std::uint32_t i = 0; i < count; ++i) {
      const LandmarkId known = map_.at(a).landmarks[i];
      const LandmarkId id = known.valid() ? known : map_.add_landmark({0, 0, 2.0 + i}, {a, i}).id;
      map_.observe(id, {b, i});
    }
  }

  double score(KeyframeId query, KeyframeId other) const {
    for (const PlaceScore& s : index_.scores(index_.find(query)->words)) {
      if (s.keyframe == other) return s.score;
    }
    return 0;
  }

  std::vector<KeyframeId> places(const std::vector<PlaceCandidate>& candidates) const {
    std::vector<KeyframeId> ids;
    for (const PlaceCandidate& c : candidates) ids.push_back(c.keyframe);
    return ids;
  }

  struct IslandAndQuery {
    KeyframeId island, query;
  };
  /// Three covisible keyframes, the first most similar to the query.
  IslandAndQuery add_island_and_query() {
    const auto i1 = add({1, 2, 3, 4, 5, 30, 31, 32}), i2 = add({3, 4, 5, 6, 7, 33, 34, 35}),
               i3 = add({1, 2, 3, 40, 41, 42, 43, 44});
    share(i1, i2, 3);
    share(i1, i3, 3);
    return {i1, add({1, 2, 3, 4, 5, 6, 7, 8})};
  }

  /// Returns all places except the keyframe itself.
  std::vector<KeyframeId> places_like(KeyframeId query) const {
    const std::vector<KeyframeId> self = {query};
    return places(find_places(map_, index_, index_.find(query)->words, self, 0));
  }

  Map map_{Camera{}, PyramidShape{}};
  PlaceIndex index_{known_words()};
};

TEST_F(PlaceIndexTest, ScoresAreTheSimilaritiesOfTheBags) {
  const auto a = add({1, 2, 3, 4}), b = add({3, 4, 5, 6, 3, 3}), c = add({7, 8});
  EXPECT_DOUBLE_EQ(score(a, a), 1);
  EXPECT_NEAR(score(a, b), similarity(index_.find(a)->words, index_.find(b)->words), 1e-9);
  EXPECT_NEAR(score(a, b), 0.25 + 1.0 / 6, 1e-6);
  EXPECT_EQ(score(a, c), 0);
}

TEST_F(PlaceIndexTest, MovingKeypointsAreNotIndexed) {
  const auto a = add({1, 2, 3, 4}), b = add({1, 2, 7, 8}, {0, 0, 1, 1});
  EXPECT_EQ(score(a, b), 0) << "they share only moving keypoints";
}

TEST_F(PlaceIndexTest, ErasedKeyframesAreNotFound) {
  const auto a = add({1, 2, 3, 4}), b = add({1, 2, 3, 4}), c = add({1, 2, 3, 5});
  index_.erase(b);
  EXPECT_EQ(index_.find(b), nullptr);
  EXPECT_EQ(score(a, b), 0);
  map_.erase(c, a);
  EXPECT_THAT(places(find_places(map_, index_, index_.find(a)->words, {}, 0)), ElementsAre(a))
      << "a keyframe that the map no longer contains is no candidate";
  index_.erase_missing(map_);
  EXPECT_EQ(index_.size(), 1U);
}

TEST_F(PlaceIndexTest, AnIslandBeatsASingleKeyframeOfHigherScore) {
  const auto single = add({1, 2, 3, 4, 5, 6, 20, 21});
  const auto [island, query] = add_island_and_query();
  EXPECT_THAT(places_like(query), ElementsAre(island));
  EXPECT_GT(score(query, single), score(query, island));
}

/// The same, but the single keyframe is another component.
TEST_F(PlaceIndexTest, IslandsOfDifferentComponentsDoNotCompete) {
  const auto single = add({1, 2, 3, 4, 5, 6, 20, 21}, {}, 1);
  const auto [island, query] = add_island_and_query();
  EXPECT_THAT(places_like(query), ElementsAre(single, island));
}

TEST_F(PlaceIndexTest, ExcludedKeyframesAreNeitherCandidatesNorPartOfAnIsland) {
  const auto a = add({1, 2, 3, 4}), b = add({1, 2, 3, 5}), query = add({1, 2, 3, 6});
  share(a, b, 2);
  const std::vector<KeyframeId> excluded = {b, query};
  const auto found = find_places(map_, index_, index_.find(query)->words, excluded, 0);
  ASSERT_THAT(places(found), ElementsAre(a));
  EXPECT_DOUBLE_EQ(found[0].island_score, found[0].score);
}

TEST_F(PlaceIndexTest, EqualScoresAreInCreationOrder) {
  const auto a = add({1, 2, 3}), b = add({1, 2, 3}), query = add({1, 2, 3});
  const std::vector<KeyframeId> self = {query};
  EXPECT_THAT(places(find_places(map_, index_, index_.find(query)->words, self, 0)),
              ElementsAre(a, b));
}

/// A path past three places and back to the first.
class LoopDetectorTest : public PlaceIndexTest {
 protected:
  LoopDetectorTest() {
    for (std::size_t k = 0; k < 4; ++k) old_.push_back(walk({1, 2, 3, 4, 5, 6, 10 + k, 20 + k}));
    for (std::size_t k = 0; k < 4; ++k) walk({40, 41, 42, 43, 44, 45, 46 + k, 50 + k});
    before_ = KeyframeId{};  // Later keyframes share no landmark with earlier ones.
  }

  /// Adds a keyframe with eight words, each at three keypoints, that shares 18 landmarks with the
  /// one before.
  KeyframeId walk(const std::vector<std::size_t>& words) {
    std::vector<std::size_t> keypoints;
    for (const std::size_t w : words) keypoints.insert(keypoints.end(), 3, w);
    const auto id = add(keypoints);
    if (before_.valid()) share(before_, id, kShared);
    return before_ = id;
  }

  static constexpr std::uint32_t kShared = 18;
  static constexpr int kConsistent = 3;

  std::vector<KeyframeId> old_;
  KeyframeId before_;
};

TEST_F(LoopDetectorTest, APlaceIsAcceptedAfterThreeConsecutiveDetections) {
  LoopDetector detector(kConsistent);
  EXPECT_THAT(detector.detect(map_, index_, walk({1, 2, 3, 4, 5, 6, 10, 60})), IsEmpty());
  EXPECT_THAT(detector.detect(map_, index_, walk({1, 2, 3, 4, 5, 6, 11, 61})), IsEmpty());
  const auto found = detector.detect(map_, index_, walk({1, 2, 3, 4, 5, 6, 12, 62}));
  ASSERT_FALSE(found.empty());
  EXPECT_EQ(found[0].keyframe, old_[2]);
}

TEST_F(LoopDetectorTest, APlaceFoundWithAGapIsNotAccepted) {
  LoopDetector detector(kConsistent);
  detector.detect(map_, index_, walk({1, 2, 3, 4, 5, 6, 10, 60}));
  detector.detect(map_, index_, walk({1, 2, 3, 4, 5, 6, 11, 61}));
  EXPECT_THAT(detector.detect(map_, index_, walk({55, 56, 57, 58, 59, 60, 61, 62})), IsEmpty());
  EXPECT_THAT(detector.detect(map_, index_, walk({1, 2, 3, 4, 5, 6, 12, 63})), IsEmpty());
}

TEST_F(LoopDetectorTest, CovisibleKeyframesAreNoLoop) {
  LoopDetector detector(1);
  const auto query = walk({1, 2, 3, 4, 5, 6, 10, 60});
  EXPECT_FALSE(detector.detect(map_, index_, query).empty());
  for (const KeyframeId id : old_) share(id, query, kShared);
  EXPECT_THAT(detector.detect(map_, index_, query), IsEmpty())
      << "the old place is now covisible with the query";
}

TEST_F(LoopDetectorTest, ACandidateLessSimilarThanTheNeighborIsRejected) {
  // Two or four common words of eight, against seven with the neighbor.
  walk({1, 2, 30, 31, 32, 33, 34, 35});
  const auto unlike = walk({1, 2, 30, 31, 32, 33, 34, 36});
  EXPECT_THAT(LoopDetector(1).detect(map_, index_, unlike), IsEmpty());
  before_ = KeyframeId{};
  walk({1, 2, 3, 4, 50, 51, 52, 53});
  const auto alike = walk({1, 2, 3, 4, 50, 51, 52, 54});
  EXPECT_FALSE(LoopDetector(1).detect(map_, index_, alike).empty());
}

}  // namespace
}  // namespace stillmap
