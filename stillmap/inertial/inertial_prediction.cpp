// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/inertial_prediction.hpp"

#include "stillmap/geometry/contradiction.hpp"

#include <utility>

namespace stillmap {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Time after which another state begins [s].
constexpr double kRenewal = 0.25;

}  // namespace

void InertialPrediction::propagate(std::span<const ImuSample> samples, double timestamp) {
  if (older_) older_->propagate(samples, timestamp);
  if (newer_) newer_->propagate(samples, timestamp);
}

void InertialPrediction::compare(const UncertainPose& pose, const InertialNavigation& navigation) {
  if (newer_ && pose.timestamp < renewed_ + kRenewal) return;
  if (const auto predicted = this->pose()) {
    const Eigen::Matrix<double, 6, 1> difference =
        (predicted->T_world_camera.inverse() * pose.T_world_camera).log();
    const Matrix6d S = predicted->covariance + navigation.with_map_error(pose.covariance);
    contradictions_.add(squared_sigmas(difference, S) > kContradiction);
  }
  older_ = std::exchange(newer_, navigation);
  renewed_ = pose.timestamp;
}

void InertialPrediction::move(const Pose& T_corrected_world) {
  if (older_) older_->move(T_corrected_world);
  if (newer_) newer_->move(T_corrected_world);
}

void InertialPrediction::reset() {
  older_.reset();
  newer_.reset();
}

std::optional<UncertainPose> InertialPrediction::pose() const {
  return older_ ? older_->pose() : std::nullopt;
}

}  // namespace stillmap
