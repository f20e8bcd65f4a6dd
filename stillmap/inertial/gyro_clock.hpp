// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/inertial/preintegration.hpp"

#include <array>
#include <deque>
#include <optional>
#include <span>

#include <Eigen/Geometry>

namespace stillmap {

/// Compares the clock of a gyroscope with that of the images: of several offsets, the right one is
/// that at which the gyroscope's rotations are nearest to the images'. A constant rotation tells
/// nothing; one that changes tells offsets of a few hundredths of a second.
class GyroClock {
 public:
  /// Adds the rotation between two frames by their images.
  /// @param samples  of the last second, up to the newer frame
  /// @param seen     rotation from the IMU at the earlier frame to that at the newer one
  void add(std::span<const ImuSample> samples, double before, double now,
           const Eigen::Quaterniond& seen, const Imu& imu, const ImuBias& bias);

  /// Returns the time of a sample's stamp minus that of an image of the same moment, beyond what
  /// is known of it [s]; none unless it is certain.
  std::optional<double> offset() const;

 private:
  static constexpr int kSteps = 6;       // to each side
  static constexpr double kStep = 0.02;  // [s]
  struct Turn {
    double before, now;
    Eigen::Quaterniond seen;
  };
  void compare(const Turn& turn, std::span<const ImuSample> samples, const Imu& imu,
               const ImuBias& bias);

  std::deque<Turn> turns_;  // before their last samples
  // Sums of the squared differences of the rotations at the offsets [rad^2]; their weights.
  std::array<double, 2 * kSteps + 1> squares_{};
  double weight_ = 0;
};

}  // namespace stillmap
