// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/camera_calibration.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/optimize/normal_equations.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <optional>
#include <utility>
#include <vector>

#include <Eigen/Cholesky>

namespace stillmap {
namespace {

/// Maximum number of Gauss-Newton iterations, and the change of all parameters, in standard
/// deviations of the prior, below which the iteration ends.
constexpr int kIterations = 20;
constexpr double kConverged = 1e-5;
/// Standard deviations of the prior: share of the focal lengths, share of the image size, disparity
/// [1/m]. Sensors have disparity errors of up to 0.034 1/m (lab/records/real_sensors.md). Disparity
/// errors that are linear in the image position and errors of the intrinsics are both projective
/// transformations of the scene; without the prior they cannot be told apart.
constexpr double kFocalPrior = 0.1, kCenterPrior = 0.1, kDisparityPrior = 0.03;
/// Factor on the variance for errors that are correlated between frames, apart from the correlation
/// that the jackknife shows: the errors of a landmark persist over many frames, are absorbed by its
/// position, and hardly appear in the residuals. With 4, the standard deviations hold on pieces of
/// recordings with known cameras (python3 -m lab calibrations).
constexpr double kAlike = 4;
/// Number of groups of poses of the jackknife.
constexpr std::size_t kGroups = 20;
/// Least correction of an intrinsic parameter that shows it to be wrong: share of the focal length,
/// and standard deviations.
constexpr double kWrong = 0.04, kCertain = 3;
/// Damping of poses and points without information [1/m^2, 1/rad^2].
constexpr double kFloor = 1e-3;

using Matrix63d = Eigen::Matrix<double, 6, 3>;
using CameraMatrix = Eigen::Matrix<double, kCameraParameters, kCameraParameters>;
using CameraGain = Eigen::Matrix<double, kCameraParameters, Eigen::Dynamic>;
using Camera3d = Eigen::Matrix<double, kCameraParameters, 3>;

/// Cauchy kernel on a squared residual: rho(s) = k^2 log(1 + s / k^2). Wrong matches and the depth
/// beyond an edge count little.
double cauchy_weight(double bound, double s) { return bound / (bound + s); }

struct Term {
  std::uint32_t pose = 0;
  Measurement measurement;
  double weight = 1;
  /// Derivatives of the disparity's error by offset, bow and slopes.
  Eigen::RowVector4d disparity_terms = Eigen::RowVector4d::Zero();
};

/// Derivatives and weighted residual of one observation.
struct Linear {
  Matrix36d J_pose;
  Eigen::Matrix<double, 3, kCameraParameters> J_camera;
  Eigen::Matrix3d J_point;
  Eigen::Vector3d residual, information;
};

/// Normal equations of a point: its own block, its gradient and its couplings.
struct PointNormals {
  Eigen::Matrix3d V = kFloor * Eigen::Matrix3d::Identity();
  Eigen::Vector3d g = Eigen::Vector3d::Zero();
  std::vector<Matrix63d> W;  ///< Per term; rows of the pose.
  Camera3d W_camera = Camera3d::Zero();
  Eigen::Matrix3d V_inverse = Eigen::Matrix3d::Identity();
};

/// The reduced system of poses and parameters: the camera's block is the last.
struct Reduced {
  Eigen::MatrixXd H;
  Eigen::VectorXd g;
};

class Calibrator {
 public:
  explicit Calibrator(const BundleProblem& problem);
  CameraCalibration run(AlikeErrors alike);

 private:
  std::size_t poses() const { return T_camera_world_.size(); }
  Eigen::Index block(std::uint32_t pose) const { return 6 * static_cast<Eigen::Index>(pose); }
  Eigen::Index camera_block() const { return 6 * static_cast<Eigen::Index>(poses()); }
  Camera corrected() const;
  std::optional<Linear> linear(const Term& term, std::size_t point, const Camera& camera) const;
  PointNormals eliminate(std::size_t point, const Camera& camera, Reduced& reduced) const;
  double step();
  void solve();
  CameraVector prior_information() const;
  CameraMatrix jackknife(const Camera& camera, const std::vector<PointNormals>& points,
                         const CameraGain& gain) const;
  Reduced reduce(const Camera& camera, std::vector<PointNormals>& points) const;
  double residual_variance(const Camera& camera) const;
  struct Variances;
  std::optional<Variances> variances() const;

