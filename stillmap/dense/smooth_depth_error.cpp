// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/smooth_depth_error.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

constexpr int kNodes = SmoothDepthError::kRows * SmoothDepthError::kCols;

/// Views are compared if they turn by angles between these [rad], so that surfaces are in different
/// parts of the images, and are at most this far apart [m].
constexpr double kLeastTurn = 0.05, kMostTurn = 1, kFarthest = 1;
/// Number of views that a view is compared with, and distance of the compared pixels.
constexpr std::size_t kPartners = 12;
constexpr int kStep = 6;
/// Pixels are compared that are farther apart than this share of the width: noise dominates others.
constexpr double kLeastDistance = 0.1;
/// Largest difference of the inverse depths of one surface [1/m], and steepness of a surface:
/// largest relative difference of the depths of neighbors.
constexpr double kMostDifference = 0.06, kSteepest = 0.02;
/// Nearest and farthest depth of a compared pixel [m]: the error of poses matters for near ones.
constexpr double kNearest = 0.8, kFarthestDepth = 6;
/// Standard deviation of a difference [1/m], and number of differences that count as one, as
/// neighbors and views share their errors.
constexpr double kSigma = 0.005, kAlike = 50;
/// Standard deviation of the error at a node, and of the difference of neighboring nodes [1/m].
constexpr double kNodeSigma = 0.03, kStepSigma = 0.015;
constexpr int kIterations = 4;
/// Minimum number of differences, and largest share of their median that may be left.
constexpr std::size_t kMinDifferences = 2000;
constexpr double kMostLeft = 0.9;

/// Bilinear weights of the four nodes around a pixel.
struct Weights {
  std::array<int, 4> node;
  std::array<double, 4> weight;
};

Weights weights_at(double col, double row, const cv::Size& lattice) {
  const double x = std::clamp(col / (lattice.width - 1), 0.0, 1.0) * (SmoothDepthError::kCols - 1);
  const double y = std::clamp(row / (lattice.height - 1), 0.0, 1.0) * (SmoothDepthError::kRows - 1);
  const int c = std::min(static_cast<int>(x), SmoothDepthError::kCols - 2);
  const int r = std::min(static_cast<int>(y), SmoothDepthError::kRows - 2);
  const double right = x - c, down = y - r;
  const int first = r * SmoothDepthError::kCols + c;
  return {{first, first + 1, first + SmoothDepthError::kCols, first + SmoothDepthError::kCols + 1},
          {(1 - down) * (1 - right), (1 - down) * right, down * (1 - right), down * right}};
}

/// A surface that two views measure: its inverse depth as predicted from the first one minus that
/// measured in the second one, and the derivatives by the errors at the nodes of both pixels.
struct Difference {
  double inverse_depth = 0;  // [1/m]
  std::array<int, 8> node{};
  std::array<double, 8> slope{};

  double predicted(const SmoothDepthError::Nodes& nodes) const {
    double sum = 0;
    for (std::size_t i = 0; i < node.size(); ++i) sum += slope[i] * nodes[node[i]];
    return sum;
  }
};

/// Returns the depth of a pixel on a flat static surface [m]; 0 for others.
double flat_depth(const DenseView& view, int row, int col) {
  if (row < 1 || col < 1 || row + 1 >= view.depth.rows || col + 1 >= view.depth.cols) return 0;
  const double z = view.depth(row, col);
  for (const auto& [r, c] :
       {std::pair(row - 1, col), {row + 1, col}, {row, col - 1}, {row, col + 1}}) {
    if (!view.is_static(r, c) || std::abs(view.depth(r, c) - z) > kSteepest * z) return 0;
  }
  return view.is_static(row, col) ? z * DenseView::kDepthUnit : 0;
}

void compare(const PosedView& a, const PosedView& b, std::vector<Difference>& differences) {
  const Pose T_b_a = b.T_world_camera.inverse() * a.T_world_camera;
  const Camera& camera = b.view->camera;
  const double least = kLeastDistance * camera.width;
  for (int row = kStep / 2; row < a.view->depth.rows; row += kStep) {
    for (int col = kStep / 2; col < a.view->depth.cols; col += kStep) {
      const double z = flat_depth(*a.view, row, col);
      if (z < kNearest || z > kFarthestDepth) continue;
      const Eigen::Vector3d p = T_b_a * a.view->camera.unproject(col, row, z);
      if (p.z() < kNearest) continue;
      const Eigen::Vector2d uv = camera.project(p);
      if (!camera.contains(uv.x(), uv.y()) || (uv - Eigen::Vector2d(col, row)).norm() < least)
        continue;
      const double seen = flat_depth(*b.view, static_cast<int>(std::lround(uv.y())),
                                     static_cast<int>(std::lround(uv.x())));
      if (seen <= 0) continue;
      Difference difference{.inverse_depth = 1 / p.z() - 1 / seen};
      if (std::abs(difference.inverse_depth) > kMostDifference) continue;
      const Weights first = weights_at(col, row, a.view->depth.size());
      const Weights second = weights_at(uv.x(), uv.y(), b.view->depth.size());
      for (std::size_t i = 0; i < 4; ++i) {
        difference.node[i] = first.node[i];
        difference.slope[i] = first.weight[i] * z / p.z();
        difference.node[i + 4] = second.node[i];
        difference.slope[i + 4] = -second.weight[i];
      }
      differences.push_back(difference);
    }
  }
}

