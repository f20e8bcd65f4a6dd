// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/depth_sensor.hpp"
#include "stillmap/geometry/motion_sensors.hpp"

#include <optional>
#include <string>

#include <Eigen/Core>

namespace stillmap {

/// Times at which the rows of a frame are exposed. Zero: all at the timestamps of the images.
struct ShutterTiming {
  double readout = 0;      ///< Time from the first to the last row of an image [s].
  double depth_delay = 0;  ///< Exposure of the depth image minus its timestamp [s].
  bool operator==(const ShutterTiming&) const = default;
};

/// Systematic error of the measured disparity, as structured light and stereo sensors have it:
/// 1 / measured depth = 1 / depth + offset + bow r^2, where r is the distance from the principal
/// point, and 1 in the corners of the image (Teichman, Miller, Thrun, Unsupervised intrinsic
/// calibration of depth sensors via SLAM, RSS 2013). Positive values make depth read short.
struct DisparityBias {
  double offset = 0;  ///< [1/m]
  double bow = 0;     ///< [1/m]
  bool operator==(const DisparityBias&) const = default;
};

/// A pinhole camera. Pixel (0, 0) is the center of the upper left pixel; x right, y down, z
/// forward. Module `sensor` rectifies all frames, so every other module uses an ideal pinhole
/// camera; `distortion`, `disparity_bias` and `ignore` describe the *recorded* images.
struct Camera {
  std::string name = "unnamed";
  int width = 640, height = 480;  ///< Image size [pixels].
  double fx = 525, fy = 525, cx = 319.5,
         cy = 239.5;  ///< Focal lengths and principal point [pixels].
  /// Radial-tangential distortion k1 k2 p1 p2 k3 (Brown 1966, in OpenCV's order).
  Eigen::Matrix<double, 5, 1> distortion = Eigen::Matrix<double, 5, 1>::Zero();
  double depth_factor = 5000;  ///< Raw depth units per meter [1/m].
  double fps = 30;             ///< Nominal frame rate [Hz].
  /// Baseline of the virtual second camera that converts depth to disparity [m].
  double baseline = 0.075;
  /// Minimum standard deviation of the disparity of a keypoint [pixels], due to the registration of
  /// depth and color images. The sensor noise of a Kinect v1 is 0.06 pixels.
  double disparity_sigma = 0.3;
  /// The sensor that measured the depth images.
  DepthSensor depth_sensor = find_depth_sensor("kinect_v1");
  /// Timing of the shutters; if not known, it is estimated from the frames.
  std::optional<ShutterTiming> shutter = std::nullopt;
  DisparityBias disparity_bias = {};  ///< Systematic error of the recorded depth.
  /// The inertial measurement unit fixed to the camera; none if there is none, or if it is not
  /// known.
  std::optional<Imu> imu = std::nullopt;
  /// The wheels of the robot that carries the camera; none if there are none.
  std::optional<Wheels> wheels = std::nullopt;
  /// Mask image of the size of the recorded images: pixels that are not black in it, such as those
  /// of the robot's own gripper, are ignored. Empty: all pixels are used.
  std::string ignore = {};

  bool distorted() const { return !distortion.isZero(0); }
  /// Returns fx * baseline [pixels * m]: disparity = bf / depth.
  double bf() const { return fx * baseline; }

  /// Returns the pixel of a point in front of the camera (p_camera.z > 0), without distortion.
  Eigen::Vector2d project(const Eigen::Vector3d& p_camera) const {
    const double iz = 1.0 / p_camera.z();
    return {fx * p_camera.x() * iz + cx, fy * p_camera.y() * iz + cy};
  }
  /// Returns the point at pixel (u, v) and depth z [m], in the camera frame [m].
  Eigen::Vector3d unproject(double u, double v, double z) const {
    return {(u - cx) / fx * z, (v - cy) / fy * z, z};
  }
  /// Returns the squared distance of a pixel from the principal point, over that of half the
  /// diagonal of the image: see DisparityBias.
  double squared_radius(double u, double v) const {
    const double x = u - cx, y = v - cy;
    return 4 * (x * x + y * y) / (width * width + height * height);
  }
  /// Returns whether pixel (u, v) lies at least `margin` pixels inside the image.
  bool contains(double u, double v, double margin = 0) const {
    return u >= margin && v >= margin && u <= width - 1 - margin && v <= height - 1 - margin;
  }
};

}  // namespace stillmap
