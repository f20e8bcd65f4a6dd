// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/sequence.hpp"

#include <filesystem>
#include <map>
#include <optional>

namespace stillmap {

/// File with which Record3D describes the images that it exports.
inline constexpr const char* kRecord3dFile = "metadata.json";

/// Returns whether a folder has such a file, by what it tells: the camera matrix K and the size of
/// the depth images.
bool is_of_record3d(const std::filesystem::path& folder);

/// The times of images whose names are numbers of frames.
struct FrameTimes {
  double fps = 30;               ///< Rate without a table [Hz].
  std::filesystem::path file;    ///< The file of the table; empty without one.
  std::map<long, double> table;  ///< Time of each number [s]; empty: number / fps.

  /// Returns the time of a frame [s]; none if the table does not have it.
  std::optional<double> of(double number) const;
};

/// Returns the times that a program wrote beside the images: Stray Scanner's odometry.csv (columns
/// timestamp and frame) or Record3D's frameTimestamps or fps. Without them, and where SequencePaths
/// has another rate than the usual one, the rate tells them. Throws Error for a damaged file.
FrameTimes frame_times(const SequencePaths& paths);

}  // namespace stillmap
