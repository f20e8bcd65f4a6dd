// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/features.hpp"

#include "stillmap/feature/dead_leaves.hpp"

#include <algorithm>
#include <bitset>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

std::vector<Keypoint> random_keypoints(int count, int width, int height, TestRandom& random) {
  std::vector<Keypoint> keypoints(count);
  for (Keypoint& k : keypoints) {
    k.u = static_cast<float>(random.uniform(-1, width));
    k.v = static_cast<float>(random.uniform(-1, height));
    k.level = static_cast<std::uint8_t>(random.below(8));
  }
  return keypoints;
}

std::vector<std::uint32_t> near_by_brute_force(const std::vector<Keypoint>& keypoints, float u,
                                               float v, float radius, int min_level,
                                               int max_level) {
  std::vector<std::uint32_t> found;
  for (std::uint32_t i = 0; i < keypoints.size(); ++i) {
    const Keypoint& k = keypoints[i];
    const bool near = std::abs(k.u - u) <= radius && std::abs(k.v - v) <= radius;
    if (near && k.level >= min_level && k.level <= max_level) found.push_back(i);
  }
  return found;
}

TEST(KeypointGrid, EqualsBruteForce) {
  TestRandom random(1);
  constexpr int kWidth = 201, kHeight = 97;  // No multiples of the cell size.
  const auto keypoints = random_keypoints(700, kWidth, kHeight, random);
  const KeypointGrid grid(keypoints, kWidth, kHeight);
  for (int trial = 0; trial < 500; ++trial) {
    const auto u = static_cast<float>(random.uniform(-40, kWidth + 40));
    const auto v = static_cast<float>(random.uniform(-40, kHeight + 40));
    const auto radius = static_cast<float>(random.uniform(0, 50));
    const int low = random.below(8), high = random.below(8);
    std::vector<std::uint32_t> found;
    grid.for_each_near(u, v, radius, low, high, [&](std::uint32_t i) { found.push_back(i); });
    std::sort(found.begin(), found.end());
    ASSERT_EQ(found, near_by_brute_force(keypoints, u, v, radius, low, high)) << u << " " << v;
  }
}

TEST(KeypointGrid, AnEmptyGridFindsNothing) {
  const auto fail = [](std::uint32_t) { FAIL(); };
  KeypointGrid().for_each_near(10, 10, 100, 0, 7, fail);
  KeypointGrid({}, 640, 480).for_each_near(10, 10, 100, 0, 7, fail);
}

TEST(Distance, CountsDifferingBits) {
  TestRandom random(2);
  for (int trial = 0; trial < 1000; ++trial) {
    Descriptor a{}, b{};
    std::size_t expected = 0;
    for (int i = 0; i < 4; ++i) {
      a[i] = random.next();
      b[i] =
          trial % 2 == 0 ? random.next() : a[i] ^ (random.next() & random.next() & random.next());
      expected += std::bitset<64>(a[i] ^ b[i]).count();
    }
    ASSERT_EQ(distance(a, b), static_cast<int>(expected));
  }
  const Descriptor none{}, all{~0ULL, ~0ULL, ~0ULL, ~0ULL};
  EXPECT_EQ(distance(none, none), 0);
  EXPECT_EQ(distance(none, all), 256);
}

TEST(PyramidShape, ScalesByPowers) {
  const PyramidShape shape{8, 1.2};
  EXPECT_DOUBLE_EQ(shape.scale(0), 1);
  EXPECT_NEAR(shape.scale(7), 3.5831808, 1e-12);
}

}  // namespace
}  // namespace stillmap
