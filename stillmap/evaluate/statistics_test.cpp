// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/statistics.hpp"

#include <cmath>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Statistics, OfAKnownSet) {
  const std::vector<double> errors{4, 1, 2, 3};
  const Statistics s = compute_statistics(errors);
  EXPECT_DOUBLE_EQ(s.rmse, std::sqrt(7.5));
  EXPECT_DOUBLE_EQ(s.mean, 2.5);
  EXPECT_DOUBLE_EQ(s.median, 2.5);
  EXPECT_DOUBLE_EQ(s.sd, std::sqrt(1.25));
  EXPECT_EQ(s.min, 1);
  EXPECT_EQ(s.max, 4);
  EXPECT_EQ(s.count, 4u);
  EXPECT_EQ(compute_statistics({}).count, 0u);
}

TEST(Statistics, QuantilesInterpolateBetweenValues) {
  const std::vector<double> values{40, 10, 30, 20};
  EXPECT_DOUBLE_EQ(quantile(values, 0), 10);
  EXPECT_DOUBLE_EQ(quantile(values, 0.5), 25);
  EXPECT_DOUBLE_EQ(quantile(values, 0.95), 38.5);
  EXPECT_DOUBLE_EQ(quantile(values, 1), 40);
  EXPECT_DOUBLE_EQ(quantile(std::vector<double>{3, 1, 2}, 0.5), 2);
  EXPECT_EQ(quantile({}, 0.5), 0);
}

}  // namespace
}  // namespace stillmap
