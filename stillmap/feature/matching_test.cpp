// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/matching.hpp"

#include "stillmap/feature/dead_leaves.hpp"

#include <cmath>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

Descriptor random_descriptor(TestRandom& random) {
  return {random.next(), random.next(), random.next(), random.next()};
}

std::vector<Descriptor> random_descriptors(int count, std::uint64_t seed) {
  TestRandom random(seed);
  std::vector<Descriptor> descriptors;
  for (int i = 0; i < count; ++i) descriptors.push_back(random_descriptor(random));
  return descriptors;
}

/// Returns `d` with its first `bits` bits flipped.
Descriptor flipped(Descriptor d, int bits) {
  for (int i = 0; i < bits; ++i) d[i / 64] ^= 1ULL << (i % 64);
  return d;
}

class MatchingOnPath : public testing::TestWithParam<CpuPath> {};
INSTANTIATE_TEST_SUITE_P(Paths, MatchingOnPath,
                         testing::Values(CpuPath::kPortable, best_cpu_path()),
                         [](const auto& suite) { return suite.index == 0 ? "Portable" : "Best"; });

TEST_P(MatchingOnPath, NearestTwoEqualSorting) {
  auto descriptors = random_descriptors(300, 1);
  descriptors[40] = descriptors[20];  // a tie
  TestRandom random(2);
  for (int trial = 0; trial < 100; ++trial) {
    const Descriptor query = trial == 0 ? flipped(descriptors[20], 3) : random_descriptor(random);
    std::vector<std::pair<int, std::uint32_t>> sorted;
    for (std::uint32_t i = 0; i < descriptors.size(); ++i) {
      sorted.emplace_back(distance(query, descriptors[i]), i);
    }
    std::sort(sorted.begin(), sorted.end());
    const NearestTwo two = nearest_two(query, descriptors, GetParam());
    ASSERT_EQ(std::pair(two.best_distance, two.best), sorted[0]);
    ASSERT_EQ(std::pair(two.second_distance, two.second), sorted[1]);
  }
}

TEST_P(MatchingOnPath, NearestTwoUseTheCandidatesOnly) {
  const auto descriptors = random_descriptors(10, 3);
  const std::vector<std::uint32_t> candidates = {7, 2};
  const NearestTwo two =
      nearest_two(flipped(descriptors[7], 5), descriptors, candidates, GetParam());
  EXPECT_EQ(two.best, 7U);
  EXPECT_EQ(two.best_distance, 5);
  EXPECT_EQ(two.second, 2U);
  const NearestTwo none = nearest_two(descriptors[0], descriptors, {}, GetParam());
  EXPECT_EQ(none.best, kNoMatch);
  EXPECT_EQ(none.second, kNoMatch);
}

TEST_P(MatchingOnPath, BruteForceFindsThePermutation) {
  const auto a = random_descriptors(200, 4);
  std::vector<Descriptor> b;
  for (std::uint32_t i = 0; i < 200; ++i)
    b.push_back(flipped(a[i * 77 % 200], static_cast<int>(i % 30)));
  const auto matches = match_brute_force(a, b, {}, GetParam());
  ASSERT_EQ(matches.size(), 200U);
  for (const DescriptorMatch& m : matches) {
    EXPECT_EQ(m.b * 77 % 200, m.a);
    EXPECT_EQ(m.distance, static_cast<int>(m.b % 30));
  }
}

TEST(BruteForce, AppliesItsTests) {
  const auto a = random_descriptors(2, 5);
  const std::vector<Descriptor> b = {flipped(a[0], 10), flipped(a[0], 11), flipped(a[1], 40)};
  BruteForceMatchOptions options{.max_distance = 100, .ratio = 0.8, .cross_check = true};
  EXPECT_THAT(match_brute_force(a, b, options), ElementsAre(DescriptorMatch{1, 2, 40}));
  options.ratio = 1;
  EXPECT_THAT(match_brute_force(a, b, options),
              ElementsAre(DescriptorMatch{0, 0, 10}, DescriptorMatch{1, 2, 40}));
  options.max_distance = 39;
  EXPECT_THAT(match_brute_force(a, b, options), ElementsAre(DescriptorMatch{0, 0, 10}));
  EXPECT_THAT(match_brute_force({}, b, options), IsEmpty());
  EXPECT_THAT(match_brute_force(a, {}, options), IsEmpty());
}

TEST(BruteForce, CrossCheckRejectsOneSidedMatches) {
  const auto b = random_descriptors(1, 6);
  const std::vector<Descriptor> a = {flipped(b[0], 9), flipped(b[0], 4)};
  EXPECT_THAT(match_brute_force(a, b, {.cross_check = true}),
              ElementsAre(DescriptorMatch{1, 0, 4}));
  EXPECT_EQ(match_brute_force(a, b, {.cross_check = false}).size(), 2U);
}

TEST(Rotations, RareOnesAreDropped) {
  std::vector<Keypoint> a(100), b(100);
  std::vector<DescriptorMatch> matches;
  for (std::uint32_t i = 0; i < 100; ++i) {
    a[i].angle = static_cast<float>(std::remainder(0.3 * i, 2 * CV_PI));
    const double turn = i % 10 == 0 ? 1.0 + 0.02 * i : 0.52;  // 90 agree, 10 are arbitrary.
    b[i].angle = static_cast<float>(std::remainder(a[i].angle + turn, 2 * CV_PI));
    matches.push_back({i, i, 0});
  }
  const auto kept = keep_consistent_rotations(matches, a, b);
  EXPECT_EQ(kept.size(), 90U);
  for (const DescriptorMatch& m : kept) EXPECT_NE(m.a % 10, 0U);
}

