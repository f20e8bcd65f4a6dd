// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Minimum-cost assignment (Kuhn, The Hungarian method, 1955; by shortest augmenting paths with
/// potentials, as Jonker and Volgenant, Computing 38, 1987): each row gets at most one column and
/// each column at most one row, min(rows, columns) pairs in total, with the minimum sum of costs.
/// Deterministic. O(rows^2 * columns) for rows <= columns. Written by hand: dlib and LEMON would be
/// large dependencies for one function of a hundred lines.
///
/// @param cost  finite; forbidden pairs get a number greater than all sums of allowed ones and are
/// removed by the caller afterwards
/// @return column of each row; -1 for unassigned rows if there are more rows than columns
std::vector<int> assign(const Eigen::MatrixXd& cost);

}  // namespace stillmap
