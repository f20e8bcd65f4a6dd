// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/gyro_clock.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Share of the sums that stays from frame to frame; their weight grows to 1 / (1 - share).
constexpr double kMemory = 0.99;
/// Least weight of the sums.
constexpr double kLeastWeight = 30;
/// Largest difference of two rotations that counts in full: larger ones are of wrong poses [rad].
constexpr double kLargest = 0.02;
/// Ratio of the squares at no offset to those at the best one, and logarithm of the ratio of the
/// likelihoods, from which it is certain.
constexpr double kLeastRatio = 1.25, kCertain = 15;
/// Mean square below which a difference tells nothing, as of sensors without noise [rad^2].
constexpr double kLeastSquare = 1e-8;

}  // namespace

void GyroClock::add(std::span<const ImuSample> samples, double before, double now,
                    const Eigen::Quaterniond& seen, const Imu& imu, const ImuBias& bias) {
  turns_.push_back({before, now, seen});
  if (samples.empty()) return;
  while (!turns_.empty() && turns_.front().now + kSteps * kStep <= samples.back().timestamp) {
    compare(turns_.front(), samples, imu, bias);
    turns_.pop_front();
  }
}

void GyroClock::compare(const Turn& turn, std::span<const ImuSample> samples, const Imu& imu,
                        const ImuBias& bias) {
  decltype(squares_) squares{};
  for (int i = -kSteps; i <= kSteps; ++i) {
    const auto measured =
        preintegrate(samples, turn.before + i * kStep, turn.now + i * kStep, imu, bias);
    if (!measured) return;
    const double angle = measured->rotation(bias).angularDistance(turn.seen);
    squares[static_cast<std::size_t>(i + kSteps)] =
        std::min(angle, kLargest) * std::min(angle, kLargest);
  }
  for (std::size_t i = 0; i < squares.size(); ++i) squares_[i] = kMemory * squares_[i] + squares[i];
  weight_ = kMemory * weight_ + 1;
}

std::optional<double> GyroClock::offset() const {
  const auto* best = std::ranges::min_element(squares_);
  const double ratio = squares_[kSteps] / std::max(*best, kLeastSquare * weight_);
  if (weight_ < kLeastWeight || ratio < kLeastRatio || 1.5 * weight_ * std::log(ratio) < kCertain)
    return std::nullopt;
  return kStep * static_cast<double>(best - squares_.begin() - kSteps);
}

}  // namespace stillmap
