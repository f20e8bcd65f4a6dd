// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <filesystem>
#include <string>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Adds --truth-frame to a command.
void add_truth_frame_option(CLI::App& command, std::string& truth_frame);

/// Prints a note if the truth is that of the Bonn RGB-D Dynamic Dataset by the name of its folder,
/// hence the pose of a marker, and no frame was named.
void note_marker_truth(const std::filesystem::path& truth, const std::string& truth_frame);

/// Returns the true poses of the camera, T_world_camera.
/// @param truth_frame  "bonn" or a file, as for read_truth_frame(); empty: the truth is the
/// camera's
Trajectory true_camera_trajectory(const std::filesystem::path& truth,
                                  const std::string& truth_frame);

}  // namespace stillmap
