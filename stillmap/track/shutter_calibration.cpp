// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/shutter_calibration.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/optimize/residual.hpp"

#include <algorithm>
#include <cmath>

#include <Eigen/Cholesky>
#include <Eigen/LU>

namespace stillmap {
namespace {

/// Steps for the derivatives by the timing [s]. That of the depth delay moves the place where a
/// depth is read to other pixels, whose noise is independent.
constexpr double kReadoutStep = 0.001, kDelayStep = 0.010;
/// Least number of landmarks of a frame that is used.
constexpr int kMinLandmarks = 50;
/// Number of frames between the two frames of a pair. The velocity changes in the meantime.
constexpr std::size_t kGap = 4;
/// Number of Gauss-Newton iterations per pair.
constexpr int kIterations = 5;
/// Information of the assumption that the timing is right, of a standard deviation of 0.1 s
/// [1/s^2].
constexpr double kPrior = 100;
/// Number of consecutive pairs whose errors are alike, because they overlap.
constexpr double kCorrelatedFrames = 4;
/// Number of frames after which the timing may change.
constexpr int kMinFrames = 20;
/// Standard deviations by which a correction must differ from zero.
constexpr double kCertain = 3;
/// Smallest corrections that are applied [s]. A readout time of 3 ms moves the outermost rows by
/// 0.8 pixels at 1 rad/s.
constexpr double kMinReadoutChange = 0.002, kMinDelayChange = 0.002;
/// Shortest first estimate that shows a rolling shutter [s]: real ones take 10 to 35 ms, and the
/// first estimate is too short.
constexpr double kMinRolling = 0.005;
/// Longest plausible times [s].
constexpr double kMaxReadout = 0.040, kMaxDelay = 0.050;

/// Returns the longest readout time [s]: the next image begins after it.
double longest_readout(const Camera& camera) {
  return camera.fps > 0 ? std::min(kMaxReadout, 1 / camera.fps) : kMaxReadout;
}

/// Cauchy kernel on a squared residual: rho(s) = k^2 log(1 + s / k^2). Wrong matches count little.
struct CauchyKernel {
  double bound = 1;  ///< Bound k^2 [sigma^2].
  double weight(double s) const { return bound / (bound + s); }
};

Eigen::Vector3d uvd_of(const Camera& camera, const Keypoint& k) {
  return {k.u, k.v, k.depth > 0 ? camera.bf() / k.depth : 0};
}

Eigen::Vector3d point_of(const Camera& camera, const Keypoint& k) {
  return camera.unproject(k.u, k.v, k.depth);
}

}  // namespace

ShutterCalibration::TimedPoint ShutterCalibration::timed_point(
    const TrackingModel& model, const MotionCompensation& compensation,
    const Keypoint& recorded) const {
  const Camera& camera = model.camera;
  const auto at = [&](double readout, double delay) {
    return compensation.keypoint(recorded,
                                 {timing_.readout + readout, timing_.depth_delay + delay});
  };
  const Keypoint k = at(0, 0), read_later = at(kReadoutStep, 0);
  const Keypoint before = at(0, -kDelayStep), after = at(0, kDelayStep);
  const auto [nearer, farther] = std::minmax(before.depth, after.depth);
  const bool edge = nearer <= 0 || depth_edge_of(camera.depth_sensor).between(nearer, farther);
  TimedPoint point;
  point.measurement = make_measurement(camera, observation_noise(camera, k.depth), k.u, k.v,
                                       edge ? 0 : k.depth, model.pyramid.scale(k.level));
  point.d_measurement.col(0) = (uvd_of(camera, read_later) - uvd_of(camera, k)) / kReadoutStep;
  if (k.depth <= 0 || edge) return point;
  point.p_camera = point_of(camera, k);
  point.d_measurement.col(1) = (uvd_of(camera, after) - uvd_of(camera, before)) / (2 * kDelayStep);
  point.d_point.col(0) = (point_of(camera, read_later) - point.p_camera) / kReadoutStep;
  point.d_point.col(1) = (point_of(camera, after) - point_of(camera, before)) / (2 * kDelayStep);
  return point;
}

/// Adds a point that both frames observe. Its residual is that of the second frame's measurement.
void ShutterCalibration::PairNormal::add(const Camera& camera, const TimedPoint& a,
                                         const TimedPoint& b, const Pose& T_to_from,
                                         const Eigen::Vector2d& correction) {
  const CauchyKernel pixel_kernel{kPixelChi2}, disparity_kernel{kDisparityChi2};
  const Eigen::Vector3d p = T_to_from * (a.p_camera + a.d_point * correction);
  if (p.z() < kNearPlane) return;
  Measurement m = b.measurement;
  m.uvd += b.d_measurement * correction;
  m.pixel_information = 1 / (1 / m.pixel_information + 1 / a.measurement.pixel_information);
  m.disparity_information /= 2;
  const Eigen::Vector3d predicted = predict(camera, p);
  const Chi2 s = chi2(m, predicted);
  const Eigen::Matrix3d J_projection = projection_jacobian(camera, p);
  Eigen::Matrix<double, 3, 8> J;
  J.leftCols<6>() = pose_jacobian(J_projection, p);
  J.rightCols<2>() = J_projection * T_to_from.rotation() * a.d_point - b.d_measurement;
  const double weight = b.weight * a.weight;
  const double pixel = weight * m.pixel_information * pixel_kernel.weight(s.pixel);
  const double disparity = weight * m.disparity_information * disparity_kernel.weight(s.disparity);
  squares += pixel * s.pixel / m.pixel_information;
  components += 2 * weight;
  if (m.has_depth()) {
    squares += disparity * s.disparity / m.disparity_information;
    components += weight;
  }
  const Eigen::Vector3d information(pixel, pixel, disparity);
  H += J.transpose() * information.asDiagonal() * J;
  g -= J.transpose() * information.asDiagonal() * (predicted - m.uvd);
  ++common;
}

ShutterCalibration::PairNormal ShutterCalibration::normal_of(const Camera& camera, const View& from,
                                                             const View& to, const Pose& T_to_from,
                                                             const Eigen::Vector2d& correction) {
  PairNormal sum;
  auto a = from.points.begin();
  for (const TimedPoint& b : to.points) {
    while (a != from.points.end() && a->track < b.track) ++a;
    if (a == from.points.end()) break;
    if (a->track == b.track && a->p_camera.z() > 0) sum.add(camera, *a, b, T_to_from, correction);
  }
  return sum;
}

std::optional<ShutterCalibration::Evidence> ShutterCalibration::evidence(const Camera& camera,
                                                                         const View& from,
                                                                         const View& to) {
  Pose T_to_from = to.T_world_camera.inverse() * from.T_world_camera;
  Eigen::Vector2d correction = Eigen::Vector2d::Zero();
  Evidence result;
  double variance = 1;  // of the residuals, relative to that expected
  for (int iteration = 0; iteration < kIterations; ++iteration) {
    const PairNormal sum = normal_of(camera, from, to, T_to_from, correction);
    if (sum.common < kMinLandmarks) return std::nullopt;
    const Eigen::LDLT<Matrix6d> pose(sum.H.topLeftCorner<6, 6>());
    if (!pose.isPositive() || pose.rcond() < 1e-14) return std::nullopt;
    const Eigen::Matrix<double, 6, 2> cross = sum.H.topRightCorner<6, 2>();
    result.information = sum.H.bottomRightCorner<2, 2>() - cross.transpose() * pose.solve(cross);
    const Eigen::Vector2d vector =
        sum.g.tail<2>() - cross.transpose() * pose.solve(sum.g.head<6>());
    const Eigen::Matrix2d regular = result.information + kPrior * Eigen::Matrix2d::Identity();
    const Eigen::Vector2d step = regular.ldlt().solve(vector - kPrior * correction);
    result.vector = result.information * correction + vector;
    correction += step;
    variance = std::max(1.0, sum.squares / sum.components);
    T_to_from = Pose::exp(pose.solve(sum.g.head<6>() - cross * step)) * T_to_from;
  }
  result.information /= variance;
  result.vector /= variance;
  return result;
}

/// Returns the second of the last three frames, with the velocity between the first and the third.
ShutterCalibration::View ShutterCalibration::view_of_middle(const TrackingModel& model) const {
  const Tracked &before = newest_[0], &middle = newest_[1], &after = newest_[2];
  const double dt = after.frame->timestamp() - before.frame->timestamp();
  const Vector6d twist = (before.T_world_camera.inverse() * after.T_world_camera).log() / dt;
  const Features& recorded = *middle.frame->recorded_features;
  const MotionCompensation compensation(*middle.frame->image, model.camera, twist);
  View view{middle.T_world_camera, {}};
  for (std::size_t i = 0; i < recorded.size(); ++i) {
    if (middle.frame->evidence.weight[i] <= 0) continue;
    TimedPoint point = timed_point(model, compensation, recorded.keypoints[i]);
    if (!point.measurement.usable()) continue;
    point.track = middle.tracks[i];
    point.weight = middle.frame->evidence.weight[i];
    view.points.push_back(point);
  }
  std::sort(view.points.begin(), view.points.end(),
            [](const auto& a, const auto& b) { return a.track < b.track; });
  return view;
}

void ShutterCalibration::add(const TrackingModel& model, const FramePtr& frame,
                             const Pose& T_world_camera,
                             const std::vector<std::int32_t>& previous) {
  const TraceScope scope("shutter calibration");
  std::vector<std::uint32_t> tracks(previous.size());
  for (std::size_t i = 0; i < tracks.size(); ++i) {
    const auto j = static_cast<std::size_t>(previous[i]);
    tracks[i] = previous[i] >= 0 && j < tracks_.size() ? tracks_[j] : next_track_++;
  }
  tracks_ = tracks;
  newest_.push_back({frame, T_world_camera, std::move(tracks)});
  if (newest_.size() < 3) return;
  views_.push_back(view_of_middle(model));
  newest_.pop_front();
  if (views_.size() <= kGap) return;
  const auto found = evidence(model.camera, views_.front(), views_.back());
  views_.pop_front();
  if (!found) return;
  const Eigen::Matrix2d regular = found->information + kPrior * Eigen::Matrix2d::Identity();
  squares_ += found->vector.dot(regular.ldlt().solve(found->vector));
  information_ += found->information;
  weighted_sum_ += found->vector;
  ++frames_;
  update(model.camera);
}

std::optional<ShutterCalibration::Correction> ShutterCalibration::correction() const {
  if (frames_ < kMinFrames) return std::nullopt;
  const Eigen::Matrix2d regular = information_ + kPrior * Eigen::Matrix2d::Identity();
  const Eigen::Matrix2d covariance = regular.inverse();
  const Eigen::Vector2d mean = covariance * weighted_sum_;
  // Frames that scatter more than their information says make the mean less certain.
  const double scatter =
      std::max(1.0, (squares_ - mean.dot(weighted_sum_)) / (2.0 * (frames_ - 1)));
  return Correction{mean, (kCorrelatedFrames * scatter * covariance.diagonal()).cwiseSqrt()};
}

/// Changes the timing if the mean correction is certain.
void ShutterCalibration::update(const Camera& camera) {
  const auto found = correction();
  if (!found) return;
  const auto& [mean, sigma] = *found;
  // A shutter cannot take less than no time: such estimates come from other errors.
  const double least = timing_.readout == 0 ? kMinRolling : kMinReadoutChange;
  const bool readout =
      std::abs(mean(0)) > std::max(kCertain * sigma(0), least) && timing_.readout + mean(0) > 0;
  const bool delay = std::abs(mean(1)) > std::max(kCertain * sigma(1), kMinDelayChange);
  if (!readout && !delay) return;
  // Points move further between rows than the search for matches expects, so the first estimate of
  // a long readout time is too short. That of the sensor is a better start.
  const bool begins_to_roll = timing_.readout == 0 && camera.depth_sensor.readout > 0;
  if (readout && begins_to_roll)
    timing_.readout = camera.depth_sensor.readout;
  else if (readout)
    timing_.readout = std::min(timing_.readout + mean(0), longest_readout(camera));
  if (delay) timing_.depth_delay = std::clamp(timing_.depth_delay + mean(1), -kMaxDelay, kMaxDelay);
  information_.setZero();
  weighted_sum_.setZero();
  squares_ = 0;
  frames_ = 0;
  interrupt();  // They were compensated with the previous timing.
}

}  // namespace stillmap
