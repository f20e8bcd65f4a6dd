// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/depth_sensor.hpp"
#include "stillmap/geometry/pose.hpp"

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stillmap {

/// Projects the pixels of one camera into another one.
class Warp {
 public:
  /// @param T_to_from  pose of the camera `from` in the frame of the camera `to`
  Warp(const Camera& from, const Camera& to, const Pose& T_to_from);

  /// Pixel and depth [m] in the camera `to`; the depth may be negative.
  struct Target {
    float u, v, z;
  };
  /// @param z  depth of pixel (u, v) of the camera `from` [m]
  Target operator()(float u, float v, float z) const {
    const auto along = [&](int i) {
      return z * (H_(i, 0) * u + H_(i, 1) * v + H_(i, 2)) + offset_[i];
    };
    const float depth = along(2), inverse = 1 / depth;
    return {along(0) * inverse, along(1) * inverse, depth};
  }

  /// Returns the depth in `from` of a point that is `scale` times as far from `to`, on the same ray
  /// of it, as a point of depth z in `from` [m].
  float scaled(float z, float scale) const { return scale * z + (1 - scale) * eye_z_; }

 private:
  Eigen::Matrix3f H_;       // of homogeneous pixels for points at infinity
  Eigen::Vector3f offset_;  // the homogeneous pixel of the center of `from`
  float eye_z_;             // depth of the center of `to` in `from` [m]
};

/// The static surfaces of a view, averaged over other depth images.
///
/// Inverse depths are averaged, since the noise of triangulated depth does not depend on the depth
/// there. An image supports the surface of a pixel if its depth agrees within four standard
/// deviations plus 1 cm, and refutes it if it sees farther. A surface that more images refute than
/// support is removed.
class FusedDepth {
 public:
  /// Begins with the depths of the view's static pixels.
  explicit FusedDepth(const DenseView& view);

  /// Adds a depth image.
  /// @param depth   [m]; 0 where there is no static surface
  /// @param movers  depths of moving pixels, which refute a surface at their depth; empty for none
  /// @param T_view_camera  pose of the camera in the frame of the view's camera
  void add(const Camera& camera, const cv::Mat1f& depth, const cv::Mat1f& movers,
           const Pose& T_view_camera);

  /// Sets the surface of a pixel without one [m].
  void set(int row, int col, float depth);
  /// Returns the depth of a pixel [m]; 0 without a surface.
  float at(int row, int col) const;
  /// Returns the largest difference of a measured depth from the surface that it supports [m].
  float agreement(float depth) const { return agreement_.at(depth); }
  /// Returns the standard deviation of the depth of a pixel with a surface [m].
  float sigma(int row, int col) const;

  int supported(int row, int col) const { return supported_(row, col); }
  int refuted(int row, int col) const { return refuted_(row, col); }
  cv::Size size() const { return inverse_.size(); }

 private:
  void support(int row, int col, float depth);
  void refute(int row, int col);

  Camera camera_;
  DepthPolynomial<float> sigma_, agreement_, see_through_;
  cv::Mat1f inverse_;              // mean inverse depth of the surface [1/m]; 0: none
  cv::Mat1b supported_, refuted_;  // number of images, at most 254 and 255
};

}  // namespace stillmap
