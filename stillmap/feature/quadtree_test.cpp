// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/quadtree.hpp"

#include "stillmap/feature/dead_leaves.hpp"

#include <algorithm>
#include <set>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Rect kArea(16, 16, 600, 400);

/// Returns corners of which most are in the upper left tenth of the area.
std::vector<Corner> crowded_corners(int count, std::uint64_t seed) {
  TestRandom random(seed);
  std::set<std::pair<int, int>> places;
  while (static_cast<int>(places.size()) < count) {
    const bool crowd = places.size() % 4 != 0;
    const int x = random.below(crowd ? 190 : kArea.width),
              y = random.below(crowd ? 126 : kArea.height);
    places.emplace(kArea.y + y, kArea.x + x);
  }
  std::vector<Corner> corners;
  for (const auto& [y, x] : places) corners.push_back({x, y, 8 + random.below(100)});
  return corners;
}

int occupied_cells(const std::vector<Corner>& corners, int columns, int rows) {
  std::set<int> cells;
  for (const Corner& c : corners) {
    cells.insert((c.y - kArea.y) * rows / kArea.height * columns +
                 (c.x - kArea.x) * columns / kArea.width);
  }
  return static_cast<int>(cells.size());
}

TEST(Quadtree, ReturnsExactlyTheWantedNumber) {
  const auto corners = crowded_corners(2000, 1);
  QuadtreeSpreader spreader;
  for (const int wanted : {1, 2, 3, 5, 50, 333, 1999}) {
    EXPECT_EQ(spreader.spread(corners, kArea, wanted).size(), static_cast<std::size_t>(wanted));
  }
  EXPECT_EQ(spreader.spread(corners, kArea, 2000), corners);
  EXPECT_EQ(spreader.spread(corners, kArea, 5000), corners);
  EXPECT_TRUE(spreader.spread(corners, kArea, 0).empty());
  EXPECT_TRUE(spreader.spread({}, kArea, 10).empty());
}

TEST(Quadtree, KeepsTheirOrder) {
  QuadtreeSpreader spreader;
  const auto corners = crowded_corners(1000, 2);
  const auto kept = spreader.spread(corners, kArea, 300);
  EXPECT_TRUE(std::is_sorted(kept.begin(), kept.end(), [](const Corner& a, const Corner& b) {
    return std::pair(a.y, a.x) < std::pair(b.y, b.x);
  }));
}

TEST(Quadtree, CoversTheAreaUnlikeTheStrongest) {
  const auto corners = crowded_corners(2000, 3);
  QuadtreeSpreader spreader;
  const auto spread = spreader.spread(corners, kArea, 256);
  auto strongest = corners;
  std::stable_sort(strongest.begin(), strongest.end(),
                   [](const Corner& a, const Corner& b) { return a.score > b.score; });
  strongest.resize(256);
  // 500 corners are distributed evenly, so a 12 x 8 grid has no empty cell.
  ASSERT_EQ(occupied_cells(corners, 12, 8), 96);
  EXPECT_EQ(occupied_cells(spread, 12, 8), 96);
  EXPECT_LT(occupied_cells(strongest, 12, 8), 80);
}

TEST(Quadtree, KeepsTheStrongestOfEachPart) {
  // Four clusters, one in each quarter: with four wanted, the strongest of each must be kept.
  std::vector<Corner> corners;
  for (const int y : {100, 300}) {
    for (int row = 0; row < 5; ++row) {
      for (const int x : {150, 450}) {
        for (int i = 0; i < 5; ++i)
          corners.push_back({x + 2 * i, y + 2 * row, row == 2 && i == 3 ? 90 : 30 + i});
      }
    }
  }
  QuadtreeSpreader spreader;
  const auto kept = spreader.spread(corners, kArea, 4);
  ASSERT_EQ(kept.size(), 4U);
  for (const Corner& c : kept) EXPECT_EQ(c.score, 90);
}

TEST(Quadtree, AcceptsCornersAtOnePosition) {
  const std::vector<Corner> corners(50, Corner{100, 100, 20});
  QuadtreeSpreader spreader;
  EXPECT_EQ(spreader.spread(corners, kArea, 10).size(), 1U);
}

}  // namespace
}  // namespace stillmap
