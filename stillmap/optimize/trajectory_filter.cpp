// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/trajectory_filter.hpp"

#include "stillmap/optimize/motion_model.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// Poses that are kept, and least number of poses that are filtered: 2 s and 0.3 s.
constexpr std::size_t kMemory = 60, kMinPoses = 10;
/// Longest time between two poses of one path [s].
constexpr double kMaxGap = 0.5;
/// Smallest step and bound of the logarithms of the noise.
constexpr double kMinStep = 0.25, kMaxLog = 16;

}  // namespace

Pose TrajectoryFilter::add(const UncertainPose& pose) {
  if (!poses_.empty()) {
    const double dt = pose.timestamp - poses_.back().timestamp;
    if (!(dt > 0 && dt <= kMaxGap)) reset();
  }
  if (!(pose.covariance.trace() > 0)) return pose.T_world_camera;
  if (poses_.size() == kMemory) poses_.erase(poses_.begin());
  poses_.push_back(pose);
  if (poses_.size() < kMinPoses) return pose.T_world_camera;

  const std::vector<Sample> samples = samples_of(poses_);
  const auto filtered_with = [&](const std::array<double, 3>& logs) {
    return filter_forward(samples, noise_of(logs), Improbable::kThenVelocity);
  };
  FilteredEnd best = filtered_with(logs_);
  auto logs = logs_;
  double& step = step_[trial_];
  logs[trial_] = std::clamp(logs[trial_] + step, -kMaxLog, kMaxLog);
  const FilteredEnd other = filtered_with(logs);
  if (other.log_likelihood > best.log_likelihood) {
    best = other, logs_ = logs;
  } else {
    // A decrease is tried after an increase, then a smaller step.
    step = step > 0 ? -step : std::max(kMinStep, -step / 2);
  }
  trial_ = (trial_ + 1) % logs_.size();
  return corrected(pose.T_world_camera, best.estimate.x.head<6>() - samples.back().value);
}

void TrajectoryFilter::move(const Pose& T_corrected_world) {
  for (UncertainPose& pose : poses_) pose.T_world_camera = T_corrected_world * pose.T_world_camera;
}

}  // namespace stillmap
