// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/sensor/sequence.hpp"

#include <filesystem>
#include <map>
#include <optional>

namespace stillmap {

/// File with which Record3D describes the images that it exports.
inline constexpr const char* kRecord3dFile = "metadata.json";

/// Returns whether a folder contains such a file, with the camera matrix K and the width dw of the
/// depth images.
bool is_of_record3d(const std::filesystem::path& folder);

/// The times of images whose names are frame numbers.
struct FrameTimes {
  double fps = 30;               ///< Rate without a table [Hz].
  std::filesystem::path file;    ///< The file of the table; empty without one.
  std::map<long, double> table;  ///< Time of each number [s]; empty: number / fps.

  /// Returns the time of a frame [s]; none if the table does not contain it.
  std::optional<double> of(double number) const;
};

/// Returns the times that a program wrote beside the images: Stray Scanner's odometry.csv (columns
/// timestamp and frame) or Record3D's frameTimestamps or fps. Without these, or if SequencePaths
/// has another rate than the default, the times follow from the rate. Throws Error for a damaged
/// file.
FrameTimes frame_times(const SequencePaths& paths);

}  // namespace stillmap
