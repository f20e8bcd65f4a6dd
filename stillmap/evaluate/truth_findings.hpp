// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/finding.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Where two trajectories come from, for texts.
struct TrajectoryNames {
  std::string truth, estimate;  ///< Names of the files.
  std::string truth_frame;      ///< Name for read_truth_frame(); empty: the truth is the camera's.
  /// Whether the order and direction of the estimated poses are known, as in a run's own result.
  bool estimate_is_own = false;
};

/// Returns why the errors of the estimate probably mean nothing; mostly nothing. The motions over
/// one second are compared. Where they disagree, the files are read in other ways: quaternions as
/// qw qx qy qz, poses inverted, the truth up to 3 s earlier or later or without its frame. A
/// reading that agrees is reported; else motions about other axes, of another point of the camera's
/// body, of another unit of length, or with hardly anything in common; and times that were rounded.
/// Nothing is reported of a camera that hardly moves (2 degrees, 5 cm over one second), of poses
/// less than a second long, or of rotations if a file has_only_positions(). All are of the severity
/// kNote, since the estimate may be right.
/// @param truth           poses of the camera, with the frame of the truth applied
/// @param scale_is_known  false: the estimate may have another unit of length
std::vector<Finding> truth_findings(const Trajectory& truth, const Trajectory& estimate,
                                    const TrajectoryNames& names, bool scale_is_known = true);

}  // namespace stillmap
