// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/imu.hpp"

#include <filesystem>
#include <vector>

namespace stillmap {

/// Returns the file with the samples of an IMU in a folder: imu0/data.csv (EuRoC) or imu.csv; empty
/// if there is none.
std::filesystem::path imu_file_in(const std::filesystem::path& folder);

/// Reads a file with lines `timestamp,wx,wy,wz,ax,ay,az` in the units of ImuSample, of EuRoC
/// (timestamps in nanoseconds) or in seconds. # starts a comment. Samples with numbers that are not
/// finite, or whose time does not increase, are left out with a warning.
/// Throws Error with file and line for other text, and for a file without a sample.
std::vector<ImuSample> read_imu(const std::filesystem::path& file);

/// Writes such a file with timestamps in nanoseconds.
void write_imu(const std::filesystem::path& file, const std::vector<ImuSample>& samples);

}  // namespace stillmap
