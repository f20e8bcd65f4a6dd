// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/reduced_system.hpp"

#include <algorithm>

namespace stillmap {

ReducedSystem::ReducedSystem(std::uint32_t poses, const std::vector<Block>& blocks, bool dense)
    : dense_(dense) {
  if (dense_) {
    dense_matrix_ = Eigen::MatrixXd::Zero(6 * poses, 6 * poses);
    return;
  }
  auto block = blocks.begin();
  for (std::uint32_t column = 0; column < poses; ++column) {
    column_begin_.push_back(static_cast<std::uint32_t>(rows_.size()));
    rows_.push_back(column);
    for (; block != blocks.end() && block->second == column; ++block) rows_.push_back(block->first);
  }
  column_begin_.push_back(static_cast<std::uint32_t>(rows_.size()));

  sparse_matrix_.resize(6 * poses, 6 * poses);
  sparse_matrix_.reserve(static_cast<Eigen::Index>(36 * rows_.size()));
  for (std::uint32_t column = 0; column < 6 * poses; ++column) {
    sparse_matrix_.startVec(column);
    for (auto i = column_begin_[column / 6]; i < column_begin_[column / 6 + 1]; ++i) {
      for (int r = 0; r < 6; ++r) sparse_matrix_.insertBack(6 * rows_[i] + r, column) = 0;
    }
  }
  sparse_matrix_.finalize();
  sparse_factor_.analyzePattern(sparse_matrix_);
}

void ReducedSystem::set_zero() {
  if (dense_) {
    dense_matrix_.setZero();
  } else {
    std::fill_n(sparse_matrix_.valuePtr(), sparse_matrix_.nonZeros(), 0.0);
  }
}

void ReducedSystem::add(std::uint32_t row, std::uint32_t column, const Matrix6d& value) {
  if (dense_) {
    dense_matrix_.block<6, 6>(6 * row, 6 * column) += value;
    return;
  }
  // The six columns of a block column have the same rows, diagonal block first and complete.
  const auto first = rows_.begin() + column_begin_[column];
  const auto last = rows_.begin() + column_begin_[column + 1];
  const auto position = std::lower_bound(first, last, row) - first;
  const Eigen::Index height = 6 * (last - first);
  double* target =
      sparse_matrix_.valuePtr() + 36 * Eigen::Index{column_begin_[column]} + 6 * position;
  for (int c = 0; c < 6; ++c) Eigen::Map<Vector6d>(target + c * height) += value.col(c);
}

std::optional<Eigen::VectorXd> ReducedSystem::solve(const Eigen::VectorXd& rhs) {
  if (dense_) {
    dense_factor_.compute(dense_matrix_);
    if (dense_factor_.info() != Eigen::Success) return std::nullopt;
    return dense_factor_.solve(rhs);
  }
  sparse_factor_.factorize(sparse_matrix_);
  if (sparse_factor_.info() != Eigen::Success) return std::nullopt;
  return sparse_factor_.solve(rhs);
}

}  // namespace stillmap
