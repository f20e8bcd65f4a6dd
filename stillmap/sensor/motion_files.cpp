// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/motion_files.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/base/stamp_unit.hpp"
#include "stillmap/base/unicode.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/sensor/fields.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <sstream>
#include <string>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kFormat =
    "write lines of 7 numbers: timestamp,wx,wy,wz,ax,ay,az in rad/s and m/s^2";
constexpr std::size_t kNumbers = 7;

constexpr const char* kOdometryFile = "odometry.txt";

/// Returns the file with the samples of an IMU, if there is one.
std::optional<fs::path> imu_file(const fs::path& folder) {
  for (const char* name : {"imu0/data.csv", "imu.csv"})
    if (is_file(folder / name)) return folder / name;
  return std::nullopt;
}

/// Returns the numbers of a line.
std::array<double, kNumbers> numbers_of(const std::string& line, const std::string& where) {
  const std::vector<std::string> fields = fields_of(line);
  if (fields.size() != kNumbers)
    throw Error(fmt::format("expected 7 numbers, found {}", counted(fields.size(), "field")), where,
                kFormat);
  std::array<double, kNumbers> numbers{};
  for (std::size_t i = 0; i < kNumbers; ++i) {
    const auto number = number_of(fields[i]);
    if (!number)
      throw Error(fmt::format("'{}' is not a number", printable(fields[i])), where, kFormat);
    numbers[i] = *number;
  }
  return numbers;
}

/// Throws Error for a file of positions alone, whose rotations read_trajectory() takes for none.
void require_rotations(const fs::path& file) {
  constexpr std::size_t kPosition = 4;
  std::istringstream in(as_utf8(read_file(file)));
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto fields = fields_of(line);
    if (fields.empty() || fields.front().starts_with('#')) continue;
    if (fields.size() != kPosition) return;
    throw Error("4 numbers are no pose of the robot's base",
                fmt::format("{}:{}", file.string(), number),
                "write lines of 8 numbers: timestamp tx ty tz qx qy qz qw");
  }
}

/// Leaves out samples that cannot be used.
void keep_usable(std::vector<ImuSample>& samples, const fs::path& file) {
  const std::size_t all = samples.size();
  std::vector<ImuSample> usable;
  for (const ImuSample& sample : samples) {
    const bool later = usable.empty() || sample.timestamp > usable.back().timestamp;
    const bool finite = std::isfinite(sample.timestamp) && sample.angular_velocity.allFinite() &&
                        sample.acceleration.allFinite();
    if (later && finite) usable.push_back(sample);
  }
  samples = std::move(usable);
  if (samples.empty()) throw Error("contains no sample", file.string(), kFormat);
  if (samples.size() < all)
    warn(fmt::format("{}: left out: {} of {}, whose times do not increase or whose numbers are not "
                     "finite",
                     file.string(), all - samples.size(), counted(all, "sample")),
         "");
}

}  // namespace

MotionSamples motion_samples_in(const fs::path& folder, const Camera& camera) {
  MotionSamples samples;
  const auto imu = imu_file(folder);
  if (camera.imu && imu) samples.imu = read_imu(*imu);
  if (camera.wheels && is_file(folder / kOdometryFile))
    samples.odometry = read_odometry(folder / kOdometryFile);
  return samples;
}

std::optional<Finding> unused_motion_files(const fs::path& folder, const Camera& camera) {
  const auto unused = [&](const fs::path& file, const char* what, const char* fix) {
    return with_severity(
        Severity::kNote,
        make_finding(
            "motion-samples",
            fmt::format("{} is not used: the camera file does not name {}", file.string(), what),
            fix));
  };
  const auto imu = imu_file(folder);
  if (imu && !camera.imu)
    return unused(*imu, "the IMU", "add to the camera file: imu: NAME, and T_camera_imu");
  if (!camera.wheels && is_file(folder / kOdometryFile))
    return unused(folder / kOdometryFile, "the robot's base",
                  "add to the camera file: T_camera_base");
  return std::nullopt;
}

std::vector<ImuSample> read_imu(const fs::path& file) {
  std::istringstream in(as_utf8(read_file(file)));
  std::vector<ImuSample> samples;
  std::vector<double> stamps;
  std::string line;
  for (int number = 1; std::getline(in, line); ++number) {
    const auto fields = fields_of(line);
    if (fields.empty() || fields.front().starts_with('#')) continue;
    const auto v = numbers_of(line, fmt::format("{}:{}", file.string(), number));
    samples.push_back({v[0], {v[1], v[2], v[3]}, {v[4], v[5], v[6]}});
    stamps.push_back(v[0]);
  }
  // Timestamps that do not count from 1970 are in nanoseconds if they are far apart.
  constexpr double kLongestInterval = 1000;  // s
  double unit = unit_of_stamps(stamps);
  const auto later = std::ranges::find_if(stamps, [&](double t) { return t > stamps.front(); });
  const bool far_apart = later != stamps.end() && *later - stamps.front() > kLongestInterval;
  if (unit == 1 && far_apart) unit = 1e-9;
  for (ImuSample& sample : samples) sample.timestamp *= unit;
  keep_usable(samples, file);
  return samples;
}

void write_imu(const fs::path& file, const std::vector<ImuSample>& samples) {
  std::string text =
      "#timestamp [ns],w_x [rad s^-1],w_y [rad s^-1],w_z [rad s^-1],a_x [m s^-2],"
      "a_y [m s^-2],a_z [m s^-2]\n";
  for (const ImuSample& sample : samples) {
    const auto &w = sample.angular_velocity, &a = sample.acceleration;
    text += fmt::format("{:.0f},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g},{:.9g}\n",
                        1e9 * sample.timestamp, w.x(), w.y(), w.z(), a.x(), a.y(), a.z());
  }
  write_file(file, text);
}

std::vector<OdometrySample> read_odometry(const fs::path& file) {
  require_rotations(file);
  std::vector<OdometrySample> samples;
  for (const StampedPose& pose : read_trajectory(file)) {
    if (samples.empty() || pose.timestamp > samples.back().timestamp)
      samples.push_back({pose.timestamp, pose.T_world_camera});
  }
  return samples;
}

void write_odometry(const fs::path& file, const std::vector<OdometrySample>& samples) {
  Trajectory poses;
  for (const OdometrySample& sample : samples)
    poses.push_back({sample.timestamp, sample.T_odom_base});
  write_trajectory(file, poses);
}

}  // namespace stillmap