  const Camera given_;
  std::vector<Pose> T_camera_world_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<std::vector<Term>> terms_;  // per point
  std::uint32_t fixed_ = 0;
  std::size_t observations_ = 0;
  double alike_ = kAlike;  // factor on the variance for correlated errors
  CameraVector correction_ = CameraVector::Zero();
};

/// Variances of the parameters, from the Hessian and from the jackknife.
struct Calibrator::Variances {
  CameraVector hessian, groups;
};

Calibrator::Calibrator(const BundleProblem& problem)
    : given_(problem.camera), points_(problem.points), terms_(problem.points.size()) {
  for (const Pose& pose : problem.T_world_camera) T_camera_world_.push_back(pose.inverse());
  std::vector<std::size_t> seen(poses());
  for (const BundleObservation& o : problem.observations) {
    const ObservationNoise noise = observation_noise(given_, o.depth);
    const Measurement m = make_measurement(given_, noise, o.u, o.v, o.depth, o.scale);
    if (!m.usable() || !(o.weight > 0) || !std::isfinite(o.weight)) continue;
    const double corner = std::hypot(given_.width, given_.height) / 2;
    terms_[o.point].push_back({o.pose,
                               m,
                               o.weight,
                               {1, given_.squared_radius(o.u, o.v), (o.u - given_.cx) / corner,
                                (o.v - given_.cy) / corner}});
    ++seen[o.pose];
    ++observations_;
  }
  fixed_ = static_cast<std::uint32_t>(std::max_element(seen.begin(), seen.end()) - seen.begin());
}

Camera Calibrator::corrected() const {
  Camera camera = given_;
  camera.fx += correction_(kFx), camera.fy += correction_(kFy);
  camera.cx += correction_(kCx), camera.cy += correction_(kCy);
  // The unit of the disparity stays that of the measurements.
  camera.baseline = given_.bf() / camera.fx;
  return camera;
}

std::optional<Linear> Calibrator::linear(const Term& term, std::size_t point,
                                         const Camera& camera) const {
  const Pose& T = T_camera_world_[term.pose];
  const Eigen::Vector3d p = T * points_[point];
  if (!(p.z() >= kNearPlane)) return std::nullopt;
  const double bf = given_.bf();
  Eigen::Vector3d predicted = predict(camera, p);
  predicted.z() += bf * term.disparity_terms.dot(correction_.tail<4>());
  Linear l;
  const Eigen::Matrix3d J = projection_jacobian(camera, p);
  l.J_pose = pose_jacobian(J, p);
  l.J_point = point_jacobian(J, T.rotation());
  l.J_camera.setZero();
  l.J_camera(0, kFx) = p.x() / p.z(), l.J_camera(0, kCx) = 1;
  l.J_camera(1, kFy) = p.y() / p.z(), l.J_camera(1, kCy) = 1;
  l.J_camera.block<1, 4>(2, kDisparityOffset) = bf * term.disparity_terms;
  l.residual = predicted - term.measurement.uvd;
  const Chi2 s = chi2(term.measurement, predicted);
  const double pixel =
      term.weight * term.measurement.pixel_information * cauchy_weight(kPixelChi2, s.pixel);
  const double disparity = term.weight * term.measurement.disparity_information *
                           cauchy_weight(kDisparityChi2, s.disparity);
  l.information << pixel, pixel, disparity;
  return l;
}

/// Adds a point's observations to the reduced system: H -= W V^-1 W^T, g -= W V^-1 g.
PointNormals Calibrator::eliminate(std::size_t point, const Camera& camera,
                                   Reduced& reduced) const {
  const std::vector<Term>& terms = terms_[point];
  PointNormals n;
  n.W.assign(terms.size(), Matrix63d::Zero());
  const Eigen::Index c = camera_block();
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const auto l = linear(terms[i], point, camera);
    if (!l) continue;
    const Eigen::Matrix<double, 6, 3> pose_w = l->J_pose.transpose() * l->information.asDiagonal();
    const Camera3d camera_w = l->J_camera.transpose() * l->information.asDiagonal();
    const Eigen::Index p = block(terms[i].pose);
    reduced.H.block<6, 6>(p, p).noalias() += pose_w * l->J_pose;
    reduced.H.block<kCameraParameters, 6>(c, p).noalias() += camera_w * l->J_pose;
    reduced.H.block<kCameraParameters, kCameraParameters>(c, c).noalias() += camera_w * l->J_camera;
    reduced.g.segment<6>(p).noalias() += pose_w * l->residual;
    reduced.g.tail<kCameraParameters>().noalias() += camera_w * l->residual;
    n.W[i].noalias() = pose_w * l->J_point;
    n.W_camera.noalias() += camera_w * l->J_point;
    n.V.noalias() += l->J_point.transpose() * l->information.asDiagonal() * l->J_point;
    n.g.noalias() += l->J_point.transpose() * l->information.cwiseProduct(l->residual);
  }
  n.V_inverse = n.V.llt().solve(Eigen::Matrix3d::Identity());
  const Camera3d camera_v = n.W_camera * n.V_inverse;
  reduced.H.block<kCameraParameters, kCameraParameters>(c, c).noalias() -=
      camera_v * n.W_camera.transpose();
  reduced.g.tail<kCameraParameters>().noalias() -= camera_v * n.g;
  for (std::size_t i = 0; i < terms.size(); ++i) {
    const Eigen::Index p = block(terms[i].pose);
    const Matrix63d pose_v = n.W[i] * n.V_inverse;
    reduced.g.segment<6>(p).noalias() -= pose_v * n.g;
    reduced.H.block<kCameraParameters, 6>(c, p).noalias() -= camera_v * n.W[i].transpose();
    for (std::size_t j = 0; j < terms.size(); ++j) {  // the lower triangle
      if (terms[j].pose > terms[i].pose) continue;
      reduced.H.block<6, 6>(p, block(terms[j].pose)).noalias() -= pose_v * n.W[j].transpose();
    }
  }
  return n;
}

/// Returns the information of the prior times `alike_`, which is equivalent to dividing that of the
/// observations by `alike_`.
CameraVector Calibrator::prior_information() const {
  CameraVector sigma;
  sigma << kFocalPrior * given_.fx, kFocalPrior * given_.fy, kCenterPrior * given_.width,
      kCenterPrior * given_.height, kDisparityPrior, kDisparityPrior, kDisparityPrior,
      kDisparityPrior;
  return alike_ * sigma.cwiseAbs2().cwiseInverse();
}

Reduced Calibrator::reduce(const Camera& camera, std::vector<PointNormals>& points) const {
  const Eigen::Index size = camera_block() + kCameraParameters;
  Reduced reduced{Eigen::MatrixXd::Zero(size, size), Eigen::VectorXd::Zero(size)};
  reduced.H.diagonal().array() = kFloor;
  const CameraVector prior = prior_information();
  reduced.H.diagonal().tail<kCameraParameters>() = prior;
  reduced.g.tail<kCameraParameters>() = prior.cwiseProduct(correction_);
  points.clear();
  for (std::size_t i = 0; i < points_.size(); ++i) points.push_back(eliminate(i, camera, reduced));
  // The fixed pose gets no step.
  const Eigen::Index f = block(fixed_);
  reduced.H.middleRows<6>(f).setZero();
  reduced.H.middleCols<6>(f).setZero();
  reduced.H.block<6, 6>(f, f).setIdentity();
  reduced.g.segment<6>(f).setZero();
  return reduced;
}

/// Moves all variables by one Gauss-Newton step. Returns the largest change of a parameter
/// [standard deviations of its prior].
double Calibrator::step() {
  const Camera camera = corrected();
  std::vector<PointNormals> normals;
  const Reduced reduced = reduce(camera, normals);
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(reduced.H);
  if (factor.info() != Eigen::Success) return 0;
  const Eigen::VectorXd x = factor.solve(-reduced.g);
  if (!x.allFinite()) return 0;
  const CameraVector change = x.tail<kCameraParameters>();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Eigen::Vector3d right = -normals[i].g - normals[i].W_camera.transpose() * change;
    for (std::size_t k = 0; k < terms_[i].size(); ++k)
      right -= normals[i].W[k].transpose() * x.segment<6>(block(terms_[i][k].pose));
    points_[i] += normals[i].V_inverse * right;
  }
  for (std::uint32_t pose = 0; pose < poses(); ++pose)
    T_camera_world_[pose] = Pose::exp(x.segment<6>(block(pose))) * T_camera_world_[pose];
  correction_ += change;
  return change.cwiseAbs().cwiseProduct(prior_information().cwiseSqrt()).maxCoeff();
}

