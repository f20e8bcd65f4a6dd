// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/motion_check.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Acceleration of gravity [m/s^2], and the largest share by which the median of a carried camera
/// and the error of its accelerometer differ from it.
constexpr double kGravity = 9.80665, kGravityShare = 0.15;
/// Largest angular velocity that the sensors of cameras measure: 2000 degrees/s [rad/s].
constexpr double kFastest = 35;
/// Longest time without a sample over which a sensor is used: of the IMU as in preintegrate(), of
/// wheels as in WheelNavigation [s].
constexpr double kImuGap = 0.05, kWheelGap = 0.3;

Finding finding(std::string message, std::string fix, std::map<std::string, double> evidence) {
  return make_finding("motion-samples", std::move(message), std::move(fix), std::move(evidence));
}

/// Returns what the median of the lengths of the accelerations says about their unit.
std::optional<Finding> unit_finding(const std::vector<ImuSample>& samples) {
  std::vector<double> lengths;
  for (const ImuSample& sample : samples) lengths.push_back(sample.acceleration.norm());
  const double median = upper_median(lengths);
  if (median == 0 || std::abs(median / kGravity - 1) <= kGravityShare) return std::nullopt;
  const bool in_g = std::abs(median - 1) <= kGravityShare;
  return finding(fmt::format("the accelerations have a length of {:.2f} in the median, {}", median,
                             in_g ? "as in g" : "gravity has 9.81 m/s^2"),
                 in_g ? "multiply them by 9.80665"
                      : "write accelerations in m/s^2 as the sensor measures them, with gravity",
                 {{"median_m_s2", median}});
}

std::optional<Finding> turn_finding(const std::vector<ImuSample>& samples) {
  std::vector<double> turns;
  for (const ImuSample& sample : samples) turns.push_back(sample.angular_velocity.norm());
  const double fast = quantile(turns, 0.95);
  if (fast <= kFastest) return std::nullopt;
  return finding(
      fmt::format("a twentieth of the angular velocities is above {:.0f}, as in degrees/s", fast),
      "write them in rad/s", {{"p95_rad_s", fast}});
}

template <typename Samples>
std::optional<Finding> gap_finding(const Samples& samples, const char* whose,
                                   double longest_right) {
  std::size_t gaps = 0, longest = 0;
  const auto gap_before = [&](std::size_t i) {
    return samples[i].timestamp - samples[i - 1].timestamp;
  };
  for (std::size_t i = 1; i < samples.size(); ++i) {
    gaps += gap_before(i) > longest_right;
    if (longest == 0 || gap_before(i) > gap_before(longest)) longest = i;
  }
  if (gaps == 0) return std::nullopt;
  return finding(
      fmt::format(
          "gaps of more than {:.2f} s in the samples of {}: {}, the longest {:.2f} s after {:.6f}",
          longest_right, whose, gaps, gap_before(longest), samples[longest - 1].timestamp),
      "record again with less load; the sensor is not used there",
      {{"gaps", static_cast<double>(gaps)}, {"longest_s", gap_before(longest)}});
}

std::vector<ImuSample> without_repeated(std::vector<ImuSample> samples) {
  const auto repeats = [](const ImuSample& a, const ImuSample& b) { return b.repeats(a); };
  samples.erase(std::unique(samples.begin(), samples.end(), repeats), samples.end());
  return samples;
}

}  // namespace

std::vector<Finding> motion_findings(const MotionSamples& samples) {
  std::vector<Finding> findings;
  const auto add = [&](std::optional<Finding> found) {
    if (found) findings.push_back(*std::move(found));
  };
  if (!samples.imu.empty()) {
    add(unit_finding(samples.imu));
    add(turn_finding(samples.imu));
    add(gap_finding(without_repeated(samples.imu), "the IMU", kImuGap));
  }
  if (!samples.odometry.empty()) add(gap_finding(samples.odometry, "the wheels", kWheelGap));
  return findings;
}

}  // namespace stillmap
