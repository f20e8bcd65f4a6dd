// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace stillmap {

/// Squared difference from which two poses contradict each other [sigma^2]: the 99.9 % quantile of
/// the chi-square distribution with six degrees of freedom.
inline constexpr double kContradiction = 22.46;

/// Returns the squared length of a difference of two poses [sigma^2].
/// @param covariance  of the difference, not singular
inline double squared_sigmas(const Eigen::Matrix<double, 6, 1>& difference,
                             const Eigen::Matrix<double, 6, 6>& covariance) {
  return difference.dot(covariance.llt().solve(difference));
}

}  // namespace stillmap
