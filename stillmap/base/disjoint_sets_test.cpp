// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/disjoint_sets.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(DisjointSets, TheRootIsTheSmallestNumberOfTheSet) {
  DisjointSets sets(6);
  for (std::size_t i = 0; i < 6; ++i) EXPECT_EQ(sets.root(i), i);
  EXPECT_TRUE(sets.unite(5, 3));
  EXPECT_TRUE(sets.unite(2, 4));
  EXPECT_TRUE(sets.unite(4, 5));
  EXPECT_FALSE(sets.unite(3, 2)) << "they are connected through 4 and 5";
  for (const std::size_t i : {2U, 3U, 4U, 5U}) EXPECT_EQ(sets.root(i), 2U);
  EXPECT_EQ(sets.root(0), 0U);
  EXPECT_EQ(sets.root(1), 1U);
}

}  // namespace
}  // namespace stillmap
