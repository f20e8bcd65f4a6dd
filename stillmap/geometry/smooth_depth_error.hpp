// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <memory>

#include <Eigen/Core>

namespace stillmap {

/// Error of a depth sensor that varies smoothly over its image:
///   1 / measured = 1 / depth + error(u, v),
/// bilinear between nodes of a coarse grid over the whole image. The error is that of the optics,
/// so all images of a recording share it (Teichman, Miller, Thrun: Unsupervised intrinsic
/// calibration of depth sensors via SLAM, RSS 2013, there as factors of the depth).
class SmoothDepthError {
 public:
  static constexpr int kRows = 5, kCols = 6;  ///< Number of nodes.
  using Nodes = Eigen::Matrix<double, kRows * kCols, 1>;

  /// The four nodes around a pixel with their bilinear weights.
  struct Weights {
    std::array<int, 4> node;
    std::array<double, 4> weight;
  };

  /// No error.
  SmoothDepthError() : nodes_(Nodes::Zero()) {}
  /// @param nodes  row by row [1/m]
  explicit SmoothDepthError(const Nodes& nodes) : nodes_(nodes) {}

  /// @param size  width and height of the image [pixels]
  static Weights weights_at(double u, double v, const Eigen::Vector2d& size);

  const Nodes& nodes() const { return nodes_; }
  /// Returns the error at a pixel [1/m].
  double at(double u, double v, const Eigen::Vector2d& size) const;
  /// Returns a measured depth without the error, at most twice the depth [m].
  double removed_from(double depth, double u, double v, const Eigen::Vector2d& size) const;

  SmoothDepthError operator+(const SmoothDepthError& more) const {
    return SmoothDepthError(nodes_ + more.nodes_);
  }
  SmoothDepthError operator-(const SmoothDepthError& less) const {
    return SmoothDepthError(nodes_ - less.nodes_);
  }

 private:
  Nodes nodes_;
};

/// The error that keypoints are without; null: none was removed.
using DepthErrorPtr = std::shared_ptr<const SmoothDepthError>;

}  // namespace stillmap
