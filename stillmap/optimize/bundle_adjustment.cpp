// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/bundle_adjustment.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/stopwatch.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>
#include <optional>
#include <string>

#include <ceres/ceres.h>

namespace stillmap {
namespace {

/// Free poses up to which the reduced camera system is solved dense.
constexpr int kDensePoses = 60;

using RowMatrix36d = Eigen::Matrix<double, 3, 6, Eigen::RowMajor>;
using RowMatrix37d = Eigen::Matrix<double, 3, 7, Eigen::RowMajor>;
using RowMatrix3d = Eigen::Matrix<double, 3, 3, Eigen::RowMajor>;

/// A pose as Ceres holds it: T_camera_world as quaternion x y z w and translation.
using PoseBlock = std::array<double, 7>;

PoseBlock to_block(const Pose& T_camera_world) {
  PoseBlock block;
  Eigen::Map<Eigen::Vector4d>{block.data()} = T_camera_world.quaternion().coeffs();
  Eigen::Map<Eigen::Vector3d>{block.data() + 4} = T_camera_world.translation();
  return block;
}

Pose to_pose(const double* block) {
  return {Eigen::Quaterniond(Eigen::Map<const Eigen::Vector4d>(block)),
          Eigen::Map<const Eigen::Vector3d>(block + 4)};
}

/// SE(3) with left perturbations, x + delta = exp(delta) x. Residuals give their derivatives with
/// respect to delta at once, in the first six of the seven columns that Ceres asks for, and so
/// PlusJacobian is [I; 0]: the detour over quaternion derivatives would cost more than the residual
/// itself.
class PoseManifold final : public ceres::Manifold {
 public:
  int AmbientSize() const override { return 7; }
  int TangentSize() const override { return 6; }
  bool Plus(const double* x, const double* delta, double* x_plus_delta) const override {
    const PoseBlock sum = to_block(Pose::exp(Eigen::Map<const Vector6d>(delta)) * to_pose(x));
    std::copy(sum.begin(), sum.end(), x_plus_delta);
    return true;
  }
  bool PlusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 7, 6, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
  bool Minus(const double* y, const double* x, double* y_minus_x) const override {
    Eigen::Map<Vector6d>{y_minus_x} = (to_pose(y) * to_pose(x).inverse()).log();
    return true;
  }
  bool MinusJacobian(const double*, double* jacobian) const override {
    Eigen::Map<Eigen::Matrix<double, 6, 7, Eigen::RowMajor>>(jacobian).setIdentity();
    return true;
  }
};

/// Which of a pass's observations count, and whether robustly.
struct Kernels {
  HuberKernel pixel, disparity;
  bool robust = true;
};

/// r scaled so that |r|^2 becomes rho, and the factor for J that keeps the gradient: J'^T r' = rho'
/// J^T r.
struct Robustified {
  double residual = 1, jacobian = 1;
};

Robustified robustify(const HuberKernel& kernel, double s) {
  if (s <= kernel.bound) return {};
  const double scale = std::sqrt(kernel.rho(s) / s);
  return {scale, kernel.weight(s) / scale};
}

/// One observation as a Ceres cost: pose (7), point (3) to (u, v, d) in sigmas.
class ObservationCost final : public ceres::SizedCostFunction<3, 7, 3> {
 public:
  ObservationCost(const Camera& camera, const Kernels& kernels, const Measurement& measurement,
                  double weight)
      : camera_(&camera), kernels_(&kernels), measurement_(measurement), weight_(weight) {
    use_disparity = measurement.has_depth();
  }

  bool use_pixel = true, use_disparity = true;
  bool has_depth() const { return measurement_.has_depth(); }

  /// (u, v, d) residuals squared, in sigmas, unweighted; nothing for a point behind the camera.
  std::optional<Chi2> error(const double* pose, const double* point) const {
    const Eigen::Vector3d p = to_pose(pose) * Eigen::Map<const Eigen::Vector3d>(point);
    if (p.z() < kNearPlane) return std::nullopt;
    return chi2(measurement_, predict(*camera_, p));
  }

