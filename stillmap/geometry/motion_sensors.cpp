// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/motion_sensors.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>
#include <numbers>

namespace stillmap {
namespace {

constexpr double kDegree = std::numbers::pi / 180, kMicroG = 9.80665e-6;

/// Noise densities as the data sheets give them [degrees/s/sqrt(Hz)] and [micro-g/sqrt(Hz)].
Imu of_data_sheet(const char* name, double gyro_noise, double accel_noise) {
  Imu imu;
  imu.name = name;
  imu.gyro_noise = gyro_noise * kDegree;
  imu.accel_noise = accel_noise * kMicroG;
  return imu;
}

/// A unit whose data sheet is not known, and those of cameras, which are aligned with the optical
/// axes by their drivers.
const std::vector<Imu>& units() {
  static const std::vector<Imu> all{
      Imu(), of_data_sheet("d435i", 0.014, 150),  // Bosch BMI055
      of_data_sheet("d455", 0.014, 150),          // Bosch BMI055
      of_data_sheet("oak_d", 0.007, 160),         // Bosch BMI270
      of_data_sheet("azure_kinect", 0.0038, 75)   // ST LSM6DSM
  };
  return all;
}

}  // namespace

Imu find_imu(std::string_view name) {
  const auto found = std::find_if(units().begin(), units().end(),
                                  [&](const Imu& imu) { return imu.name == name; });
  if (found != units().end()) return *found;
  throw Error("is no known inertial measurement unit", "imu '" + std::string(name) + "'",
              suggestion(std::string(name), imu_names()));
}

const std::vector<std::string>& imu_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const Imu& imu : units()) all.push_back(imu.name);
    return all;
  }();
  return names;
}

}  // namespace stillmap
