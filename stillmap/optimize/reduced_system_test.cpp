// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/reduced_system.hpp"

#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// A chain of blocks with a loop; positive definite by a dominant diagonal.
struct Chain {
  std::vector<ReducedSystem::Block> blocks;
  Eigen::MatrixXd full;
  Eigen::VectorXd rhs;

  explicit Chain(std::uint32_t poses) : full(6 * poses, 6 * poses), rhs(6 * poses) {
    std::mt19937 rng(1);
    std::uniform_real_distribution<double> uniform(-1, 1);
    full.setZero();
    blocks.emplace_back(1, 0);
    blocks.emplace_back(poses - 1, 0);
    for (std::uint32_t i = 1; i + 1 < poses; ++i) blocks.emplace_back(i + 1, i);
    for (const auto& [row, column] : blocks) {
      const Matrix6d B = Matrix6d::NullaryExpr([&](auto, auto) { return uniform(rng); });
      full.block<6, 6>(6 * row, 6 * column) = B;
      full.block<6, 6>(6 * column, 6 * row) = B.transpose();
    }
    full.diagonal().array() += 20;
    for (double& x : rhs) x = uniform(rng);
  }

  void fill(ReducedSystem& system) const {
    system.set_zero();
    for (std::uint32_t i = 0; i < rhs.size() / 6; ++i)
      system.add(i, i, full.block<6, 6>(6 * i, 6 * i));
    for (const auto& [row, column] : blocks) {  // Added in two halves that must sum up.
      system.add(row, column, 0.25 * full.block<6, 6>(6 * row, 6 * column));
      system.add(row, column, 0.75 * full.block<6, 6>(6 * row, 6 * column));
    }
  }
};

TEST(ReducedSystem, DenseAndSparseAgree) {
  const Chain chain(12);
  const Eigen::VectorXd expected = chain.full.partialPivLu().solve(chain.rhs);
  for (const bool dense : {true, false}) {
    ReducedSystem system(12, chain.blocks, dense);
    for (int repeat = 0; repeat < 2; ++repeat) {  // The second time reuses the pattern.
      chain.fill(system);
      const auto x = system.solve(chain.rhs);
      ASSERT_TRUE(x.has_value());
      EXPECT_LT((*x - expected).norm(), 1e-12) << "dense " << dense;
    }
  }
}

TEST(ReducedSystem, ReturnsNothingIfNotPositiveDefinite) {
  const Chain chain(4);
  for (const bool dense : {true, false}) {
    ReducedSystem system(4, chain.blocks, dense);
    chain.fill(system);
    system.add(2, 2, -100 * Matrix6d::Identity());
    EXPECT_FALSE(system.solve(chain.rhs).has_value()) << "dense " << dense;
  }
}

}  // namespace
}  // namespace stillmap
