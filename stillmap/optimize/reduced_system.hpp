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

/// Symmetric positive definite system of 6x6 blocks (lower triangle): the reduced camera system of
/// bundle adjustment. Dense for few poses; sparse, with one fill-reducing ordering, for many.
/// Internal to the module.
class ReducedSystem {
 public:
  using Block = std::pair<std::uint32_t, std::uint32_t>;  ///< Block row and column, row >= column.

  /// @param poses  number of block rows
  /// @param blocks off-diagonal blocks that may become non-zero; sorted by column, then row; unique
  /// @param dense  dense or sparse factorisation
  ReducedSystem(std::uint32_t poses, const std::vector<Block>& blocks, bool dense);

  void set_zero();
  /// Adds to block (row, column); row >= column, and off-diagonal blocks must be among the
  /// constructor's.
  void add(std::uint32_t row, std::uint32_t column, const Matrix6d& value);
  /// Returns the solution x for this right-hand side; nothing if the matrix is not positive
  /// definite.
  std::optional<Eigen::VectorXd> solve(const Eigen::VectorXd& rhs);

 private:
  bool dense_;
  Eigen::MatrixXd dense_matrix_;
  Eigen::LLT<Eigen::MatrixXd> dense_factor_;

  Eigen::SparseMatrix<double> sparse_matrix_;
  Eigen::SimplicialLLT<Eigen::SparseMatrix<double>, Eigen::Lower> sparse_factor_;
  std::vector<std::uint32_t> column_begin_;  // first index in rows_ of each block column
  std::vector<std::uint32_t> rows_;  // block rows of each block column, diagonal first, sorted
};

}  // namespace stillmap
