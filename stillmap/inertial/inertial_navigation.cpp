// SPDX-License-Identifier: Apache-2.0
#include "stillmap/inertial/inertial_navigation.hpp"

#include "stillmap/geometry/adjoint.hpp"
#include "stillmap/geometry/contradiction.hpp"

#include <cmath>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

using Eigen::Matrix3d, Eigen::Vector3d;
using Matrix6d = Eigen::Matrix<double, 6, 6>;

// First rows of the parts of the state.
constexpr int kPosition = 0, kVelocity = 3, kRotation = 6, kGyro = 9, kAccel = 12, kGravity = 15;

constexpr double kStandardGravity = 9.80665;  // [m/s^2]
/// Acceleration below which there is no accelerometer, and largest plausible difference from that
/// of gravity in the mean of a fifth of a second [m/s^2].
constexpr double kLeastAcceleration = 0.1, kLargestDifference = 5;
/// Standard deviations of the first velocity [m/s] and direction of gravity [rad].
constexpr double kFirstVelocity = 1, kFirstTilt = 0.2;
/// Errors of a camera's pose that its covariance does not contain, some of them equal in many
/// frames: a factor on the covariance, and standard deviations [m], [rad].
constexpr double kPoseFactor = 4, kPoseMeters = 2e-3, kPoseRadians = 1e-3;
/// Drift of the map per square root of the path [m/sqrt(m)], [rad/sqrt(m)]: in new parts of
/// rendered rooms up to 8 mrad in 1.6 m. Without it the bias of the gyroscope would follow the
/// drift.
constexpr double kDriftMeters = 0.01, kDriftRadians = 0.005;
/// Standard deviation of a velocity by images of a third of a second [m/s].
constexpr double kVelocityNoise = 0.02;
/// Time for which a state is corrected before it is used [s].
constexpr double kSettled = 2;
/// Largest standard deviation of an upward direction [rad].
constexpr double kLargestTilt = 0.0087;

/// Returns the mean of the accelerations within a tenth of a second of a time; zero without any.
Vector3d mean_acceleration(std::span<const ImuSample> samples, double timestamp) {
  constexpr double kWindow = 0.1;
  Vector3d sum = Vector3d::Zero();
  int count = 0;
  for (const ImuSample& sample : samples) {
    if (std::abs(sample.timestamp - timestamp) > kWindow) continue;
    sum += sample.acceleration;
    ++count;
  }
  return count > 0 ? Vector3d(sum / count) : sum;
}

Matrix3d square(double sigma) { return sigma * sigma * Matrix3d::Identity(); }

}  // namespace

InertialNavigation::InertialNavigation(const Imu& imu) : imu_(imu) {}

void InertialNavigation::propagate(std::span<const ImuSample> samples, double timestamp) {
  mean_acceleration_ = mean_acceleration(samples, timestamp);
  if (!begun_) return;
  const auto motion = preintegrate(samples, timestamp_, timestamp, imu_, bias_);
  begun_ = motion && is_plausible();
  if (!begun_) return;
  const double t = motion->seconds();
  const Matrix3d R = rotation_.toRotationMatrix();
  const Eigen::Quaterniond turn = motion->rotation(bias_);
  const Vector3d dv = motion->velocity(bias_), dp = motion->position(bias_);
  const Eigen::Matrix<double, 9, 6> by_bias = motion->by_bias();  // rotation, velocity, position

  Covariance F = Covariance::Identity();
  F.block<3, 3>(kPosition, kVelocity) = t * Matrix3d::Identity();
  F.block<3, 3>(kPosition, kRotation) = -R * skew(dp);
  F.block<3, 6>(kPosition, kGyro) = R * by_bias.bottomRows<3>();
  F.block<3, 3>(kPosition, kGravity) = -t * t / 2 * skew(gravity_);
  F.block<3, 3>(kVelocity, kRotation) = -R * skew(dv);
  F.block<3, 6>(kVelocity, kGyro) = R * by_bias.middleRows<3>(3);
  F.block<3, 3>(kVelocity, kGravity) = -t * skew(gravity_);
  F.block<3, 3>(kRotation, kRotation) = turn.toRotationMatrix().transpose();
  F.block<3, 6>(kRotation, kGyro) = by_bias.topRows<3>();
  // From (rotation, velocity, position) of the measurements to the state.
  Eigen::Matrix<double, kStates, 9> G = Eigen::Matrix<double, kStates, 9>::Zero();
  G.block<3, 3>(kRotation, 0) = Matrix3d::Identity();
  G.block<3, 3>(kVelocity, 3) = R;
  G.block<3, 3>(kPosition, 6) = R;
  P_ = (F * P_ * F.transpose() + G * motion->covariance() * G.transpose()).eval();
  P_.diagonal().segment<3>(kGyro).array() += t * imu_.gyro_walk * imu_.gyro_walk;
  P_.diagonal().segment<3>(kAccel).array() += t * imu_.accel_walk * imu_.accel_walk;

  const Vector3d way = t * velocity_ + t * t / 2 * gravity_ + R * dp;
  position_ += way;
  velocity_ += t * gravity_ + R * dv;
  rotation_ = (rotation_ * turn).normalized();
  timestamp_ = timestamp;
  drift(way.norm());
}

