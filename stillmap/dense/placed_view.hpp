// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cstdint>
#include <optional>

#include <Eigen/Core>
#include <opencv2/core.hpp>

namespace stillmap {

/// How far behind a place a measurement must lie to see through it, as a function of the measured
/// depth z. z less this margin grows with z for every depth that the sensor measures.
DepthPolynomial<float> see_through_margin(const DepthSensor& sensor);

/// What a view has to say on a place where it has no static surface.
enum class Sight {
  kNothing,  ///< the place is hidden, out of view, just before a surface, or there is no depth
  kThrough,  ///< it sees through it
  kMover,    ///< a mover's surface is there
};

/// A view at its place in the world: its pixels as points, and what it says on places.
class PlacedView {
 public:
  /// @param view must outlive it
  PlacedView(const DenseView& view, const Pose& T_world_camera);

  const DenseView& view() const { return *view_; }
  /// Where the camera stands, world frame [m].
  const Eigen::Vector3d& eye() const { return t_world_camera_; }
  /// From the eye to a pixel at a depth of one meter, world frame.
  Eigen::Vector3d ray(int row, int col) const {
    return R_world_camera_ * view_->camera.unproject(col, row, 1);
  }
  /// Depth of a pixel [m]; 0 unknown.
  double depth(int row, int col) const {
    return view_->depth(row, col) * double{DenseView::kDepthUnit};
  }
  /// A pixel with a depth as a point, world frame [m].
  Eigen::Vector3d point(int row, int col) const {
    return R_world_camera_ * view_->camera.unproject(col, row, depth(row, col)) + t_world_camera_;
  }

  Eigen::Vector3f in_camera(const Eigen::Vector3f& p_world) const {
    return R_camera_world_ * p_world + t_camera_world_;
  }
  /// A direction, world frame, in that of the camera.
  Eigen::Vector3f turned(const Eigen::Vector3f& d_world) const { return R_camera_world_ * d_world; }

  /// On a point, camera frame [m].
  Sight at(const Eigen::Vector3f& p_camera) const;
  /// On all points of a ball at once, if it is sure to be the same on each; kMover never is.
  /// Costs as much as at() on a few of them.
  std::optional<Sight> within(const Eigen::Vector3f& center_camera, float radius) const;

 private:
  /// Extremes over squares of pixels.
  struct Tiles {
    cv::Mat1w nearest, farthest;  // in units of DenseView::kDepthUnit; 0 where one is unknown
    cv::Mat1b movers;             // whether there are any
  };
  struct Extremes {
    float nearest, farthest;  // [m]
    bool movers;
  };
  /// Pixels from low to high, ends included.
  struct Window {
    int left, right, top, bottom;
  };

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
