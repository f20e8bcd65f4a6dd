// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/geometry/pose.hpp"

#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stillmap {

/// Returns the minimum distance of a measured depth z behind a point to see through it [m], as a
/// function of z. The difference of z and this margin increases with z over the sensor's range.
DepthPolynomial<float> see_through_margin(const DepthSensor& sensor);

/// Vote of a view on a voxel without a static surface of that view.
enum class VoxelVote {
  kNone,         ///< The voxel is occluded, out of view or close to a surface, or has no depth.
  kSeenThrough,  ///< The view sees through it.
  kMover,        ///< A mover's surface is in it.
};

/// A view with its pose in the world: its pixels as points, and its votes.
class PlacedView {
 public:
  /// @param view must outlive the object
  PlacedView(const DenseView& view, const Pose& T_world_camera);

  const DenseView& view() const { return *view_; }
  /// Returns the camera center, world frame [m].
  const Eigen::Vector3d& eye() const { return t_world_camera_; }
  /// Returns the vector from the camera center to a pixel at a depth of 1 m, world frame [m].
  Eigen::Vector3d ray(int row, int col) const {
    return R_world_camera_ * view_->camera.unproject(col, row, 1);
  }
  /// Returns the depth of a pixel [m]; 0 if unknown.
  double depth(int row, int col) const {
    return view_->depth(row, col) * double{DenseView::kDepthUnit};
  }
  /// Returns the point of a pixel with depth, world frame [m].
  Eigen::Vector3d point(int row, int col) const {
    return R_world_camera_ * view_->camera.unproject(col, row, depth(row, col)) + t_world_camera_;
  }

  Eigen::Vector3f in_camera(const Eigen::Vector3f& p_world) const {
    return R_camera_world_ * p_world + t_camera_world_;
  }
  /// Returns a world-frame vector in the camera frame.
  Eigen::Vector3f rotated(const Eigen::Vector3f& d_world) const {
    return R_camera_world_ * d_world;
  }

  /// Returns whether the pixel at a point shows a surface there that is no mover's, camera frame
  /// [m].
  bool shows(const Eigen::Vector3f& p_camera) const;
  /// Returns the vote on a point, camera frame [m].
  VoxelVote at(const Eigen::Vector3f& p_camera) const;
  /// Returns the vote on all points of a ball if it is certain to be the same on each, which it
  /// never is for kMover. Takes as long as at() for a few points.
  std::optional<VoxelVote> within(const Eigen::Vector3f& center_camera, float radius) const;

 private:
  /// Minima and maxima over squares of pixels.
  struct Tiles {
    cv::Mat1w nearest, farthest;  // in units of DenseView::kDepthUnit; 0 if one is unknown
    cv::Mat1b movers;             // not 0 if there are any
  };
  struct Extremes {
    float nearest, farthest;  // [m]
    bool movers;
  };
  /// Pixel bounds, inclusive.
  struct Window {
    int left, right, top, bottom;
  };

  std::optional<cv::Point> inner_pixel(const Eigen::Vector3f& p_camera) const;
  float depth_at(cv::Point pixel) const { return view_->depth(pixel) * DenseView::kDepthUnit; }
  Window window_around(const Eigen::Vector3f& p_camera, float radius) const;
  Extremes extremes_in(const Window& window) const;
  void make_tiles();

  const DenseView* view_;
  DepthPolynomial<float> margin_;
  Eigen::Matrix3d R_world_camera_;
  Eigen::Vector3d t_world_camera_;
  Eigen::Matrix3f R_camera_world_;
  Eigen::Vector3f t_camera_world_;
  float fx_, fy_, cx_, cy_;
  Tiles tiles_;
};

}  // namespace stillmap