/// Returns whether the newest accelerations can be of a camera near the earth's surface, in m/s^2.
bool InertialNavigation::is_plausible() const {
  return std::abs(mean_acceleration_.norm() - kStandardGravity) <= kLargestDifference;
}

bool InertialNavigation::contradicted() const {
  const bool measured = mean_acceleration_.norm() > kLeastAcceleration;
  return contradictions_.too_many() || (measured && !is_plausible());
}

/// Returns the pose of the IMU with the covariance of (position in the world, rotation vector),
/// with the errors that the camera's covariance does not contain.
UncertainPose InertialNavigation::of_imu(const UncertainPose& camera) const {
  UncertainPose pose{camera.timestamp, camera.T_world_camera * imu_.T_camera_imu};
  Matrix6d J = adjoint(imu_.T_camera_imu.inverse());
  J.topRows<3>() = (pose.T_world_camera.rotation() * J.topRows<3>()).eval();
  pose.covariance = J * with_map_error(camera.covariance) * J.transpose();
  return pose;
}

Matrix6d InertialNavigation::with_map_error(const Matrix6d& of_images) {
  Matrix6d covariance = kPoseFactor * of_images;
  covariance.diagonal().head<3>().array() += kPoseMeters * kPoseMeters;
  covariance.diagonal().tail<3>().array() += kPoseRadians * kPoseRadians;
  return covariance;
}

void InertialNavigation::begin(const UncertainPose& pose) {
  if (!is_plausible()) return;
  const UncertainPose imu = of_imu(pose);
  begun_ = true;
  since_ = timestamp_ = pose.timestamp;
  position_ = imu.T_world_camera.translation();
  rotation_ = imu.T_world_camera.quaternion();
  velocity_.setZero();
  gravity_ = -kStandardGravity * (rotation_ * mean_acceleration_.normalized());
  contradictions_.clear();
  P_.setZero();
  P_.block<3, 3>(kPosition, kPosition) = imu.covariance.topLeftCorner<3, 3>();
  P_.block<3, 3>(kRotation, kRotation) = imu.covariance.bottomRightCorner<3, 3>();
  P_.block<3, 3>(kVelocity, kVelocity) = square(kFirstVelocity);
  P_.block<3, 3>(kGyro, kGyro) = square(imu_.gyro_bias);
  P_.block<3, 3>(kAccel, kAccel) = square(imu_.accel_bias);
  P_.block<3, 3>(kGravity, kGravity) = square(kFirstTilt);
}

void InertialNavigation::correct(const UncertainPose& pose) {
  if (!begun_) return begin(pose);
  const UncertainPose imu = of_imu(pose);
  Eigen::Matrix<double, 6, 1> innovation;
  innovation << imu.T_world_camera.translation() - position_,
      so3_log(rotation_.conjugate() * imu.T_world_camera.quaternion());
  Eigen::Matrix<double, 6, kStates> H = Eigen::Matrix<double, 6, kStates>::Zero();
  H.block<3, 3>(0, kPosition).setIdentity();
  H.block<3, 3>(3, kRotation).setIdentity();
  contradictions_.add(update<6>(H, innovation, imu.covariance) > kContradiction);
}

void InertialNavigation::correct_velocity(const Vector3d& error) {
  if (!begun_) return;
  Eigen::Matrix<double, 3, kStates> H = Eigen::Matrix<double, 3, kStates>::Zero();
  H.block<3, 3>(0, kVelocity).setIdentity();
  update<3>(H, error, square(kVelocityNoise));
}

