// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/repeated_landmarks.hpp"

#include <algorithm>
#include <initializer_list>
#include <random>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

/// Returns a descriptor whose first `count` bits are set.
Descriptor ones(int count) {
  Descriptor d{};
  for (int i = 0; i < count; ++i)
    d[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  return d;
}

/// Returns a vocabulary of two words, all zeros and all ones.
Vocabulary two_words() { return {{2, 0, 0}, {Descriptor{}, ones(256)}, {1, 1}}; }

void add_landmark(const Descriptor& descriptor, LocalMap& map) {
  LocalLandmark landmark{};
  landmark.id = {static_cast<std::uint32_t>(map.landmarks.size()), 0};
  landmark.p_world.setZero();
  landmark.normal.setZero();
  landmark.descriptor = descriptor;
  map.landmarks.push_back(landmark);
}

/// Landmark i of the map has the i-th number of bits set. Fewer than 128 belong to one node.
LocalMap map_of(std::initializer_list<int> bits) {
  LocalMap map;
  for (const int count : bits) add_landmark(ones(count), map);
  return map;
}

/// Returns the indices of the landmarks that repeat the shown ones.
std::vector<std::size_t> repeated_in(const LocalMap& map, const std::vector<std::size_t>& shown,
                                     RepeatRule rule, const Vocabulary& vocabulary = two_words()) {
  std::vector<PointMatch> matches(1);  // the first match is no landmark
  for (const std::size_t i : shown) {
    matches.emplace_back();
    matches.back().landmark = map.landmarks[i].id;
  }
  std::vector<std::size_t> found;
  for (const LandmarkId id : repeated_landmarks(map, matches, rule, vocabulary))
    found.push_back(map.index(id));
  return found;
}

TEST(RepeatedLandmarks, AreNearerThanTheMedianOfTheAcceptedMatches) {
  // Nearest others of the shown landmarks 0, 1 and 2: landmarks 3 at 4, 4 at 20 and 5 at 30 bits.
  EXPECT_THAT(repeated_in(map_of({0, 60, 127, 4, 40, 97}), {0, 1, 2}, RepeatRule::kMatched),
              ElementsAre(3));
}

TEST(RepeatedLandmarks, WithEqualDescriptorsCount) {
  EXPECT_THAT(repeated_in(map_of({0, 60, 127, 0, 40, 97}), {0, 1, 2}, RepeatRule::kMatched),
              ElementsAre(3));
}

TEST(RepeatedLandmarks, AreAcceptedAsMatchesAre) {
  // Landmarks 2 and 3 are 50 and 51 bits from shown ones, so only the first is a match: the set has
  // one distance, and nothing is below its median.
  EXPECT_THAT(repeated_in(map_of({0, 127, 50, 76}), {0, 1}, RepeatRule::kMatched), IsEmpty());
  EXPECT_THAT(repeated_in(map_of({0, 127, 49, 77}), {0, 1}, RepeatRule::kMatched), ElementsAre(2));
}

TEST(RepeatedLandmarks, AreNotThoseThatTheFrameShows) {
  // Landmark 1 is the nearest to 0, but the frame shows both.
  EXPECT_THAT(repeated_in(map_of({0, 2, 40, 127, 100}), {0, 1, 3}, RepeatRule::kMatched),
              ElementsAre(4));
}

TEST(RepeatedLandmarks, OfAnotherNodeAreNotCompared) {
  // Landmark 2 is 10 bits from the first one that is shown, but in the other node.
  EXPECT_THAT(repeated_in(map_of({120, 0, 130, 40}), {0, 1}, RepeatRule::kMatched), IsEmpty());
  EXPECT_THAT(repeated_in(map_of({120, 60, 130, 40}), {0}, RepeatRule::kAllPairs), ElementsAre(1));
}

TEST(RepeatedLandmarks, NeedALandmarkThatIsShownAndARule) {
  EXPECT_THAT(repeated_in(map_of({0, 4, 8, 12}), {}, RepeatRule::kMatched), IsEmpty());
  EXPECT_THAT(repeated_in(map_of({0, 4, 8, 12}), {}, RepeatRule::kAllPairs), IsEmpty());
  EXPECT_THAT(repeated_in(map_of({0, 60, 127, 4, 40, 97}), {0, 1, 2}, RepeatRule::kNone),
              IsEmpty());
}

TEST(RepeatedLandmarks, OfAllPairsHaveAMedianPerNode) {
  // The distances of landmarks 1 to 4 from the shown one are 4, 8, 12 and 20; their median is 10.
  EXPECT_THAT(repeated_in(map_of({0, 4, 8, 12, 20}), {0}, RepeatRule::kAllPairs),
              ElementsAre(1, 2));
}

/// A map of landmarks of 50 words. A frame observes some of them; the map also contains repeats of
/// observed landmarks, as of an object that moved. Landmarks of one word differ by about 70 bits,
/// repeats from their landmark by about 16.
class RepeatsInAMap : public ::testing::Test {
 protected:
  static constexpr std::size_t kStatic = 2000, kRepeats = 150;
  static constexpr std::uint8_t kWords = 50;

  RepeatsInAMap() {
    for (Descriptor& word : words_) word = any();
    for (std::size_t i = 0; i < kStatic; ++i)
      add_landmark(changed(words_[i % words_.size()], 40), map_);
    for (std::size_t i = 0; i < kShown; ++i) shown_.push_back(i);
    for (std::size_t i = 0; i < kRepeats; ++i)
      add_landmark(changed(map_.landmarks[i].descriptor, 16), map_);
  }

  /// Returns the share of the landmarks in [first, end) that the rule erases.
  double erased(RepeatRule rule, std::size_t first, std::size_t end) const {
    std::vector<std::uint8_t> children(1 + words_.size(), 0);
    children[0] = kWords;
    const Vocabulary vocabulary(children, words_, std::vector<float>(words_.size(), 1));
    const auto found = repeated_in(map_, shown_, rule, vocabulary);
    const auto inside =
        std::ranges::count_if(found, [&](std::size_t i) { return i >= first && i < end; });
    return static_cast<double>(inside) / static_cast<double>(end - first);
  }

  static constexpr std::size_t kShown = 400;
  LocalMap map_;
  std::vector<std::size_t> shown_;

 private:
  Descriptor any() {
    Descriptor d{};
    for (auto& word : d) word = random_();
    return d;
  }
  /// Returns the descriptor with about `bits` bits changed.
  Descriptor changed(Descriptor d, int bits) {
    for (int i = 0; i < bits; ++i) d[random_() % d.size()] ^= std::uint64_t{1} << (random_() % 64);
    return d;
  }

  std::mt19937_64 random_{7};
  std::vector<Descriptor> words_ = std::vector<Descriptor>(kWords);
};

TEST_F(RepeatsInAMap, GoAndTheOthersStay) {
  EXPECT_GT(erased(RepeatRule::kMatched, kStatic, kStatic + kRepeats), 0.3);
  EXPECT_LT(erased(RepeatRule::kMatched, 0, kStatic), 0.01);
}

TEST_F(RepeatsInAMap, GoWithTheOthersIfAllPairsAreCompared) {
  EXPECT_GT(erased(RepeatRule::kAllPairs, kStatic, kStatic + kRepeats), 0.8);
  EXPECT_GT(erased(RepeatRule::kAllPairs, kShown, kStatic), 0.5);
}

}  // namespace
}  // namespace stillmap
