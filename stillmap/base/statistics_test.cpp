// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/statistics.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Statistics, FindsTheValueOfARank) {
  std::vector<int> values = {4, 1, 3, 2, 5};
  for (std::size_t rank = 0; rank < values.size(); ++rank)
    EXPECT_EQ(value_of_rank(values, rank), static_cast<int>(rank) + 1);
}

TEST(Statistics, TheMedianOfAnEvenNumberOfValuesIsTheLargerInTheMiddle) {
  std::vector<double> odd = {3, 1, 2}, even = {4, 1, 3, 2};
  EXPECT_EQ(upper_median(odd), 2);
  EXPECT_EQ(upper_median(even), 3);
}

TEST(Statistics, QuantilesAreInterpolated) {
  const std::vector<double> values = {30, 10, 20};
  EXPECT_EQ(quantile(values, 0), 10);
  EXPECT_EQ(quantile(values, 0.25), 15);
  EXPECT_EQ(quantile(values, 0.5), 20);
  EXPECT_EQ(quantile(values, 1), 30);
  EXPECT_EQ(quantile({}, 0.5), 0);
}

}  // namespace
}  // namespace stillmap
