// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"

#include <optional>
#include <span>

#include <Eigen/Core>

namespace stillmap {

/// Error of a depth sensor that varies smoothly over its image:
///   1 / measured = 1 / depth + error(u, v),
/// bilinear between nodes of a coarse grid over the whole image. The error is that of the optics,
/// so all views of a recording share it (Teichman, Miller, Thrun: Unsupervised intrinsic
/// calibration of depth sensors via SLAM, RSS 2013, there as factors of the depth).
class SmoothDepthError {
 public:
  static constexpr int kRows = 5, kCols = 6;  ///< Number of nodes.
  using Nodes = Eigen::Matrix<double, kRows * kCols, 1>;

  explicit SmoothDepthError(const Nodes& nodes) : nodes_(nodes) {}

  /// Returns the error at a pixel of a lattice [1/m].
  double at(double col, double row, const cv::Size& lattice) const;
  /// Returns the depths of a view, DenseView::depth, without the error.
  cv::Mat1w removed_from(const cv::Mat1w& depth) const;

 private:
  Nodes nodes_;  // row by row [1/m]
};

/// Returns the error with which surfaces that views show in different parts of their images agree
/// best; none unless their median disagreement then is a tenth smaller. Its mean is zero: a camera
/// that turns hardly shows it, so that the map keeps the mean depth of the sensor.
std::optional<SmoothDepthError> smooth_depth_error(std::span<const PosedView> views);

}  // namespace stillmap