  double robust_cost(const double* pose, const double* point) const {
    const auto e = error(pose, point);
    if (!e) return 0.5 * weight_ * kBehindCamera * kBehindCamera;
    return 0.5 * weight_ * (kernels_->pixel.rho(e->pixel) + kernels_->disparity.rho(e->disparity));
  }

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Map<const Eigen::Quaterniond> q(parameters[0]);
    const Eigen::Matrix3d R = q.toRotationMatrix();
    const Eigen::Vector3d p = R * Eigen::Map<const Eigen::Vector3d>(parameters[1]) +
                              Eigen::Map<const Eigen::Vector3d>(parameters[0] + 4);
    Eigen::Map<Eigen::Vector3d> r(residuals);
    if (!use_pixel || p.z() < kNearPlane) {
      r << (use_pixel ? kBehindCamera * std::sqrt(weight_) : 0), 0, 0;
      clear(jacobians);
      return true;
    }
    Eigen::Vector3d e = predict(*camera_, p) - measurement_.uvd;
    const Eigen::Vector3d scale = scales(e, r);
    if (!jacobians) return true;
    const Eigen::Matrix3d A = scale.asDiagonal() * projection_jacobian(*camera_, p);
    if (jacobians[0]) {
      Eigen::Map<RowMatrix37d> J(jacobians[0]);
      J.leftCols<6>() = pose_jacobian(A, p);
      J.col(6).setZero();
    }
    if (jacobians[1]) Eigen::Map<RowMatrix3d>{jacobians[1]} = point_jacobian(A, R);
    return true;
  }

 private:
  static constexpr double kBehindCamera = 100;  // sigmas

  /// Writes the robust residuals in sigmas; returns the factors of the Jacobian's rows.
  Eigen::Vector3d scales(const Eigen::Vector3d& e, Eigen::Map<Eigen::Vector3d>& r) const {
    const double pixel = std::sqrt(measurement_.pixel_information * weight_);
    const double disparity =
        use_disparity ? std::sqrt(measurement_.disparity_information * weight_) : 0;
    Robustified robust_pixel, robust_disparity;
    if (kernels_->robust) {
      robust_pixel = robustify(kernels_->pixel,
                               measurement_.pixel_information * (e.x() * e.x() + e.y() * e.y()));
      robust_disparity =
          robustify(kernels_->disparity, measurement_.disparity_information * e.z() * e.z());
    }
    r << robust_pixel.residual * pixel * e.x(), robust_pixel.residual * pixel * e.y(),
        robust_disparity.residual * disparity * e.z();
    return {robust_pixel.jacobian * pixel, robust_pixel.jacobian * pixel,
            robust_disparity.jacobian * disparity};
  }

  static void clear(double** jacobians) {
    if (!jacobians) return;
    if (jacobians[0]) std::fill_n(jacobians[0], 21, 0.0);
    if (jacobians[1]) std::fill_n(jacobians[1], 9, 0.0);
  }

