// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/depth_error_fit.hpp"

#include "stillmap/base/statistics.hpp"

#include <cmath>
#include <span>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

constexpr int kNodes = SmoothDepthError::kRows * SmoothDepthError::kCols;

/// Standard deviation of a difference [1/m], and number of differences that count as one, as
/// neighbors and images share their errors.
constexpr double kSigma = 0.005, kAlike = 50;
/// Standard deviation of the error at a node, and of the difference of neighboring nodes [1/m].
constexpr double kNodeSigma = 0.03, kStepSigma = 0.015;
constexpr int kIterations = 4;
/// Minimum number of differences, and largest share of their median that may be left, and in a half
/// of them by the error that the other half shows.
constexpr std::size_t kMinDifferences = 2000;
constexpr double kMostLeft = 0.9, kMostLeftOfOther = 0.95;

using Information = Eigen::Matrix<double, kNodes, kNodes>;

/// Returns the information of the priors: small errors that vary smoothly, with a mean of zero.
Information prior() {
  constexpr double kMeanSigma = 1e-4;  // [1/m]
  Information H = Information::Identity() / (kNodeSigma * kNodeSigma) +
                  Information::Constant(1 / std::pow(kMeanSigma * kNodes, 2));
  const double step = 1 / (kStepSigma * kStepSigma);
  const auto add = [&](int a, int b) {
    H(a, a) += step;
    H(b, b) += step;
    H(a, b) -= step;
    H(b, a) -= step;
  };
  for (int r = 0; r < SmoothDepthError::kRows; ++r) {
    for (int c = 0; c < SmoothDepthError::kCols; ++c) {
      const int node = r * SmoothDepthError::kCols + c;
      if (c + 1 < SmoothDepthError::kCols) add(node, node + 1);
      if (r + 1 < SmoothDepthError::kRows) add(node, node + SmoothDepthError::kCols);
    }
  }
  return H;
}

using Differences = std::span<const DepthDifference>;

/// Iteratively reweighted least squares (Cauchy).
SmoothDepthError fitted(Differences differences) {
  SmoothDepthError error;
  const Information H_prior = prior();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Information H = H_prior;
    SmoothDepthError::Nodes b = SmoothDepthError::Nodes::Zero();
    for (const DepthDifference& d : differences) {
      const double left = d.without(error) / kSigma;
      const double weight = 1 / (kAlike * kSigma * kSigma * (1 + left * left));
      for (std::size_t i = 0; i < d.node.size(); ++i) {
        b[d.node[i]] += weight * d.slope[i] * d.inverse_depth;
        for (std::size_t j = 0; j < d.node.size(); ++j)
          H(d.node[i], d.node[j]) += weight * d.slope[i] * d.slope[j];
      }
    }
    error = SmoothDepthError(H.ldlt().solve(b));
  }
  return error;
}

double median_without(const SmoothDepthError& error, Differences differences) {
  std::vector<double> left;
  left.reserve(differences.size());
  for (const DepthDifference& d : differences) left.push_back(std::abs(d.without(error)));
  return upper_median(left);
}

/// Returns the share of the median difference that an error does not explain [1].
double unexplained(const SmoothDepthError& error, Differences differences) {
  return median_without(error, differences) / median_without({}, differences);
}

}  // namespace

DepthDifference::DepthDifference(const PixelDepth& from, const PixelDepth& to, double predicted,
                                 const Eigen::Vector2d& size)
    : inverse_depth(1 / predicted - 1 / to.depth) {
  const auto first = SmoothDepthError::weights_at(from.u, from.v, size);
  const auto second = SmoothDepthError::weights_at(to.u, to.v, size);
  for (std::size_t i = 0; i < 4; ++i) {
    node[i] = first.node[i];
    slope[i] = first.weight[i] * from.depth / predicted;
    node[i + 4] = second.node[i];
    slope[i + 4] = -second.weight[i];
  }
}

double DepthDifference::without(const SmoothDepthError& error) const {
  double left = inverse_depth;
  for (std::size_t i = 0; i < node.size(); ++i) left -= slope[i] * error.nodes()[node[i]];
  return left;
}

std::optional<SmoothDepthError> fit_depth_error(const std::vector<DepthDifference>& differences) {
  if (differences.size() < kMinDifferences) return std::nullopt;
  const Differences all(differences);
  const Differences first = all.first(all.size() / 2), second = all.subspan(all.size() / 2);
  SmoothDepthError error = fitted(all);
  if (unexplained(error, all) > kMostLeft ||
      unexplained(fitted(first), second) > kMostLeftOfOther ||
      unexplained(fitted(second), first) > kMostLeftOfOther)
    return std::nullopt;
  return error;
}

}  // namespace stillmap
