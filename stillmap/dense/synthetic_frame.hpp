// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cmath>
#include <functional>

#include <opencv2/core.hpp>

namespace stillmap::testing_support {

/// Returns a camera of 62 degrees with images of 4 : 3.
inline Camera camera_of_width(int width) {
  const double focal = 0.825 * width;
  return {.name = "test",
          .width = width,
          .height = width * 3 / 4,
          .fx = focal,
          .fy = focal,
          .cx = 0.5 * (width - 1),
          .cy = 0.5 * (width * 0.75 - 1)};
}

/// Returns a small camera for tests of this module.
inline Camera small_camera() { return camera_of_width(160); }

/// A plane n . p = d with |n| = 1 [m].
struct Plane {
  Eigen::Vector3d n;
  double d;
  double distance(const Eigen::Vector3d& p) const { return std::abs(n.dot(p) - d); }
};

/// Returns a frame with a given depth of each pixel [m] and the color BGR (u, v, 7).
inline RgbdFrame frame_of(const Camera& camera, const std::function<double(int u, int v)>& depth) {
  RgbdFrame frame;
  frame.color = cv::Mat(camera.height, camera.width, CV_8UC3);
  frame.depth = cv::Mat(camera.height, camera.width, CV_32FC1);
  for (int v = 0; v < camera.height; ++v) {
    for (int u = 0; u < camera.width; ++u) {
      frame.depth.at<float>(v, u) = static_cast<float>(depth(u, v));
      frame.color.at<cv::Vec3b>(v, u) = cv::Vec3b(static_cast<uchar>(u), static_cast<uchar>(v), 7);
    }
  }
  return frame;
}

/// Returns the depth of a world plane at a pixel [m]; 0 if the ray misses it.
inline double plane_depth(const Camera& camera, const Pose& T_world_camera, const Plane& plane,
                          int u, int v) {
  const Eigen::Vector3d ray = T_world_camera.quaternion() * camera.unproject(u, v, 1);
  const double z = (plane.d - plane.n.dot(T_world_camera.translation())) / plane.n.dot(ray);
  return std::isfinite(z) && z > 0 ? z : 0;
}

/// Returns the frame of a world plane from a pose.
inline RgbdFrame view_of(const Camera& camera, const Pose& T_world_camera, const Plane& plane) {
  return frame_of(camera,
                  [&](int u, int v) { return plane_depth(camera, T_world_camera, plane, u, v); });
}

}  // namespace stillmap::testing_support
