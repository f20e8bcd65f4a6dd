// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/repeated_landmarks.hpp"

#include <initializer_list>

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

/// Landmark i of the map has the i-th number of bits set. Fewer than 128 belong to one node.
LocalMap map_of(std::initializer_list<int> bits) {
  LocalMap map;
  for (const int count : bits) {
    LocalLandmark landmark{};
    landmark.id = {static_cast<std::uint32_t>(map.landmarks.size()), 0};
    landmark.p_world.setZero();
    landmark.normal.setZero();
    landmark.descriptor = ones(count);
    map.landmarks.push_back(landmark);
  }
  return map;
}

/// Returns the indices of the landmarks that repeat the shown ones.
std::vector<std::size_t> repeated_in(const LocalMap& map, const std::vector<std::size_t>& shown) {
  RepeatedLandmarks repeated(two_words());
  std::vector<PointMatch> matches(1);  // the first match is no landmark
  for (const std::size_t i : shown) {
    matches.emplace_back();
    matches.back().landmark = map.landmarks[i].id;
  }
  repeated.find(map, matches);
  std::vector<std::size_t> found;
  for (std::size_t i = 0; i < map.landmarks.size(); ++i) {
    if (repeated.contains(i)) found.push_back(i);
  }
  EXPECT_EQ(repeated.take().size(), found.size());
  EXPECT_THAT(repeated.take(), IsEmpty());
  return found;
}

TEST(RepeatedLandmarks, AreNearerThanTheMedianOfAllPairsOfTheirNode) {
  // The distances of landmarks 1 to 4 from the shown one are 4, 8, 12 and 20; their median is 10.
  EXPECT_THAT(repeated_in(map_of({0, 4, 8, 12, 20}), {0}), ElementsAre(1, 2));
  // Those of landmarks 2 to 4 from both shown ones are 4, 30, 40 and 36, 10, 0; the median is 20.
  EXPECT_THAT(repeated_in(map_of({0, 40, 4, 30, 40}), {0, 1}), ElementsAre(2, 3));
}

TEST(RepeatedLandmarks, WithEqualDescriptorsAreKept) {
  EXPECT_THAT(repeated_in(map_of({0, 0, 8, 12, 20}), {0}), ElementsAre(2));
}

TEST(RepeatedLandmarks, OfAnotherNodeAreNotCompared) {
  EXPECT_THAT(repeated_in(map_of({0, 250, 254}), {0}), IsEmpty());
  EXPECT_THAT(repeated_in(map_of({0, 4, 8, 250, 254}), {0}), ElementsAre(1));
}

TEST(RepeatedLandmarks, NeedALandmarkThatIsShown) {
  EXPECT_THAT(repeated_in(map_of({0, 4, 8, 12}), {}), IsEmpty());
}

TEST(RepeatedLandmarks, StayRepeatedInLaterFramesAndSnapshots) {
  const LocalMap map = map_of({0, 4, 8});
  RepeatedLandmarks repeated(two_words());
  std::vector<PointMatch> matches(1);
  matches[0].landmark = map.landmarks[0].id;
  repeated.find(map, matches);
  ASSERT_TRUE(repeated.contains(1));
  const LocalMap later = map_of({0, 4});
  repeated.find(later, {});
  EXPECT_TRUE(repeated.contains(1));
  EXPECT_THAT(repeated.take(), ElementsAre(map.landmarks[1].id)) << "reported once";
}

}  // namespace
}  // namespace stillmap
