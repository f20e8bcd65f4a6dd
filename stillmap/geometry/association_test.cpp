// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/association.hpp"

#include <cmath>
#include <limits>
#include <random>
#include <tuple>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using Pairs = std::vector<std::pair<std::size_t, std::size_t>>;

// Literal implementation of the rule, in O(n m).
Pairs by_the_rule(const std::vector<double>& a, const std::vector<double>& b,
                  double max_difference) {
  std::vector<std::tuple<double, double, double, std::size_t, std::size_t>> candidates;
  for (std::size_t i = 0; i < a.size(); ++i) {
    for (std::size_t j = 0; j < b.size(); ++j) {
      const double difference = std::abs(a[i] - b[j]);
      if (difference < max_difference) candidates.emplace_back(difference, a[i], b[j], i, j);
    }
  }
  std::sort(candidates.begin(), candidates.end());
  std::vector<bool> used_a(a.size()), used_b(b.size());
  std::vector<std::tuple<double, std::size_t, std::size_t>> taken;
  for (const auto& [difference, stamp_a, stamp_b, i, j] : candidates) {
    if (used_a[i] || used_b[j]) continue;
    used_a[i] = used_b[j] = true;
    taken.emplace_back(stamp_a, i, j);
  }
  std::sort(taken.begin(), taken.end());
  Pairs pairs;
  for (const auto& [stamp, i, j] : taken) pairs.emplace_back(i, j);
  return pairs;
}

TEST(Associate, TakesTheClosestPairFirstAndEachStampOnce) {
  const std::vector<double> a{1.000, 1.010}, b{1.009};
  EXPECT_THAT(associate(a, b), ElementsAre(std::pair(1u, 0u)));
}

TEST(Associate, IsGreedyAndNotOptimal) {
  // The closest pair is 1.010-1.012; the remaining 1.000 and 1.022 are too far apart.
  const std::vector<double> a{1.000, 1.010}, b{1.012, 1.022};
  EXPECT_THAT(associate(a, b), ElementsAre(std::pair(1u, 0u)));
}

TEST(Associate, TheBoundIsStrict) {
  const std::vector<double> a{0.0}, at{0.5}, within{0.499};
  EXPECT_THAT(associate(a, at, 0.5), IsEmpty());
  EXPECT_THAT(associate(at, a, 0.5), IsEmpty());
  EXPECT_THAT(associate(a, within, 0.5), ElementsAre(std::pair(0u, 0u)));
}

TEST(Associate, TiesGoToTheSmallerAThenTheSmallerB) {
  const std::vector<double> two{1.0, 2.0}, middle{1.5};
  EXPECT_THAT(associate(two, middle, 1), ElementsAre(std::pair(0u, 0u)));
  EXPECT_THAT(associate(middle, two, 1), ElementsAre(std::pair(0u, 0u)));
}

TEST(Associate, ResultIsSortedForAnyOrderOfTheLists) {
  const std::vector<double> a{3, 1, 2}, b{2.001, 3.001, 1.001};
  EXPECT_THAT(associate(a, b),
              ElementsAre(std::pair(1u, 2u), std::pair(2u, 0u), std::pair(0u, 1u)));
}

TEST(Associate, NeverPairsTimestampsThatAreNotFinite) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinite = std::numeric_limits<double>::infinity();
  const std::vector<double> a{nan, 1, infinite}, b{infinite, nan, 1.001};
  EXPECT_THAT(associate(a, b), ElementsAre(std::pair(1u, 2u)));
  EXPECT_THAT(associate({}, b), IsEmpty());
}

TEST(Associate, EqualsTheLiteralRuleOnJitteredLists) {
  std::mt19937 rng(3);
  std::uniform_real_distribution<double> jitter(-0.02, 0.02);
  for (int round = 0; round < 20; ++round) {
    std::vector<double> a, b;
    for (int i = 0; i < 200; ++i) a.push_back(1341846434 + i / 30.0 + jitter(rng));
    for (int i = 0; i < 260; ++i) b.push_back(1341846433.5 + i / 40.0 + jitter(rng));
    // Timestamps rounded to milliseconds give many exact ties.
    for (auto* list : {&a, &b}) {
      for (double& stamp : *list) stamp = std::round(stamp * 1000) / 1000;
    }
    const Pairs pairs = associate(a, b);
    EXPECT_EQ(pairs, by_the_rule(a, b, 0.02));
    EXPECT_GT(pairs.size(), 100u);
  }
}

}  // namespace
}  // namespace stillmap
