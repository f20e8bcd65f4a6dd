// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Where two trajectories come from, for texts.
struct TrajectoryNames {
  std::string truth, estimate;  ///< Names of the files.
  std::string truth_frame;      ///< Name for read_truth_frame(); empty: the truth is the camera's.
};

/// Returns why the trajectories were probably not read as they are meant; mostly nothing. The
/// rotations over one second are compared: if they disagree as read and agree with the quaternions
/// of a file read as qw qx qy qz, or without the frame of the truth, the text tells it with the
/// fix. Nothing is told of a truth without rotations, a camera that hardly turns, or less than a
/// second.
/// @param truth  poses of the camera, with the frame of the truth applied
std::vector<std::string> reading_doubts(const Trajectory& truth, const Trajectory& estimate,
                                        const TrajectoryNames& names);

}  // namespace stillmap
