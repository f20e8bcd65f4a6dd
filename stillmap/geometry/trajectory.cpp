// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/trajectory.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/stamp_unit.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/geometry/rigid_motion.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <Eigen/SVD>
#include <fmt/format.h>

namespace stillmap {
namespace {

/// Largest number in a trajectory: more than any time since 1970 [s], with which sums of squares
/// stay exact.
constexpr double kLargestNumber = 1e12;

constexpr double kNanosecond = 1e-9;         // s
constexpr double kSamePlace = 0.05;          // [m]; poses of one time that are nearer are one
constexpr double kNormError = 0.1;           // of quaternions, as numbers of one digit have at most
constexpr std::size_t kPositionNumbers = 4;  // of a line without a rotation
constexpr std::size_t kTumNumbers = 8, kKittiNumbers = 12, kEurocNumbers = 17;
constexpr std::size_t kVinsNumbers = 11;    // of VINS-Fusion: qw first, then velocities
constexpr std::size_t kMatrixNumbers = 16;  // of a pose of Replica in the version of NICE-SLAM
constexpr double kMatrixRate = 30;          // rate of these poses [Hz]
constexpr std::size_t kArkitNumbers = 7;    // of a pose of ARKitScenes
constexpr const char* kArkitExtension = ".traj";

/// Returns the numbers of a line; some may be NaN or infinite.
std::vector<double> numbers_of(std::string line, const std::string& where) {
  std::replace(line.begin(), line.end(), ',', ' ');
  std::istringstream fields(line);
  std::vector<double> numbers;
  for (std::string token; fields >> token;) {
    const auto read = number_of(token);
    if (!read)
      throw Error("'" + token + "' is not a number", where,
                  "write lines of 8 numbers: timestamp tx ty tz qx qy qz qw");
    const double number = *read;
    if (std::isfinite(number) &&
        std::abs(number) > (numbers.empty() ? kLargestNumber / kNanosecond : kLargestNumber)) {
      throw Error("'" + token + "' is too large", where,
                  "write positions in meters and timestamps in seconds");
    }
    numbers.push_back(number);
  }
  return numbers;
}

/// Format of the poses of a file: that of the TUM benchmark; or, with timestamps in nanoseconds, of
/// EuRoC: separated by commas with qw first (its ground truth), or by blanks with qw last (as
/// ORB-SLAM3 writes it). A heading that names the columns counts more.
struct PoseFormat {
  double stamp_unit = 1;  // [s]
  bool scalar_first = false;
  bool only_positions = false;  // all lines are timestamp tx ty tz
  bool last_is_id = false;      // the heading ends with id, as that of RTAB-Map
};

/// A line with a pose.
struct PoseLine {
  std::string where;
  std::vector<double> numbers;
  std::size_t index = 0;  // among the lines with numbers
};

/// Whether a line marks its pose as unknown: numbers that are not finite, or a zero quaternion.
bool has_no_pose(const PoseLine& line) {
  const auto& v = line.numbers;
  const bool known = std::all_of(v.begin(), v.end(), [](double x) { return std::isfinite(x); });
  const bool turned = v.size() != kTumNumbers ||
                      std::any_of(v.begin() + 4, v.end(), [](double x) { return x != 0; });
  return !known || !turned;
}

/// Removes the lines without a pose and warns with their number.
void skip_unknown(std::vector<PoseLine>& lines, const std::filesystem::path& file) {
  const auto first = std::find_if(lines.begin(), lines.end(), has_no_pose);
  if (first == lines.end()) return;
  const std::string where = first->where;
  const std::size_t all = lines.size(), skipped = std::erase_if(lines, has_no_pose);
  const char* reason = "numbers that are not finite, or a quaternion of 0";
  if (lines.empty()) {
    throw Error(fmt::format("contains no pose: {} with {}", counted(all, "line"), reason),
                file.string(), "write lines of 8 numbers: timestamp tx ty tz qx qy qz qw");
  }
  warn(fmt::format("left out: {} of {}, the first: {} has {}", skipped, counted(all, "pose"), where,
                   reason),
       "");
}

/// Returns whether the heading names the column of qw before that of qx; none if it does not name
/// them. EuRoC writes q_RS_w.
std::optional<bool> scalar_first_in(std::string heading) {
  std::replace(heading.begin(), heading.end(), ',', ' ');
  std::istringstream words(heading);
  std::optional<int> w, x;
  int column = 0;
  for (std::string word; words >> word; ++column) {
    if (word.front() != 'q' || word.size() < 2) continue;
    if (word.back() == 'w') w = column;
    if (word.back() == 'x') x = column;
  }
  return w && x ? std::optional(*w < *x) : std::nullopt;
}

std::string last_word(const std::string& text) {
  std::istringstream words(text);
  std::string last;
  for (std::string word; words >> word;) last = word;
  return last;
}

/// Returns the unit of the timestamps [s]. Timestamps that do not count from 1970 are in
/// nanoseconds if they are too large for seconds.
double stamp_unit(const std::string& heading, const std::vector<PoseLine>& lines) {
  if (heading.find("[ns]") != std::string::npos) return kNanosecond;
  std::vector<double> stamps;
  for (const PoseLine& line : lines) {
    if (!line.numbers.empty()) stamps.push_back(line.numbers.front());
  }
  const double unit = unit_of_stamps(stamps);
  const bool too_large = std::any_of(stamps.begin(), stamps.end(),
                                     [](double stamp) { return std::abs(stamp) > kLargestNumber; });
  return unit == 1 && too_large ? kNanosecond : unit;
}

PoseFormat format_of(const std::string& heading, const std::vector<PoseLine>& lines, bool commas) {
  PoseFormat format;
  format.stamp_unit = stamp_unit(heading, lines);
  format.scalar_first =
      scalar_first_in(heading).value_or(format.stamp_unit == kNanosecond && commas);
  format.last_is_id = last_word(heading) == "id";
  format.only_positions = std::all_of(lines.begin(), lines.end(), [](const PoseLine& line) {
    return line.numbers.size() == kPositionNumbers;
  });
  return format;
}

/// Returns the pose of a row-major 4 x 4 matrix.
StampedPose pose_of_matrix(const PoseLine& line) {
  const auto T = rigid_motion(std::span(line.numbers).first<kMatrixNumbers>(), kNormError);
  if (!T) {
    throw Error("has 16 numbers that are not the matrix of a pose", line.where,
                "write the rotation in the first three columns and rows, or lines of 8 numbers: "
                "timestamp tx ty tz qx qy qz qw");
  }
  return {static_cast<double>(line.index) / kMatrixRate, *T};
}

/// Returns the pose of a line of ARKitScenes: time [s], then rotation vector [rad] and translation
/// [m] of T_camera_world.
StampedPose pose_of_arkit(const PoseLine& line) {
  const std::vector<double>& v = line.numbers;
  if (v.size() != kArkitNumbers) {
    throw Error(
        fmt::format("expected 7 numbers (time, axis-angle, translation), found {}", v.size()),
        line.where, "write the format of ARKitScenes, or use another extension than .traj");
  }
  return {v[0], Pose(so3_exp({v[1], v[2], v[3]}), {v[4], v[5], v[6]}).inverse()};
}

StampedPose pose_of(const PoseLine& line, const PoseFormat& format) {
  const std::vector<double>& v = line.numbers;
  if (v.size() == kMatrixNumbers) return pose_of_matrix(line);
  const double unit = format.stamp_unit;
  if (format.only_positions)
    return {v[0] * unit, Pose(Eigen::Quaterniond::Identity(), {v[1], v[2], v[3]})};
  if (v.size() == kKittiNumbers) {
    throw Error("has 12 numbers, a pose in KITTI's format, which has no timestamp", line.where,
                "write lines of 8 numbers: timestamp tx ty tz qx qy qz qw");
  }
  if (v.size() == kEurocNumbers && format.stamp_unit != kNanosecond) {
    throw Error("has 17 numbers, as EuRoC's ground truth, but a timestamp in seconds", line.where,
                "begin the file with the heading of EuRoC, #timestamp [ns],...");
  }
  const bool is_vins = v.size() == kVinsNumbers && format.stamp_unit == kNanosecond;
  const bool has_id = v.size() == kTumNumbers + 1 && format.last_is_id;
  if (v.size() != kTumNumbers && v.size() != kEurocNumbers && !is_vins && !has_id) {
    throw Error(
        fmt::format("expected 8 numbers (timestamp tx ty tz qx qy qz qw), found {}", v.size()),
        line.where, "write the trajectory in TUM format, one pose per line");
  }
  const Eigen::Quaterniond q = format.scalar_first ? Eigen::Quaterniond(v[4], v[5], v[6], v[7])
                                                   : Eigen::Quaterniond(v[7], v[4], v[5], v[6]);
  if (std::abs(q.norm() - 1) > kNormError) {
    throw Error(fmt::format("the quaternion has the norm {:.3g} instead of 1", q.norm()),
                line.where, "write poses as timestamp tx ty tz qx qy qz qw");
  }
  return {v[0] * unit, Pose(q, Eigen::Vector3d(v[1], v[2], v[3]))};
}

/// Throws Error if a time has two poses that are far apart.
void require_one_place_at_a_time(const Trajectory& sorted, const std::filesystem::path& file) {
  for (std::size_t i = 1; i < sorted.size(); ++i) {
    const auto& [before, T] = sorted[i - 1];
    const auto& [timestamp, T_other] = sorted[i];
    const double apart = (T.translation() - T_other.translation()).norm();
    if (timestamp == before && apart > kSamePlace) {
      throw Error(fmt::format("has two poses at {:.6f} s, {:.2f} m apart", timestamp, apart),
                  file.string(), "keep one pose per timestamp");
    }
  }
}

}  // namespace

Trajectory read_trajectory(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file))
    throw Error(
        "is a folder", file.string(),
        "name the trajectory in it: groundtruth.txt of a recording, trajectory.txt of a run");
  std::istringstream in(as_utf8(read_file(file)));
  std::vector<PoseLine> lines;
  std::string line, heading;
  bool commas = false;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto first = line.find_first_not_of(" \t\r");
    if (first == std::string::npos) continue;
    const bool names_columns =
        number == 1 && !leading_number(line) && line.find("time") != std::string::npos;
    if (line[first] == '#' || names_columns) {
      heading += line + ' ';
      continue;
    }
    commas = commas || line.find(',') != std::string::npos;
    const std::string where = fmt::format("{}:{}", file.string(), number);
    lines.push_back({where, numbers_of(line, where), lines.size()});
  }
  if (lines.empty()) {
    throw Error("contains no pose", file.string(),
                "expected lines of 8 numbers: timestamp tx ty tz qx qy qz qw");
  }
  skip_unknown(lines, file);
  const PoseFormat format = format_of(heading, lines, commas);
  const bool of_arkit = file.extension() == kArkitExtension;
  Trajectory trajectory;
  for (const PoseLine& each : lines)
    trajectory.push_back(of_arkit ? pose_of_arkit(each) : pose_of(each, format));
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  require_one_place_at_a_time(trajectory, file);
  return trajectory;
}

