// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/inertial_source.hpp"

#include <filesystem>
#include <optional>
#include <vector>

namespace stillmap {

/// Reads the samples of a folder's camera: those of its IMU from imu0/data.csv (EuRoC) or imu.csv,
/// those of its wheels from odometry.txt. Files of what the camera does not have are not read.
MotionSamples motion_samples_in(const std::filesystem::path& folder, const Camera& camera);

/// Returns a note about a file with such samples that is not read, since the camera file does not
/// name the IMU or the robot's base; none if there is no such file.
std::optional<Finding> unused_motion_files(const std::filesystem::path& folder,
                                           const Camera& camera);

/// Reads a file with lines `timestamp,wx,wy,wz,ax,ay,az` in the units of ImuSample, of EuRoC
/// (timestamps in nanoseconds) or in seconds. # starts a comment. Samples with numbers that are not
/// finite, or whose time does not increase, are left out with a warning.
/// Throws Error with file and line for other text, and for a file without a sample.
std::vector<ImuSample> read_imu(const std::filesystem::path& file);

/// Writes such a file with timestamps in nanoseconds.
void write_imu(const std::filesystem::path& file, const std::vector<ImuSample>& samples);

/// Reads poses T_odom_base as read_trajectory() does; of several of one time the first one.
std::vector<OdometrySample> read_odometry(const std::filesystem::path& file);
/// Writes such a file in TUM format.
void write_odometry(const std::filesystem::path& file, const std::vector<OdometrySample>& samples);

}  // namespace stillmap
