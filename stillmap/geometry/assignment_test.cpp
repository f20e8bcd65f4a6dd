// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/assignment.hpp"

#include <algorithm>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns the minimum sum over all assignments of rows to columns (rows <= columns).
double least_sum(const Eigen::MatrixXd& cost) {
  std::vector<int> columns(static_cast<std::size_t>(cost.cols()));
  std::iota(columns.begin(), columns.end(), 0);
  double least = 1e300;
  do {
    double sum = 0;
    for (int row = 0; row < cost.rows(); ++row) {
      sum += cost(row, columns[static_cast<std::size_t>(row)]);
    }
    least = std::min(least, sum);
  } while (std::next_permutation(columns.begin(), columns.end()));
  return least;
}

TEST(Assign, FindsTheLeastSumOfAllPermutations) {
  std::mt19937 random(7);
  std::uniform_real_distribution<double> uniform(-5, 5);
  for (int round = 0; round < 200; ++round) {
    const int rows = 1 + round % 6, columns = rows + round / 7 % 2;
    Eigen::MatrixXd cost(rows, columns);
    for (double& value : cost.reshaped()) value = uniform(random);
    const std::vector<int> column_of = assign(cost);
    double sum = 0;
    for (int row = 0; row < rows; ++row) sum += cost(row, column_of[static_cast<std::size_t>(row)]);
    EXPECT_NEAR(sum, least_sum(cost), 1e-9);
    const std::vector<int> row_of = assign(cost.transpose());
    EXPECT_EQ(std::count(row_of.begin(), row_of.end(), -1), columns - rows);
    for (int row = 0; row < rows; ++row) {
      EXPECT_EQ(row_of[static_cast<std::size_t>(column_of[static_cast<std::size_t>(row)])], row);
    }
  }
}

TEST(Assign, TheNearestPairIsNotAssignedIfTheSumIsLower) {
  Eigen::MatrixXd cost(2, 2);
  cost << 1, 2, 2, 9;
  EXPECT_EQ(assign(cost), (std::vector<int>{1, 0}));
}

TEST(Assign, AcceptsEmptyInput) {
  EXPECT_TRUE(assign(Eigen::MatrixXd(0, 3)).empty());
  EXPECT_EQ(assign(Eigen::MatrixXd(2, 0)), (std::vector<int>{-1, -1}));
}

}  // namespace
}  // namespace stillmap