std::string pose_line(double timestamp, const Pose& T) {
  const auto& t = T.translation();
  const auto& q = T.quaternion();
  return fmt::format("{:.6f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n", timestamp, t.x(),
                     t.y(), t.z(), q.x(), q.y(), q.z(), q.w());
}

void write_trajectory(const std::filesystem::path& file, const Trajectory& trajectory) {
  std::string text = "# timestamp tx ty tz qx qy qz qw\n";
  for (const auto& [timestamp, T] : trajectory) text += pose_line(timestamp, T);
  write_file(file, text);
}

void write_covariances(const std::filesystem::path& file, const std::vector<UncertainPose>& poses) {
  std::string text =
      "# Covariance of the pose of each frame of trajectory.txt. True pose = T_world_camera "
      "exp(v, w), in the camera frame; upper triangle, rows vx vy vz wx wy wz [m^2, m rad, "
      "rad^2]\n";
  for (const UncertainPose& pose : poses) {
    text += fmt::format("{:.6f}", pose.timestamp);
    for (Eigen::Index row = 0; row < 6; ++row)
      for (Eigen::Index column = row; column < 6; ++column)
        text += fmt::format(" {:.6e}", pose.covariance(row, column));
    text += '\n';
  }
  write_file(file, text);
}

Eigen::Matrix3d nearest_rotation(const Eigen::Matrix3d& W) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(W, Eigen::ComputeFullU | Eigen::ComputeFullV);
  Eigen::Vector3d signs(1, 1, 1);
  if ((svd.matrixU() * svd.matrixV().transpose()).determinant() < 0) signs.z() = -1;
  return svd.matrixU() * signs.asDiagonal() * svd.matrixV().transpose();
}

Pose align_points(const Eigen::Matrix3Xd& a, const Eigen::Matrix3Xd& b) {
  const Eigen::Vector3d mean_a = a.rowwise().mean();
  const Eigen::Vector3d mean_b = b.rowwise().mean();
  const Eigen::Matrix3d R =
      nearest_rotation((a.colwise() - mean_a) * (b.colwise() - mean_b).transpose());
  return Pose(R, mean_a - R * mean_b);
}

}  // namespace stillmap
