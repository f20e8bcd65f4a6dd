// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Adds --truth-frame to a command.
void add_truth_frame_option(CLI::App& command, std::string& truth_frame);

/// Returns the body whose pose a ground truth file contains, as for read_truth_frame(); empty: the
/// camera. The default is "bonn" in folders named like sequences of the Bonn RGB-D Dynamic Dataset.
/// @param truth  empty: there is none
/// @param given  value of --truth-frame
std::string truth_frame_of(const std::filesystem::path& truth, const std::string& given);

/// Returns the true poses of the camera, T_world_camera.
/// @param truth_frame  "bonn" or a file, as for read_truth_frame(); empty: the truth is the
/// camera's
Trajectory true_camera_trajectory(const std::filesystem::path& truth,
                                  const std::string& truth_frame);

}  // namespace stillmap