/// Returns the mean squared residual of the observations, weighted as in the normal equations, over
/// that expected [1].
double Calibrator::residual_variance(const Camera& camera) const {
  double squares = 0, expected = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    for (const Term& term : terms_[i]) {
      const auto l = linear(term, i, camera);
      if (!l) continue;
      const Measurement& m = term.measurement;
      squares += l->information.dot(l->residual.cwiseAbs2());
      expected += 2 * l->information.x() / m.pixel_information;
      if (m.has_depth()) expected += l->information.z() / m.disparity_information;
    }
    expected -= 3;
  }
  expected -= 6.0 * static_cast<double>(poses());
  return expected > 0 ? squares / expected : 1;
}

/// Returns the covariance of the parameters that follows from the influence of each group of poses
/// on them.
/// @param gain the camera's rows of the inverse of the reduced Hessian
CameraMatrix Calibrator::jackknife(const Camera& camera, const std::vector<PointNormals>& points,
                                   const CameraGain& gain) const {
  const std::size_t groups = std::min(kGroups, poses());
  std::vector<CameraVector> influence(groups, CameraVector::Zero());
  const CameraMatrix camera_gain = gain.rightCols<kCameraParameters>();
  for (std::size_t i = 0; i < points_.size(); ++i) {
    Camera3d point_gain = camera_gain * points[i].W_camera;
    for (std::size_t k = 0; k < terms_[i].size(); ++k)
      point_gain += gain.middleCols<6>(block(terms_[i][k].pose)) * points[i].W[k];
    point_gain *= points[i].V_inverse;
    for (const Term& term : terms_[i]) {
      const auto l = linear(term, i, camera);
      if (!l) continue;
      const Eigen::Vector3d e = l->information.cwiseProduct(l->residual);
      influence[term.pose * groups / poses()] +=
          gain.middleCols<6>(block(term.pose)) * (l->J_pose.transpose() * e) +
          camera_gain * (l->J_camera.transpose() * e) - point_gain * (l->J_point.transpose() * e);
    }
  }
  CameraVector mean = CameraVector::Zero();
  for (const CameraVector& v : influence) mean += v / static_cast<double>(groups);
  CameraMatrix covariance = CameraMatrix::Zero();
  for (const CameraVector& v : influence) covariance += (v - mean) * (v - mean).transpose();
  const auto n = static_cast<double>(groups);
  return covariance * (n > 1 ? n / (n - 1) : 1);
}