/// Returns the squared length of the innovation [sigma^2].
template <int Rows>
double InertialNavigation::update(const Eigen::Matrix<double, Rows, kStates>& H,
                                  const Eigen::Matrix<double, Rows, 1>& innovation,
                                  const Eigen::Matrix<double, Rows, Rows>& noise) {
  const Eigen::LLT<Eigen::Matrix<double, Rows, Rows>> S(H * P_ * H.transpose() + noise);
  const double chi2 = innovation.dot(S.solve(innovation));
  const Eigen::Matrix<double, Rows, kStates> gain = S.solve(H * P_);
  const Eigen::Matrix<double, kStates, 1> x = gain.transpose() * innovation;
  P_ -= (gain.transpose() * H * P_).eval();
  P_ = (0.5 * (P_ + P_.transpose())).eval();
  position_ += x.template segment<3>(kPosition);
  velocity_ += x.template segment<3>(kVelocity);
  rotation_ = (rotation_ * so3_exp(x.template segment<3>(kRotation))).normalized();
  bias_.gyro += x.template segment<3>(kGyro);
  bias_.accel += x.template segment<3>(kAccel);
  gravity_ = so3_exp(x.template segment<3>(kGravity)) * gravity_;
  return chi2;
}

double InertialNavigation::velocity_sigma() const {
  return std::sqrt(P_.diagonal().segment<3>(kVelocity).maxCoeff());
}

std::optional<Vector3d> InertialNavigation::up_in_camera() const {
  if (!is_settled()) return std::nullopt;
  const Matrix3d R_imu_world = rotation_.conjugate().toRotationMatrix();
  const Vector3d up = -R_imu_world * gravity_.normalized();
  Eigen::Matrix<double, 3, kStates> J = Eigen::Matrix<double, 3, kStates>::Zero();
  const Matrix3d across = Matrix3d::Identity() - up * up.transpose();
  J.block<3, 3>(0, kRotation) = -across;
  J.block<3, 3>(0, kGravity) = across * R_imu_world;
  const double sigma = std::sqrt((J * P_ * J.transpose()).trace() / 2);
  if (sigma > kLargestTilt) return std::nullopt;
  return Vector3d(imu_.T_camera_imu.quaternion() * up);
}

/// Adds the drift of a map that grows with the path of the camera: it turns the world of the map,
/// with all that is given in it, and moves the position.
void InertialNavigation::drift(double meters) {
  Eigen::Matrix<double, kStates, 3> J = Eigen::Matrix<double, kStates, 3>::Zero();
  J.block<3, 3>(kVelocity, 0) = -skew(velocity_);
  J.block<3, 3>(kRotation, 0) = rotation_.conjugate().toRotationMatrix();
  J.block<3, 3>(kGravity, 0) = Matrix3d::Identity();
  P_ += kDriftRadians * kDriftRadians * meters * J * J.transpose();
  P_.block<3, 3>(kPosition, kPosition) +=
      kDriftMeters * kDriftMeters * meters * Matrix3d::Identity();
}

void InertialNavigation::move(const Pose& T_corrected_world) {
  if (!begun_) return;
  const Matrix3d R = T_corrected_world.rotation();
  position_ = T_corrected_world * position_;
  rotation_ = (T_corrected_world.quaternion() * rotation_).normalized();
  velocity_ = R * velocity_;
  gravity_ = R * gravity_;
  Covariance J = Covariance::Identity();
  for (const int part : {kPosition, kVelocity, kGravity}) J.block<3, 3>(part, part) = R;
  P_ = (J * P_ * J.transpose()).eval();
}

void InertialNavigation::enter(const UncertainPose& pose) {
  if (!begun_) return begin(pose);
  move(of_imu(pose).T_world_camera * T_world_imu().inverse());
}

bool InertialNavigation::is_settled() const { return begun_ && timestamp_ >= since_ + kSettled; }

std::optional<UncertainPose> InertialNavigation::pose() const {
  if (!begun_) return std::nullopt;
  const Matrix3d R_imu_world = rotation_.conjugate().toRotationMatrix();
  Matrix6d P;  // of the perturbation in the frame of the IMU
  P << R_imu_world * P_.block<3, 3>(kPosition, kPosition) * R_imu_world.transpose(),
      R_imu_world * P_.block<3, 3>(kPosition, kRotation),
      P_.block<3, 3>(kRotation, kPosition) * R_imu_world.transpose(),
      P_.block<3, 3>(kRotation, kRotation);
  const Matrix6d J = adjoint(imu_.T_camera_imu);
  return UncertainPose{timestamp_, T_world_imu() * imu_.T_camera_imu.inverse(),
                       J * P * J.transpose()};
}

}  // namespace stillmap
