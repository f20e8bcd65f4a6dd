// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/shutter_calibration.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/optimize/residual.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace stillmap {
namespace {

using Matrix8d = Eigen::Matrix<double, 8, 8>;
using Vector8d = Eigen::Matrix<double, 8, 1>;

/// Steps for the derivatives by the timing [s]. That of the depth delay moves the place where a
/// depth is read to other pixels, whose noise is independent.
constexpr double kReadoutStep = 0.001, kDelayStep = 0.010;
/// Least number of landmarks of a frame that is used.
constexpr int kMinLandmarks = 50;
/// Number of consecutive frames whose errors are alike, because they observe the same landmarks.
constexpr double kCorrelatedFrames = 10;
/// Number of frames after which the timing may change.
constexpr int kMinFrames = 20;
/// Standard deviations by which a correction must differ from zero.
constexpr double kCertain = 4;
/// Smallest corrections that are applied [s]. A readout time of 3 ms moves the outermost rows by
/// 0.8 pixels at 1 rad/s.
constexpr double kMinReadoutChange = 0.003, kMinDelayChange = 0.003;
/// Longest plausible times [s].
constexpr double kMaxReadout = 0.040, kMaxDelay = 0.050;

/// A measurement (u, v, d) and its derivatives by readout time and depth delay.
struct TimedMeasurement {
  Measurement value;
  Eigen::Matrix<double, 3, 2> derivative = Eigen::Matrix<double, 3, 2>::Zero();
};

Eigen::Vector3d uvd_of(const Camera& camera, const Keypoint& k) {
  return {k.u, k.v, k.depth > 0 ? camera.bf() / k.depth : 0};
}

TimedMeasurement timed_measurement(const TrackingModel& model,
                                   const MotionCompensation& compensation, const Keypoint& recorded,
                                   const ShutterTiming& timing) {
  const Camera& camera = model.camera;
  const Keypoint k = compensation.keypoint(recorded, timing);
  const double scale = model.pyramid.scale(k.level);
  TimedMeasurement m;
  m.value = make_measurement(camera, observation_noise(camera, k.depth), k.u, k.v, k.depth, scale);
  const Keypoint other =
      compensation.keypoint(recorded, {timing.readout + kReadoutStep, timing.depth_delay});
  m.derivative.col(0) = (uvd_of(camera, other) - uvd_of(camera, k)) / kReadoutStep;
  const Keypoint before =
      compensation.keypoint(recorded, {timing.readout, timing.depth_delay - kDelayStep});
  const Keypoint after =
      compensation.keypoint(recorded, {timing.readout, timing.depth_delay + kDelayStep});
  const double change = std::abs(after.depth - before.depth);
  const bool edge = before.depth <= 0 || after.depth <= 0 || change > 0.1 * k.depth;
  if (k.depth <= 0 || edge) {
    m.value.disparity_information = 0;
    m.derivative.row(2).setZero();
  } else {
    m.derivative(2, 1) =
        (camera.bf() / after.depth - camera.bf() / before.depth) / (2 * kDelayStep);
  }
  return m;
}

}  // namespace

void ShutterCalibration::add(const TrackingModel& model, const RgbdFrame& image,
                             const Features& recorded, const Vector6d& twist,
                             const PoseEstimate& estimate) {
  const TraceScope scope("shutter calibration");
  if (static_cast<int>(estimate.matches.size()) < kMinLandmarks) return;
  const MotionCompensation compensation(image, model.camera, twist);
  const Pose T_camera_world = estimate.T_world_camera.inverse();
  const HuberKernel pixel_kernel{kPixelChi2}, disparity_kernel{kDisparityChi2};
  Matrix8d H = Matrix8d::Zero();
  Vector8d g = Vector8d::Zero();
  for (const PointMatch& match : estimate.matches) {
    const TimedMeasurement m =
        timed_measurement(model, compensation, recorded.keypoints[match.keypoint], timing_);
    const Eigen::Vector3d p = T_camera_world * match.p_world;
    if (p.z() < kNearPlane || !m.value.usable()) continue;
    const Eigen::Vector3d predicted = predict(model.camera, p);
    const Chi2 s = chi2(m.value, predicted);
    Eigen::Matrix<double, 3, 8> J;
    J.leftCols<6>() = pose_jacobian(projection_jacobian(model.camera, p), p);
    J.rightCols<2>() = -m.derivative;
    const Eigen::Vector3d information =
        match.weight *
        Eigen::Vector3d(m.value.pixel_information * pixel_kernel.weight(s.pixel),
                        m.value.pixel_information * pixel_kernel.weight(s.pixel),
                        m.value.disparity_information * disparity_kernel.weight(s.disparity));
    H += J.transpose() * information.asDiagonal() * J;
    g -= J.transpose() * information.asDiagonal() * (predicted - m.value.uvd);
  }
  const Eigen::LDLT<Matrix6d> pose(H.topLeftCorner<6, 6>());
  if (!pose.isPositive() || pose.rcond() < 1e-14) return;
  const Eigen::Matrix<double, 6, 2> cross = H.topRightCorner<6, 2>();
  const Eigen::Matrix2d information =
      H.bottomRightCorner<2, 2>() - cross.transpose() * pose.solve(cross);
  const Eigen::Vector2d vector = g.tail<2>() - cross.transpose() * pose.solve(g.head<6>());
  const Eigen::Matrix2d regular = information + Eigen::Vector2d(1.0, 1.0).asDiagonal().toDenseMatrix();
  squares_ += vector.dot(regular.ldlt().solve(vector));
  information_ += information;
  weighted_sum_ += vector;
  ++frames_;
  update();
}

/// Changes the timing if the mean correction is certain.
void ShutterCalibration::update() {
  if (frames_ < kMinFrames) return;
  const Eigen::Matrix2d regular =
      information_ + Eigen::Vector2d(1.0, 1.0).asDiagonal().toDenseMatrix();  // 1 s standard deviation
  const Eigen::Matrix2d covariance = regular.inverse();
  const Eigen::Vector2d mean = covariance * weighted_sum_;
  // Frames that scatter more than their information says make the mean less certain.
  const double scatter =
      std::max(1.0, (squares_ - mean.dot(weighted_sum_)) / (2.0 * (frames_ - 1)));
  const Eigen::Vector2d sigma =
      (kCorrelatedFrames * scatter * covariance.diagonal()).cwiseSqrt();
  if (std::getenv("SM_PRINT") && frames_ % 20 == 0)
    std::fprintf(stderr, "calib n %d used %.1f %.1f mean %.2f %.2f sigma %.2f %.2f ms scatter %.1f\n",
                 frames_, 1e3 * timing_.readout, 1e3 * timing_.depth_delay, 1e3 * mean(0),
                 1e3 * mean(1), 1e3 * sigma(0), 1e3 * sigma(1), scatter);
  const bool readout = std::abs(mean(0)) > std::max(kCertain * sigma(0), kMinReadoutChange);
  const bool delay = std::abs(mean(1)) > std::max(kCertain * sigma(1), kMinDelayChange);
  if (!readout && !delay) return;
  if (readout)
    timing_.readout = std::clamp(timing_.readout + mean(0), -kMaxReadout, kMaxReadout);
  if (delay)
    timing_.depth_delay = std::clamp(timing_.depth_delay + mean(1), -kMaxDelay, kMaxDelay);
  information_.setZero();
  weighted_sum_.setZero();
  squares_ = 0;
  frames_ = 0;
}

}  // namespace stillmap
