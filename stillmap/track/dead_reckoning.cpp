// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/dead_reckoning.hpp"

#include "stillmap/geometry/contradiction.hpp"

#include <Eigen/Cholesky>
#include <fmt/format.h>

namespace stillmap {
namespace {

using Matrix6d = Eigen::Matrix<double, 6, 6>;

/// Largest standard deviations of a pose, and of one at which a map is continued [m], [rad].
constexpr double kMaxMeters = 0.5, kMaxRadians = 0.15, kCertainMeters = 0.15,
                 kCertainRadians = 0.08;

bool is_within(const UncertainPose& pose, double meters, double radians) {
  const auto variance = pose.covariance.diagonal();
  return variance.head<3>().maxCoeff() < meters * meters &&
         variance.tail<3>().maxCoeff() < radians * radians;
}

/// Returns the mean of two independent poses of one time, weighted by their information; the first
/// one if they contradict each other.
UncertainPose mean(const UncertainPose& a, const UncertainPose& b) {
  const Eigen::Matrix<double, 6, 1> difference =
      (a.T_world_camera.inverse() * b.T_world_camera).log();
  const Eigen::LLT<Matrix6d> S(a.covariance + b.covariance);
  if (difference.dot(S.solve(difference)) > kContradiction) return a;
  const Matrix6d gain = S.solve(a.covariance).transpose();
  return {a.timestamp, a.T_world_camera * Pose::exp(gain * difference),
          a.covariance - gain * a.covariance};
}

/// Returns the pose by both or by one; none if it is too uncertain.
std::optional<UncertainPose> joined(const std::optional<UncertainPose>& by_inertia,
                                    const std::optional<UncertainPose>& by_wheels) {
  std::optional<UncertainPose> pose = by_inertia ? by_inertia : by_wheels;
  if (by_inertia && by_wheels) pose = mean(*by_inertia, *by_wheels);
  return pose && is_within(*pose, kMaxMeters, kMaxRadians) ? pose : std::nullopt;
}

/// Returns whether there is a sample of the last second before a frame.
template <typename Samples>
bool reaches(const Samples& samples, double timestamp) {
  return !samples.empty() && samples.front().timestamp <= timestamp;
}

}  // namespace

DeadReckoning::DeadReckoning(const Camera& camera) {
  if (camera.imu) inertia_.emplace(*camera.imu);
  if (camera.wheels) wheels_.emplace(*camera.wheels);
}

void DeadReckoning::propagate(const RgbdFrame& image, bool gyro_contradicted) {
  gyro_contradicted_ = gyro_contradicted;
  ++frames_;
  without_imu_ += inertia_ && !reaches(image.imu, image.timestamp);
  without_odometry_ += wheels_ && !reaches(image.odometry, image.timestamp);
  if (inertia_) inertia_->propagate(image.imu, image.timestamp);
  prediction_.propagate(image.imu, image.timestamp);
  if (wheels_) wheels_->propagate(image.odometry, image.timestamp);
}

void DeadReckoning::correct(const UncertainPose& pose, bool same_world) {
  if (inertia_ && same_world) inertia_->correct(pose);
  if (inertia_ && !same_world) inertia_->enter(pose);
  if (!same_world) prediction_.reset();
  if (inertia_) prediction_.compare(pose, *inertia_);
  if (wheels_) wheels_->correct(pose, same_world);
  ++compared_;
  inertia_left_out_ += is_inertia_contradicted();
  wheels_left_out_ += wheels_ && wheels_->contradicted();
}

void DeadReckoning::correct_velocity(const Eigen::Vector3d& error) {
  if (inertia_ && !by_wheels()) inertia_->correct_velocity(error);
}

void DeadReckoning::mount(const Imu& imu) {
  inertia_.emplace(imu);
  prediction_ = {};
  gyro_contradicted_ = false;
}

void DeadReckoning::move(const Pose& T_corrected_world) {
  if (inertia_) inertia_->move(T_corrected_world);
  prediction_.move(T_corrected_world);
  if (wheels_) wheels_->move(T_corrected_world);
}

std::optional<UncertainPose> DeadReckoning::pose() const {
  return joined(by_inertia() ? inertia_->pose() : std::nullopt,
                wheels_ ? wheels_->pose() : std::nullopt);
}

std::optional<UncertainPose> DeadReckoning::expected() const {
  return joined(by_inertia() ? prediction_.pose() : std::nullopt,
                wheels_ ? wheels_->pose_since_earlier() : std::nullopt);
}

std::optional<Eigen::Vector3d> DeadReckoning::up_in_camera() const {
  return by_inertia() ? inertia_->up_in_camera() : std::nullopt;
}

bool DeadReckoning::is_inertia_contradicted() const {
  return inertia_ && (gyro_contradicted_ || inertia_->contradicted() || prediction_.contradicted());
}

bool DeadReckoning::by_inertia() const {
  return inertia_ && inertia_->is_settled() && !is_inertia_contradicted();
}

std::vector<Finding> DeadReckoning::findings() const {
  std::vector<Finding> findings;
  const auto add = [&](FindingCode code, const char* what, std::size_t left_out, const char* fix) {
    if (2 * left_out < compared_ || left_out == 0) return;
    findings.push_back(make_finding(
        code,
        fmt::format("{} contradict the images; they were left out in {} of {} frames", what,
                    left_out, compared_),
        fix,
        {{"left_out", static_cast<double>(left_out)}, {"frames", static_cast<double>(compared_)}}));
  };
  add("accelerometer-unlike", "the accelerations", inertia_left_out_,
      "check the accelerometer's axes (T_camera_imu), its unit (m/s^2, 9.81 upward at rest) and "
      "its clock (imu_time_offset)");
  add("odometry-unlike", "the motions of the wheels", wheels_left_out_,
      "check the pose of the base (T_camera_base), the unit (meters), the clock of the odometry "
      "and whether the wheels slip");
  const auto add_missing = [&](const char* whose, std::size_t without, const char* fix) {
    if (2 * without <= frames_) return;
    findings.push_back(make_finding(
        "motion-samples",
        fmt::format("{} of {} frames have no samples of {} of their time", without, frames_, whose),
        fix,
        {{"without", static_cast<double>(without)}, {"frames", static_cast<double>(frames_)}}));
  };
  add_missing("the IMU", without_imu_,
              "check the clock and the unit of its time stamps (imu_time_offset), or take imu out "
              "of the camera file");
  add_missing("the wheels", without_odometry_,
              "check the clock and the unit of their time stamps, or take T_camera_base out of the "
              "camera file");
  return findings;
}

double DeadReckoning::velocity_sigma() const {
  return inertia_ && !by_wheels() ? inertia_->velocity_sigma() : 0;
}

bool is_certain(const UncertainPose& pose) {
  return is_within(pose, kCertainMeters, kCertainRadians);
}

}  // namespace stillmap
