// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Minimum-cost assignment (Kuhn, The Hungarian method, 1955; by shortest augmenting paths with
/// potentials, as Jonker and Volgenant, Computing 38, 1987): each row gets at most one column and
/// each column at most one row, min(rows, columns) pairs in all, with the least sum of costs. Equal
/// input gives equal output. O(rows^2 * columns) for rows <= columns.
///
/// @param cost finite; for pairs that must not be, a number greater than all sums of allowed ones,
///             to be sorted out by the caller afterwards
/// @return per row its column; -1 for the rows left over where there are more rows than columns
std::vector<int> assign(const Eigen::MatrixXd& cost);

}  // namespace stillmap
