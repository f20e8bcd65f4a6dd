// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/depth_sensor.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

namespace stillmap {
namespace {

/// Noise: Nguyen, Izadi and Lovell, "Modeling Kinect Sensor Noise for Improved 3D Reconstruction
/// and Tracking", 3DIMPVT 2012, equation 4: 0.0012 + 0.0019 (z - 0.4)^2, multiplied out. It agrees
/// with the 1.4e-3 z^2 of Khoshelham and Elberink (Sensors 2012, equation 10) within 20 % from 1.3
/// m to 5 m. Steps of 1/8 pixel of disparity: ibid., section 2.2. The Asus Xtion holds the same
/// sensor. The readout time was measured on recordings of two devices
/// (lab/records/real_sensors.md).
DepthSensor kinect_v1() {
  return {.name = "kinect_v1",
          .principle = DepthPrinciple::kStructuredLight,
          .noise = {.constant = 0.001504, .linear = -0.00152, .quadratic = 0.0019},
          .min_depth = 0.45,
          .max_depth = 7.5,
          .baseline = 0.075,
          .focal = 580,
          .disparity_step = 0.125,
          .lateral_sigma = 0.5,
          .grazing = 80,
          .readout = 0.027,
          .edge_loss = 0.4};
}

/// Intel, "Best-Known-Methods for Tuning Intel RealSense D400 Depth Cameras for Best Performance":
/// RMS depth error = z^2 * subpixel / (f * baseline) with f = width / (2 tan(HFOV / 2)), and the
/// shortest depth f * baseline / 126, 126 being the largest disparity that is searched. At
/// 848 x 480 pixels, the recommended resolution, and HFOV = 87 degrees (D400 series datasheet),
/// f = 446.8 pixels; subpixel = 0.08 pixels is the guide's figure for a textured target. Steps of
/// 1/32 pixel: disparities are integers of that unit (librealsense, disparity transform). The
/// longest depth is our choice: sigma(10 m) = 0.36 m for the D435i, 0.19 m for the D455. The D405
/// (baseline 18 mm, no projector; D400 series datasheet) is made for 0.07 to 0.5 m.
DepthSensor realsense(const std::string& name, double baseline) {
  constexpr double kFocal = 446.8, kSubpixel = 0.08, kDisparities = 126;
  return {.name = name,
          .principle = DepthPrinciple::kActiveStereo,
          .noise = {.quadratic = kSubpixel / (kFocal * baseline)},
          .min_depth = kFocal * baseline / kDisparities,
          .max_depth = 10,
          .baseline = baseline,
          .focal = kFocal,
          .disparity_step = 1.0 / 32,
          .lateral_sigma = 0.5,
          .grazing = 80,
          .edge_loss = 0.4};
}

/// Microsoft, "Azure Kinect DK hardware specifications", narrow field of view, unbinned: 0.5 m to
/// 3.86 m, random error at most 17 mm. The phase noise of a time of flight camera is inversely
/// proportional to the amplitude of the light that returns, which
/// falls with z^2 (Lange and Seitz, "Solid-State Time-of-Flight Range Camera", IEEE JQE 2001):
/// sigma(z) = 17 mm (z / 3.86 m)^2.
DepthSensor azure_kinect() {
  constexpr double kWorst = 0.017, kFarthest = 3.86;
  return {.name = "azure_kinect",
          .principle = DepthPrinciple::kTimeOfFlight,
          .noise = {.quadratic = kWorst / (kFarthest * kFarthest)},
          .min_depth = 0.5,
          .max_depth = kFarthest,
          .depth_step = 0.001,
          .lateral_sigma = 0.5,
          .grazing = 80,
          .edge_loss = 0.4};
}

constexpr const char* kStereoName = "stereo";

const std::vector<DepthSensor>& sensors() {
  // The pair named stereo is that of a ZED camera at 640 x 360 pixels, as the simulator uses it.
  static const std::vector<DepthSensor> all{kinect_v1(),
                                            realsense("realsense_d435i", 0.050),
                                            realsense("realsense_d455", 0.095),
                                            realsense("realsense_d405", 0.018),
                                            azure_kinect(),
                                            stereo_sensor(350, 0.12),
                                            DepthSensor{}};
  return all;
}

}  // namespace

float DepthSensor::depth_at_sigma(double sigma) const {
  const auto& [a, b, c] = noise;
  sigma *= scene_scale;
  double z = sigma >= a ? max_depth : 0;
  if (c > 0) {  // the larger root of sigma(z) = sigma; none where sigma(z) is larger everywhere
    const double discriminant = b * b + 4 * c * (sigma - a);
    z = discriminant < 0 ? 0 : (-b + std::sqrt(discriminant)) / (2 * c);
  } else if (b > 0) {
    z = (sigma - a) / b;
  }
  return static_cast<float>(std::clamp(z, 0.0, max_depth));
}

std::string realsense_sensor_named(std::string_view text) {
  for (const auto& [model, name] :
       {std::pair("405", "realsense_d405"), {"455", "realsense_d455"}, {"457", "realsense_d455"}}) {
    if (text.find(std::string("D") + model) != std::string_view::npos ||
        text.find(std::string("d") + model) != std::string_view::npos)
      return name;
  }
  return "realsense_d435i";
}

/// Standard deviation of the disparity: measured on rendered pairs (simulate/stereo_test.cpp). The
/// matcher searches disparities up to a fifth of the focal length, which are a depth of five
/// baselines, and trusts those from two pixels on. Depth up to 40 baselines makes landmarks (Paz et
/// al., "Large-scale 6-DOF SLAM with stereo-in-hand", IEEE Transactions on Robotics 2008;
/// ORB-SLAM2, ibid. 2017, section III-A); in rooms landmarks are made up to sigma = 0.061 m
/// (refine/landmark_creation.cpp), and the other bounds grow alike.
DepthSensor stereo_sensor(double focal, double baseline) {
  constexpr double kDisparitySigma = 0.3, kNearestBaselines = 5, kShortestDisparity = 2;
  constexpr double kLandmarkBaselines = 40, kLandmarkSigma = 0.060784;
  DepthSensor sensor{.name = kStereoName,
                     .principle = DepthPrinciple::kStereo,
                     .noise = {.quadratic = kDisparitySigma / (focal * baseline)},
                     .min_depth = kNearestBaselines * baseline,
                     .max_depth = focal * baseline / kShortestDisparity,
                     .baseline = baseline,
                     .focal = focal,
                     .disparity_step = 1.0 / 16,
                     .lateral_sigma = 0.5,
                     .grazing = 80,
                     .edge_loss = 0.4};
  sensor.scene_scale = sensor.sigma(kLandmarkBaselines * baseline) / kLandmarkSigma;
  return sensor;
}

DepthSensor depth_sensor_of(const std::string& name, double focal, double baseline) {
  return name == kStereoName ? stereo_sensor(focal, baseline) : find_depth_sensor(name);
}

const std::vector<std::string>& depth_sensor_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const DepthSensor& sensor : sensors()) all.push_back(sensor.name);
    return all;
  }();
  return names;
}

const DepthSensor& find_depth_sensor(const std::string& name) {
  for (const DepthSensor& sensor : sensors()) {
    if (sensor.name == name) return sensor;
  }
  throw Error("is no known depth sensor", "sensor '" + name + "'",
              suggestion(name, depth_sensor_names()));
}

}  // namespace stillmap