void Calibrator::solve() {
  for (int i = 0; i < kIterations && step() > kConverged; ++i) {
  }
}

/// Returns the variances of the parameters; none if the system cannot be solved.
std::optional<Calibrator::Variances> Calibrator::variances() const {
  const Camera camera = corrected();
  std::vector<PointNormals> normals;
  const Reduced reduced = reduce(camera, normals);
  const Eigen::LLT<Eigen::MatrixXd, Eigen::Lower> factor(reduced.H);
  if (factor.info() != Eigen::Success || !correction_.allFinite()) return std::nullopt;
  Eigen::MatrixXd unit = Eigen::MatrixXd::Zero(reduced.H.rows(), kCameraParameters);
  unit.bottomRows<kCameraParameters>().setIdentity();
  CameraGain gain = factor.solve(unit).transpose();
  const CameraVector hessian = alike_ * gain.rightCols<kCameraParameters>().diagonal() *
                               std::max(1.0, residual_variance(camera));
  gain.middleCols<6>(block(fixed_)).setZero();
  return Variances{hessian, jackknife(camera, normals, gain).diagonal()};
}

CameraCalibration Calibrator::run(AlikeErrors alike) {
  CameraCalibration result;
  result.observations = observations_;
  result.variance_before = residual_variance(corrected());
  result.sigma = std::sqrt(alike_) * prior_information().cwiseSqrt().cwiseInverse();
  solve();
  auto found = variances();
  if (found && alike == AlikeErrors::kMeasured) {
    const CameraVector ratio = kAlike * found->groups.cwiseQuotient(found->hessian);
    alike_ *= std::max(1.0, ratio.maxCoeff());
    solve();
    found = variances();
  }
  if (!found) return result;
  result.correction = correction_;
  result.sigma = found->hessian.cwiseMax(found->groups).cwiseSqrt();
  result.variance_after = residual_variance(corrected());
  return result;
}

}  // namespace

CameraCalibration calibrate_camera(const BundleProblem& problem, AlikeErrors alike) {
  const TraceScope scope("camera calibration");
  if (problem.T_world_camera.empty()) return {};
  return Calibrator(problem).run(alike);
}

bool is_wrong_intrinsic(double correction, double sigma, double focal_length) {
  return std::abs(correction) > std::max(kWrong * focal_length, kCertain * sigma);
}

bool is_wrong_focal_length(const Camera& given, const CameraCalibration& found,
                           CameraParameter focal) {
  return is_wrong_intrinsic(found.correction(focal), found.sigma(focal),
                            focal == kFx ? given.fx : given.fy);
}

bool shows_distances(const CameraCalibration& found) {
  constexpr double kLeastBow = -0.03;  // [1/m]
  return found.correction(kDisparityBow) <
         std::min(kLeastBow, -kCertain * found.sigma(kDisparityBow));
}

}  // namespace stillmap
