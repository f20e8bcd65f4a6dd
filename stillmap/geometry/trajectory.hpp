// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <filesystem>
#include <vector>

namespace stillmap {

struct StampedPose {
  double timestamp = 0;  ///< seconds
  Pose T_world_camera;
};

/// Camera poses in the order of their stamps.
using Trajectory = std::vector<StampedPose>;

/// Reads TUM format: lines `timestamp tx ty tz qx qy qz qw`, # starts a comment, blanks or commas
/// between. Sorted by stamp. Throws Error with file and line on a line that is none, non-finite
/// values or a zero quaternion; on a file that cannot be opened or holds no pose.
Trajectory read_trajectory(const std::filesystem::path& file);

/// Writes TUM format, 9 decimals; complete or not at all (temporary name, then renamed). Throws
/// Error.
void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

/// The rotation R that makes trace(R^T W) largest: of W = sum a_i b_i^T the one that turns the b_i
/// nearest to the a_i, of a sum of rotations their chordal mean. By the singular value
/// decomposition, guarded against a reflection.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& W);

/// Least-squares rigid alignment (Umeyama 1991 without scale; Horn 1987): the T_a_b that minimizes
/// sum |a_i - T_a_b b_i|^2. Columns are points. Needs at least 3 points that are not on one line
/// for a unique answer; otherwise the rotation is one of the minimizers.
Pose align_points(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

}  // namespace stillmap