  const Camera* camera_;
  const Kernels* kernels_;
  Measurement measurement_;
  double weight_;
};

void require(bool ok, const std::string& what, const std::string& where) {
  if (!ok) throw Error(what, where, "give one entry each, indices within range, finite numbers");
}

void validate(const BundleProblem& problem) {
  const std::size_t poses = problem.T_world_camera.size(), points = problem.points.size();
  require(problem.pose_fixed.size() == poses, "needs one flag per pose",
          "BundleProblem::pose_fixed");
  require(problem.point_fixed.empty() || problem.point_fixed.size() == points,
          "needs one flag per point, or none at all", "BundleProblem::point_fixed");
  for (const Pose& pose : problem.T_world_camera) {
    require(pose.translation().allFinite() && pose.quaternion().coeffs().allFinite(),
            "a pose is not finite", "BundleProblem::T_world_camera");
  }
  for (const BundleObservation& o : problem.observations) {
    require(o.pose < poses && o.point < points, "an index points past the end",
            "BundleProblem::observations");
  }
  if (std::none_of(problem.pose_fixed.begin(), problem.pose_fixed.end(),
                   [](auto f) { return f; })) {
    throw Error("no pose is fixed, so the world frame is free to drift",
                "BundleProblem::pose_fixed", "fix at least one keyframe");
  }
}

/// Asks the caller whether to stop, between iterations.
class StopCallback final : public ceres::IterationCallback {
 public:
  explicit StopCallback(const StopRequest& stop) : stop_(stop) {}
  bool stopped = false;
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    stopped = stopped || (stop_ && stop_());
    return stopped ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const StopRequest& stop_;
};

/// A bundle problem laid out for Ceres; owns all blocks and costs.
class Bundle {
 public:
  Bundle(const Bundle&) = delete;
  Bundle& operator=(const Bundle&) = delete;
  Bundle(const BundleProblem& problem, const BundleOptions& options)
      : problem_(problem),
        options_(options),
        kernels_{{options.pixel_chi2}, {options.disparity_chi2}, true},
        points_(problem.points),
        ceres_(problem_options()) {
    poses_.reserve(problem.T_world_camera.size());
    for (const Pose& pose : problem.T_world_camera) poses_.push_back(to_block(pose.inverse()));
    add_observations();
    fix_and_order();
  }

  /// One pass; returns the iterations it took.
  int solve(bool robust, int max_iterations, StopCallback& stop) {
    kernels_.robust = robust;
    ceres::Solver::Options options;
    options.minimizer_type = ceres::TRUST_REGION;
    options.trust_region_strategy_type = ceres::LEVENBERG_MARQUARDT;
    options.linear_solver_type =
        free_poses_ <= kDensePoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    // Eigen's own algebra: the system's BLAS may be threaded, and then sums depend on the machine.
    options.dense_linear_algebra_library_type = ceres::EIGEN;
    options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
    options.linear_solver_ordering = ordering_;
    options.num_threads = 1;
    options.max_num_iterations = max_iterations;
    options.function_tolerance = options_.cost_tolerance;
    options.initial_trust_region_radius = 1e6;
    options.jacobi_scaling = false;
    options.logging_type = ceres::SILENT;
    options.callbacks.push_back(&stop);
    ceres::Solver::Summary summary;
    ceres::Solve(options, &ceres_, &summary);
    return static_cast<int>(summary.iterations.size()) - 1;
  }

  bool has_free_parts() const { return free_poses_ + free_points_ > 0; }

  double robust_cost() const {
    double sum = 0;
    for (std::size_t i = 0; i < costs_.size(); ++i)
      sum += costs_[i].robust_cost(pose_of(i), point_of(i));
    return sum;
  }

  /// Leaves out of later passes what does not agree now.
  void classify() {
    for (std::size_t i = 0; i < costs_.size(); ++i) {
      const auto e = costs_[i].error(pose_of(i), point_of(i));
      costs_[i].use_pixel = e && e->pixel <= options_.pixel_chi2;
      costs_[i].use_disparity =
          costs_[i].use_pixel && costs_[i].has_depth() && e->disparity <= options_.disparity_chi2;
    }
  }

  void write(BundleResult& result) const;

 private:
  static ceres::Problem::Options problem_options() {
    ceres::Problem::Options options;
    options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
    options.disable_all_safety_checks = true;
    return options;
  }
  const double* pose_of(std::size_t i) const { return poses_[source_of(i).pose].data(); }
  const double* point_of(std::size_t i) const { return points_[source_of(i).point].data(); }
  const BundleObservation& source_of(std::size_t i) const {
    return problem_.observations[observation_[i]];
  }
  void add_observations();
  void fix_and_order();