/// Returns the numbers of the views that a view is compared with.
std::vector<std::size_t> partners(std::span<const PosedView> views, std::size_t view) {
  std::vector<std::size_t> found;
  const Pose T_camera_world = views[view].T_world_camera.inverse();
  for (std::size_t other = 0; other < views.size(); ++other) {
    const Pose between = T_camera_world * views[other].T_world_camera;
    if (between.angle() > kLeastTurn && between.angle() < kMostTurn &&
        between.translation().norm() < kFarthest)
      found.push_back(other);
  }
  const std::size_t step = (found.size() + kPartners - 1) / kPartners;
  std::vector<std::size_t> chosen;
  for (std::size_t i = 0; i < found.size(); i += step) chosen.push_back(found[i]);
  return chosen;
}

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

/// Returns the errors at the nodes by iteratively reweighted least squares (Cauchy).
SmoothDepthError::Nodes fitted(const std::vector<Difference>& differences) {
  SmoothDepthError::Nodes nodes = SmoothDepthError::Nodes::Zero();
  const Information H_prior = prior();
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    Information H = H_prior;
    SmoothDepthError::Nodes b = SmoothDepthError::Nodes::Zero();
    for (const Difference& d : differences) {
      const double left = (d.inverse_depth - d.predicted(nodes)) / kSigma;
      const double weight = 1 / (kAlike * kSigma * kSigma * (1 + left * left));
      for (std::size_t i = 0; i < d.node.size(); ++i) {
        b[d.node[i]] += weight * d.slope[i] * d.inverse_depth;
        for (std::size_t j = 0; j < d.node.size(); ++j)
          H(d.node[i], d.node[j]) += weight * d.slope[i] * d.slope[j];
      }
    }
    nodes = H.ldlt().solve(b);
  }
  return nodes;
}

double median_left(const std::vector<Difference>& differences,
                   const SmoothDepthError::Nodes& nodes) {
  std::vector<double> left;
  left.reserve(differences.size());
  for (const Difference& d : differences)
    left.push_back(std::abs(d.inverse_depth - d.predicted(nodes)));
  return upper_median(left);
}

}  // namespace

double SmoothDepthError::at(double col, double row, const cv::Size& lattice) const {
  const Weights weights = weights_at(col, row, lattice);
  double error = 0;
  for (std::size_t i = 0; i < 4; ++i) error += weights.weight[i] * nodes_[weights.node[i]];
  return error;
}

cv::Mat1w SmoothDepthError::removed_from(const cv::Mat1w& depth) const {
  cv::Mat1w result(depth.size(), std::uint16_t{0});
  for (int row = 0; row < depth.rows; ++row) {
    for (int col = 0; col < depth.cols; ++col) {
      if (depth(row, col) == 0) continue;
      const double inverse =
          1 / (depth(row, col) * double{DenseView::kDepthUnit}) - at(col, row, depth.size());
      result(row, col) = packed_depth(static_cast<float>(1 / inverse));
    }
  }
  return result;
}

std::optional<SmoothDepthError> smooth_depth_error(std::span<const PosedView> views) {
  const TraceScope scope("smooth depth error");
  std::vector<Difference> differences;
  for (std::size_t view = 0; view < views.size(); ++view) {
    for (const std::size_t other : partners(views, view)) {
      compare(views[view], views[other], differences);
      views[other].view->drop_pages();
    }
    views[view].view->drop_pages();
  }
  if (differences.size() < kMinDifferences) return std::nullopt;
  const SmoothDepthError::Nodes nodes = fitted(differences);
  const double before = median_left(differences, SmoothDepthError::Nodes::Zero());
  const double after = median_left(differences, nodes);
  if (after > kMostLeft * before) return std::nullopt;
  return SmoothDepthError(nodes);
}

}  // namespace stillmap
