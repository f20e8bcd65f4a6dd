// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

struct StampedPose {
  double timestamp = 0;  ///< Time [s].
  Pose T_world_camera;
};

/// Camera poses in the order of their timestamps.
using Trajectory = std::vector<StampedPose>;

/// A camera pose with the covariance of its error.
struct UncertainPose {
  double timestamp = 0;  ///< Time [s].
  Pose T_world_camera;
  /// Covariance of the perturbation (v, w) in the camera frame: the true pose is T_world_camera
  /// exp(v, w), translation first [m^2, m rad, rad^2].
  Eigen::Matrix<double, 6, 6> covariance = Eigen::Matrix<double, 6, 6>::Zero();
};

/// Reads TUM format: lines `timestamp tx ty tz qx qy qz qw` separated by blanks or commas; # starts
/// a comment. With timestamps in nanoseconds (above 1e12) it reads the formats of EuRoC: separated
/// by commas with qw first and more columns behind (its ground truth, VINS-Fusion), or by blanks
/// (ORB-SLAM3). A last column that the heading calls id (RTAB-Map) is ignored.
/// Files *.traj have the format of ARKitScenes (time, then rotation vector and translation of
/// T_camera_world); lines of 16 numbers are the matrices T_world_camera of Replica, at 30 Hz. In a
/// file of lines `timestamp tx ty tz` only, all rotations are the identity. The text is UTF-8 or
/// UTF-16. The poses are sorted by timestamp. Lines with numbers that are not
/// finite or with a zero quaternion are skipped, with a warning that counts them. Throws Error with
/// file and line for an invalid line, such as one of KITTI's 12 numbers or a quaternion whose norm
/// is off 1 by more than 0.1, and for a file that cannot be opened or contains no pose.
Trajectory read_trajectory(const std::filesystem::path& file);

/// Returns a line in TUM format with 9 decimals.
std::string pose_line(double timestamp, const Pose& T);

/// Writes TUM format with 9 decimals, atomically (temporary name, then renamed). Throws Error.
void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory);

/// Writes lines `timestamp` and the 21 entries of the upper triangle of the covariance, row by row,
/// atomically. Throws Error.
void write_covariances(const std::filesystem::path& file, const std::vector<UncertainPose>& poses);

/// Returns the rotation R that maximizes trace(R^T W): for W = sum a_i b_i^T the rotation that best
/// aligns b_i to a_i, for a sum of rotations their chordal mean. Uses the singular value
/// decomposition and never returns a reflection.
Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& W);

/// Least-squares rigid alignment (Umeyama 1991 without scale; Horn 1987): returns the T_a_b that
/// minimizes sum |a_i - T_a_b b_i|^2. Columns are points [m]. Unique for at least 3 points that are
/// not collinear; otherwise one of the minimizers is returned.
Pose align_points(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b);

}  // namespace stillmap
