// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/reading_doubts.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/evaluate/trajectory_error.hpp"
#include "stillmap/evaluate/truth_frame.hpp"

#include <algorithm>
#include <optional>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Rotation errors over one second below this are those of tracking [degrees].
constexpr double kAgreement = 0.5;
/// Ratio of the errors as read and as meant from which the reading is doubted. A wrong order or
/// frame gives errors of the size of the rotations themselves.
constexpr double kRatio = 5;

/// Another way to read the files.
struct Reading {
  Trajectory truth, estimate;
  std::string condition;  // "and by 0.1 degrees CONDITION"
  std::string fix;
};

/// Returns the poses with quaternions whose numbers were qw qx qy qz in the file.
Trajectory with_qw_first(const Trajectory& trajectory) {
  Trajectory result = trajectory;
  for (StampedPose& pose : result) {
    const Eigen::Quaterniond& q = pose.T_world_camera.quaternion();
    pose.T_world_camera =
        Pose(Eigen::Quaterniond(q.x(), q.y(), q.z(), q.w()), pose.T_world_camera.translation());
  }
  return result;
}

/// Returns the poses in the file of the truth.
Trajectory without_frame(const Trajectory& camera, const TruthFrame& frame) {
  return in_camera_frame(camera,
                         {frame.T_world_reference.inverse(), frame.T_body_camera.inverse()});
}

/// Returns the median rotation error over one second [degrees]; none without poses that far apart.
std::optional<double> rotation_error(const Trajectory& truth, const Trajectory& estimate) {
  try {
    return relative_pose_error(truth, estimate, RpeDelta::kSecond).rotation.median;
  } catch (const Error&) {
    return std::nullopt;
  }
}

std::vector<Reading> other_readings(const Trajectory& truth, const Trajectory& estimate,
                                    const TrajectoryNames& names) {
  const auto fix = [](const std::string& file) {
    return "write the order of TUM, qx qy qz qw: awk '!/^#/ {print $1,$2,$3,$4,$6,$7,$8,$5}' " +
           file;
  };
  const auto condition = [](const std::string& file) {
    return "if the quaternions of " + file + " are read as qw qx qy qz";
  };
  const TruthFrame frame =
      names.truth_frame.empty() ? TruthFrame() : read_truth_frame(names.truth_frame);
  const Trajectory in_file = without_frame(truth, frame);
  const Trajectory other_truth = in_camera_frame(with_qw_first(in_file), frame);
  const Trajectory other_estimate = with_qw_first(estimate);
  std::vector<Reading> readings{
      {truth, other_estimate, condition(names.estimate), fix(names.estimate)},
      {other_truth, estimate, condition(names.truth), fix(names.truth)},
      {other_truth, other_estimate, condition("both files"), fix("FILE")}};
  if (!names.truth_frame.empty())
    readings.push_back({in_file, estimate, "without --truth-frame " + names.truth_frame,
                        "leave it out: the truth is already the pose of the camera"});
  return readings;
}

}  // namespace

std::vector<std::string> reading_doubts(const Trajectory& truth, const Trajectory& estimate,
                                        const TrajectoryNames& names) {
  const auto as_read = rotation_error(truth, estimate);
  if (!as_read || *as_read < kAgreement) return {};
  std::optional<double> least;
  std::string doubt;
  for (const Reading& reading : other_readings(truth, estimate, names)) {
    const auto error = rotation_error(reading.truth, reading.estimate);
    if (!error || *error > std::min(*as_read / kRatio, least.value_or(*as_read))) continue;
    least = error;
    doubt = fmt::format(
        "the rotations of {} and {} differ by {:.3g} degrees over 1 s (median), and by {:.2g} {}; "
        "{}",
        names.estimate, names.truth, *as_read, *error, reading.condition, reading.fix);
  }
  return doubt.empty() ? std::vector<std::string>() : std::vector<std::string>{doubt};
}

}  // namespace stillmap
