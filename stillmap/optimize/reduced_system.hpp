// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/residual.hpp"

#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>
#include <Eigen/Core>
#include <Eigen/SparseCholesky>

namespace stillmap {

/// A symmetric positive definite system of 6x6 blocks, lower triangle kept: what is left of a
/// bundle once its points are eliminated. Dense for few poses; sparse, with a fill-reducing order
/// found once, for many. Internal to the room.
class ReducedSystem {
 public:
  using Block = std::pair<std::uint32_t, std::uint32_t>;  ///< row >= column, in poses

  /// @param poses  number of block rows
  /// @param blocks off-diagonal blocks that may become non-zero; sorted by column, then row; unique
  /// @param dense  dense or sparse factorisation
  ReducedSystem(std::uint32_t poses, const std::vector<Block>& blocks, bool dense);

  void set_zero();
  /// Block (row, column) += value; row >= column, and off the diagonal one of the constructor's
  /// blocks.
  void add(std::uint32_t row, std::uint32_t column, const Matrix6d& value);
  /// x with (this) x = rhs; nothing if it is not positive definite.
  std::optional<Eigen::VectorXd> solve(const Eigen::VectorXd& rhs);

 private:
  bool dense_;
  Eigen::MatrixXd dense_matrix_;
  Eigen::LLT<Eigen::MatrixXd> dense_factor_;

  Eigen::SparseMatrix<double> sparse_matrix_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> sparse_factor_;
  std::vector<std::uint32_t> column_begin_;  // of each block column in rows_
  std::vector<std::uint32_t> rows_;  // block rows of each block column, diagonal first, sorted
};

}  // namespace stillmap