TEST(Rotations, KeepThreeDirections) {
  // Changes of angle around five values, with 50, 40, 30, 20 and 10 matches.
  std::vector<Keypoint> a(150), b(150);
  std::vector<DescriptorMatch> matches;
  for (std::uint32_t i = 0, group = 0, left = 50; i < 150; ++i, --left) {
    if (left == 0) left = 50 - 10 * ++group;
    b[i].angle = 0.1F + 0.6F * static_cast<float>(group);
    matches.push_back({i, i, 0});
  }
  EXPECT_EQ(keep_consistent_rotations(matches, a, b).size(), 120U);
  EXPECT_THAT(keep_consistent_rotations({}, a, b), IsEmpty());
}

/// Features on a line, 20 pixels apart, with given level and descriptor.
class Projection : public testing::Test {
 protected:
  void add(float u, std::uint8_t level, const Descriptor& d, float angle = 0) {
    features_.keypoints.push_back({.u = u, .v = 100, .angle = angle, .level = level});
    features_.descriptors.push_back(d);
    features_.grid = KeypointGrid(features_.keypoints, 640, 480);
  }
  static ProjectionQuery query(float u, const Descriptor& d) {
    return {.u = u, .v = 101, .radius = 5, .min_level = 0, .max_level = 7, .descriptor = d};
  }
  static std::optional<std::uint32_t> index(std::uint32_t i) { return i; }

  std::vector<Descriptor> d_ = random_descriptors(8, 7);
  Features features_;
};

TEST_F(Projection, SearchesTheWindowAndLevelsOnly) {
  add(100, 2, d_[0]);
  EXPECT_THAT(match_by_projection(std::vector{query(104, d_[0])}, features_),
              ElementsAre(index(0)));
  EXPECT_THAT(match_by_projection(std::vector{query(105.5, d_[0])}, features_),
              ElementsAre(std::nullopt));
  ProjectionQuery other_level = query(100, d_[0]);
  other_level.max_level = 1;
  EXPECT_THAT(match_by_projection(std::vector{other_level}, features_), ElementsAre(std::nullopt));
  ProjectionQuery nowhere = query(std::nanf(""), d_[0]);
  EXPECT_THAT(match_by_projection(std::vector{nowhere}, features_), ElementsAre(std::nullopt));
}

TEST_F(Projection, RejectsDistantDescriptors) {
  add(100, 0, flipped(d_[0], 30));
  const std::vector queries = {query(100, d_[0])};
  EXPECT_THAT(match_by_projection(queries, features_, {.max_distance = 30}), ElementsAre(index(0)));
  EXPECT_THAT(match_by_projection(queries, features_, {.max_distance = 29}),
              ElementsAre(std::nullopt));
}

TEST_F(Projection, RatioAppliesToTheSameLevelOnly) {
  const std::vector queries = {query(100, d_[0])};
  const ProjectionMatchOptions strict{.ratio = 0.8};
  add(99, 3, flipped(d_[0], 20));
  add(101, 4, flipped(d_[0], 21));
  EXPECT_THAT(match_by_projection(queries, features_, strict), ElementsAre(index(0)));
  features_.keypoints[1].level = 3;
  features_.grid = KeypointGrid(features_.keypoints, 640, 480);
  EXPECT_THAT(match_by_projection(queries, features_, strict), ElementsAre(std::nullopt));
  EXPECT_THAT(match_by_projection(queries, features_, {.ratio = 1}), ElementsAre(index(0)));
}

TEST_F(Projection, AssignsAKeypointToTheNearestQueryOnly) {
  add(100, 0, d_[0]);
  const std::vector queries = {query(100, flipped(d_[0], 7)), query(100, flipped(d_[0], 3)),
                               query(100, flipped(d_[0], 3)), query(100, flipped(d_[0], 9))};
  EXPECT_THAT(match_by_projection(queries, features_),
              ElementsAre(std::nullopt, index(0), std::nullopt, std::nullopt));
}

TEST_F(Projection, IgnoresTakenKeypoints) {
  add(100, 0, d_[0]);
  add(102, 0, flipped(d_[0], 12));
  const std::vector<std::uint8_t> taken = {1, 0};
  EXPECT_THAT(match_by_projection(std::vector{query(100, d_[0])}, features_, {}, taken),
              ElementsAre(index(1)));
}

TEST_F(Projection, TiesGoToTheLowerIndex) {
  for (int i = 0; i < 5; ++i) add(104 - 2 * static_cast<float>(i), 0, d_[0]);
  EXPECT_THAT(match_by_projection(std::vector{query(100, d_[0])}, features_),
              ElementsAre(index(0)));
}

TEST_F(Projection, RejectsRareRotations) {
  TestRandom random(8);
  std::vector<ProjectionQuery> queries;
  for (int i = 0; i < 25; ++i) {
    const Descriptor d = random_descriptor(random);
    add(20 + 20 * static_cast<float>(i), 0, d, 0.5F);
    queries.push_back(query(20 + 20 * static_cast<float>(i), d));
    queries.back().angle = 0.2F;
  }
  queries[4].angle = 2.5F;           // A rotation unlike the others.
  queries[5].angle = std::nanf("");  // An unknown angle is not checked.
  const auto free = match_by_projection(queries, features_);
  const auto checked = match_by_projection(queries, features_, {.check_rotation = true});
  for (std::uint32_t i = 0; i < 25; ++i) {
    EXPECT_EQ(free[i], index(i));
    EXPECT_EQ(checked[i], i == 4 ? std::nullopt : index(i));
  }
}

}  // namespace
}  // namespace stillmap
