// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/recording/camera_model.hpp"

#include <array>
#include <filesystem>

namespace stillmap {

/// A key of an IMU's noise in camera files, in the units of Imu.
struct ImuNoiseKey {
  const char* key;
  double Imu::*value;
};

/// The keys of Kalibr's and EuRoC's files.
inline constexpr std::array<ImuNoiseKey, 4> kImuNoiseKeys{
    {{"gyroscope_noise_density", &Imu::gyro_noise},
     {"gyroscope_random_walk", &Imu::gyro_walk},
     {"accelerometer_noise_density", &Imu::accel_noise},
     {"accelerometer_random_walk", &Imu::accel_walk}}};

/// A camera as a file describes it.
struct FileCamera : Camera {
  LensDistortion lens;  ///< Camera::distortion is not set.
};

/// Reads a camera file in one of the formats that docs/cameras.md lists, recognized by its keys.
/// Width and height are 0, and the name is that of Camera(), if the file does not contain them.
/// Throws Error with file, key and fix; YAML::Exception for some damaged
/// files.
FileCamera read_camera_format(const std::filesystem::path& file);

}  // namespace stillmap
