// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A quadratic polynomial in a depth z: constant + linear z + quadratic z^2 [m].
template <typename T>
struct DepthPolynomial {
  T constant = 0;   ///< [m]
  T linear = 0;     ///< [1]
  T quadratic = 0;  ///< [1/m]
  T at(T z) const { return constant + linear * z + quadratic * z * z; }
};

/// The measuring principle of a depth camera.
enum class DepthPrinciple {
  kStructuredLight,  ///< One camera and a projected pattern, triangulated.
  kActiveStereo,     ///< Two cameras and a projected texture, triangulated.
  kStereo,           ///< Two cameras, triangulated.
  kTimeOfFlight,     ///< The phase of modulated light.
  kIdeal,            ///< Exact depth at every pixel.
};

/// Noise and range of a depth camera. The default is the ideal sensor; docs/sensors.md lists the
/// models with the sources of their figures.
struct DepthSensor {
  std::string name = "ideal";
  DepthPrinciple principle = DepthPrinciple::kIdeal;
  /// Standard deviation of a depth reading as a function of the depth.
  DepthPolynomial<double> noise{};
  double min_depth = 0.1;  ///< Shortest depth that the sensor measures [m].
  double max_depth = 20;   ///< Longest depth that the sensor measures [m].
  /// Distance between the two cameras, or camera and projector [m]; 0 where nothing is
  /// triangulated.
  double baseline = 0;

  /// Focal length of the sensor's disparity image [pixels], and the smallest step of its
  /// disparities [pixels]; 0: no steps.
  double focal = 0, disparity_step = 0;
  double depth_step = 0;     ///< Smallest step of the depth of a sensor without disparities [m].
  double lateral_sigma = 0;  ///< Standard deviation of a reading's position [pixels].
  double grazing = 90;  ///< Surfaces at a larger angle to the image plane give no depth [degrees].
  /// Readout time of a rolling shutter from the first to the last row [s]; 0: not known. It is the
  /// first guess for a recording, whose frames decide.
  double readout = 0;
  double edge_loss = 0;  ///< Share of the pixels at depth edges that give no depth [0..1].
  /// Factor on the bounds for depth_at_sigma(), which are for rooms: a pair of cameras with a wide
  /// baseline sees larger scenes.
  double scene_scale = 1;

  /// Returns the standard deviation of a reading at depth z [m].
  double sigma(double z) const { return noise.at(z); }

  /// Returns a tolerance for measured depths: `sigmas` standard deviations plus `floor` [m], which
  /// is for errors other than sensor noise.
  template <typename T>
  DepthPolynomial<T> tolerance(double sigmas, double floor) const {
    return {static_cast<T>(floor + sigmas * noise.constant), static_cast<T>(sigmas * noise.linear),
            static_cast<T>(sigmas * noise.quadratic)};
  }

  /// Returns the depth up to which the standard deviation is below `sigma` times the scale of the
  /// scene [m], at most max_depth.
  float depth_at_sigma(double sigma) const;
};

/// Returns the names of all models: kinect_v1 (also the Asus Xtion), realsense_d435i,
/// realsense_d455, realsense_d405, azure_kinect, stereo (of a common baseline), ideal.
const std::vector<std::string>& depth_sensor_names();

/// Returns the model of a sensor. Throws Error with the nearest known name for an unknown one.
const DepthSensor& find_depth_sensor(const std::string& name);

/// Returns the name of the model for a RealSense camera, by the model number in a text that
/// describes it, such as that of a device or topic; realsense_d435i without a known number.
std::string realsense_sensor_named(std::string_view text);

/// Returns the model of depth from a rectified pair of cameras by semi-global matching.
/// @param focal     focal length of the rectified images [pixels]
/// @param baseline  distance between the cameras [m]
DepthSensor stereo_sensor(double focal, double baseline);

/// Returns the model of a sensor as find_depth_sensor(), but of "stereo" that for this focal length
/// [pixels] and baseline [m].
DepthSensor depth_sensor_of(const std::string& name, double focal, double baseline);

}  // namespace stillmap