  const BundleProblem& problem_;
  const BundleOptions& options_;
  Kernels kernels_;
  PoseManifold manifold_;
  std::vector<PoseBlock> poses_;
  std::vector<Eigen::Vector3d> points_;
  std::deque<ObservationCost> costs_;       // Ceres keeps pointers: nothing may move
  std::vector<std::uint32_t> observation_;  // of each cost, index into the problem's list
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_ =
      std::make_shared<ceres::ParameterBlockOrdering>();
  int free_poses_ = 0, free_points_ = 0;
  ceres::Problem ceres_;  // last: it points into the others
};

void Bundle::add_observations() {
  for (std::uint32_t i = 0; i < problem_.observations.size(); ++i) {
    const BundleObservation& o = problem_.observations[i];
    const Measurement m =
        make_measurement(problem_.camera, options_.noise, o.u, o.v, o.depth, o.scale);
    if (!m.usable() || !(o.weight > 0) || !std::isfinite(o.weight) ||
        !points_[o.point].allFinite()) {
      continue;
    }
    costs_.emplace_back(problem_.camera, kernels_, m, o.weight);
    observation_.push_back(i);
    ceres_.AddResidualBlock(&costs_.back(), nullptr, poses_[o.pose].data(),
                            points_[o.point].data());
  }
}

void Bundle::fix_and_order() {
  for (std::size_t i = 0; i < points_.size(); ++i) {
    double* block = points_[i].data();
    if (!ceres_.HasParameterBlock(block)) continue;
    ordering_->AddElementToGroup(block, 0);
    const bool fixed = !problem_.point_fixed.empty() && problem_.point_fixed[i];
    if (fixed) ceres_.SetParameterBlockConstant(block);
    free_points_ += !fixed;
  }
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    double* block = poses_[i].data();
    if (!ceres_.HasParameterBlock(block)) continue;
    ordering_->AddElementToGroup(block, 1);
    if (problem_.pose_fixed[i]) {
      ceres_.SetParameterBlockConstant(block);
    } else {
      ceres_.SetManifold(block, &manifold_);
      ++free_poses_;
    }
  }
}

void Bundle::write(BundleResult& result) const {
  result.T_world_camera = problem_.T_world_camera;
  for (std::size_t i = 0; i < poses_.size(); ++i) {
    if (!problem_.pose_fixed[i] && ceres_.HasParameterBlock(poses_[i].data())) {
      result.T_world_camera[i] = to_pose(poses_[i].data()).inverse();
    }
  }
  result.points = points_;
  result.pixel_outlier.assign(problem_.observations.size(), 1);
  result.depth_outlier.assign(problem_.observations.size(), 0);
  for (std::size_t i = 0; i < problem_.observations.size(); ++i) {
    const float depth = problem_.observations[i].depth;
    result.depth_outlier[i] = std::isfinite(depth) && depth > 0;
  }
  for (std::size_t i = 0; i < costs_.size(); ++i) {
    result.pixel_outlier[observation_[i]] = !costs_[i].use_pixel;
    result.depth_outlier[observation_[i]] = costs_[i].has_depth() && !costs_[i].use_disparity;
  }
}

}  // namespace

BundleResult adjust_bundle(const BundleProblem& problem, const BundleOptions& options,
                           const StopRequest& stop) {
  validate(problem);
  Stopwatch watch;
  BundleResult result;
  Bundle bundle(problem, options);
  result.cost_before = bundle.robust_cost();
  result.setup_ms = watch.lap();
  StopCallback callback(stop);
  if (bundle.has_free_parts()) {
    result.iterations += bundle.solve(true, options.robust_iterations, callback);
  }
  bundle.classify();
  result.robust_ms = watch.lap();
  if (bundle.has_free_parts() && options.plain_iterations > 0 && !callback.stopped) {
    result.iterations += bundle.solve(false, options.plain_iterations, callback);
    bundle.classify();
  }
  result.cost_after = bundle.robust_cost();
  result.interrupted = callback.stopped;
  bundle.write(result);
  result.plain_ms = watch.lap();
  return result;
}

}  // namespace stillmap
