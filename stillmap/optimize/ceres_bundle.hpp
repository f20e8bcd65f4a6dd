// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/bundle_solver.hpp"
#include "stillmap/optimize/ceres_pose.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <deque>
#include <memory>

#include <ceres/ceres.h>

/// Bundle adjustment by Ceres, for tests and benchmarks only: the reference that our own Schur
/// solver must agree with and be faster than.
namespace stillmap::ceres_bundle {

/// Number of free poses up to which the reduced camera system is solved dense.
inline constexpr std::size_t kDensePoses = 60;

/// Rows [first, first + Rows) of (u, v, d) as a Ceres cost of pose and point, in sigmas. Pixel and
/// disparity are two costs, because each has a kernel of its own.
template <int First, int Rows>
class PartCost final : public ceres::SizedCostFunction<Rows, 7, 3> {
 public:
  PartCost(const Camera& camera, const Eigen::Vector3d& uvd, double information)
      : camera_(camera), uvd_(uvd), scale_(std::sqrt(information)) {}

  bool Evaluate(double const* const* parameters, double* residuals,
                double** jacobians) const override {
    const Eigen::Matrix3d R =
        Eigen::Map<const Eigen::Quaterniond>(parameters[0]).toRotationMatrix();
    const Eigen::Vector3d p = R * Eigen::Map<const Eigen::Vector3d>(parameters[1]) +
                              Eigen::Map<const Eigen::Vector3d>(parameters[0] + 4);
    const bool in_front = p.z() >= kNearPlane;
    Eigen::Map<Eigen::Matrix<double, Rows, 1>> r(residuals);
    r.setConstant(kBehindCameraSigmas);
    if (in_front) r = scale_ * (predict(camera_, p) - uvd_).template segment<Rows>(First);
    if (!jacobians) return true;
    Eigen::Matrix3d A = Eigen::Matrix3d::Zero();
    if (in_front) A = scale_ * projection_jacobian(camera_, p);
    if (jacobians[0]) {
      Eigen::Map<Eigen::Matrix<double, Rows, 7, Eigen::RowMajor>> J(jacobians[0]);
      J.template leftCols<6>() = pose_jacobian(A, p).template middleRows<Rows>(First);
      J.col(6).setZero();
    }
    if (jacobians[1]) {
      Eigen::Map<Eigen::Matrix<double, Rows, 3, Eigen::RowMajor>>{jacobians[1]} =
          point_jacobian(A, R).template middleRows<Rows>(First);
    }
    return true;
  }

 private:
  const Camera& camera_;
  Eigen::Vector3d uvd_;
  double scale_;
};

using PixelCost = PartCost<0, 2>;
using DisparityCost = PartCost<2, 1>;

/// Asks the caller between iterations whether to stop.
class StopCallback final : public ceres::IterationCallback {
 public:
  explicit StopCallback(const StopRequest& stop) : stop_(stop) {}
  bool stopped = false;
  ceres::CallbackReturnType operator()(const ceres::IterationSummary&) override {
    stopped = stop_ && stop_();
    return stopped ? ceres::SOLVER_TERMINATE_SUCCESSFULLY : ceres::SOLVER_CONTINUE;
  }

 private:
  const StopRequest& stop_;
};

inline ceres::Problem::Options borrowing_options() {
  ceres::Problem::Options options;
  options.cost_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.loss_function_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.manifold_ownership = ceres::DO_NOT_TAKE_OWNERSHIP;
  options.disable_all_safety_checks = true;
  return options;
}

/// Huber's kernel, or none for plain least squares.
inline std::unique_ptr<ceres::LossFunction> make_loss(const HuberKernel& kernel, bool robust) {
  if (!robust) return nullptr;
  return std::make_unique<ceres::HuberLoss>(std::sqrt(kernel.bound));
}

/// One pass as a Ceres problem; owns all parameter blocks and cost functions.
class CeresBundle {
 public:
  CeresBundle(const BundleModel& model, const Kernels& kernels, BundleState& state)
      : model_(model),
        state_(state),
        pixel_loss_(make_loss(kernels.pixel, kernels.robust)),
        disparity_loss_(make_loss(kernels.disparity, kernels.robust)),
        ceres_(borrowing_options()) {
    for (const Pose& pose : state.T_camera_world) poses_.push_back(to_block(pose));
    for (const BundleTerm& term : model.terms) {
      if (term.parts.pixel) add(term);
    }
    hold_and_order();
  }

  void solve(ceres::Solver::Options options, ceres::Solver::Summary& summary) {
    options.linear_solver_ordering = ordering_;
    options.linear_solver_type =
        free_poses_ <= kDensePoses ? ceres::DENSE_SCHUR : ceres::SPARSE_SCHUR;
    ceres::Solve(options, &ceres_, &summary);
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      if (model_.pose_free[i]) state_.T_camera_world[i] = to_pose(poses_[i].data());
    }
  }

 private:
  void add(const BundleTerm& term) {
    const Measurement& m = term.measurement;
    double* pose = poses_[term.pose].data();
    double* point = state_.points[term.point].data();
    auto& pixel = pixel_costs_.emplace_back(model_.camera, m.uvd, m.pixel_information);
    ceres_.AddResidualBlock(&pixel, weighted(pixel_loss_, term.weight), pose, point);
    if (!term.parts.disparity) return;
    auto& disparity = disparity_costs_.emplace_back(model_.camera, m.uvd, m.disparity_information);
    ceres_.AddResidualBlock(&disparity, weighted(disparity_loss_, term.weight), pose, point);
  }

  /// The static probability goes outside the kernel: rho(|e|^2) times weight.
  ceres::LossFunction* weighted(const std::unique_ptr<ceres::LossFunction>& loss, double weight) {
    if (weight == 1) return loss.get();
    return &weighted_losses_.emplace_back(loss.get(), weight, ceres::DO_NOT_TAKE_OWNERSHIP);
  }

  void hold_and_order() {
    for (std::size_t i = 0; i < state_.points.size(); ++i) {
      double* block = state_.points[i].data();
      if (!ceres_.HasParameterBlock(block)) continue;
      ordering_->AddElementToGroup(block, 0);
      if (!model_.point_free[i]) ceres_.SetParameterBlockConstant(block);
    }
    for (std::size_t i = 0; i < poses_.size(); ++i) {
      double* block = poses_[i].data();
      if (!ceres_.HasParameterBlock(block)) continue;
      ordering_->AddElementToGroup(block, 1);
      free_poses_ += model_.pose_free[i];
      ceres_.SetManifold(block, &manifold_);
      if (!model_.pose_free[i]) ceres_.SetParameterBlockConstant(block);
    }
  }

  const BundleModel& model_;
  BundleState& state_;
  PoseManifold manifold_;
  std::vector<PoseBlock> poses_;
  std::unique_ptr<ceres::LossFunction> pixel_loss_, disparity_loss_;
  std::deque<ceres::ScaledLoss> weighted_losses_;  // Ceres keeps pointers: nothing may move
  std::deque<PixelCost> pixel_costs_;
  std::deque<DisparityCost> disparity_costs_;
  std::shared_ptr<ceres::ParameterBlockOrdering> ordering_ =
      std::make_shared<ceres::ParameterBlockOrdering>();
  std::size_t free_poses_ = 0;
  ceres::Problem ceres_;  // last: it points into the others
};

/// Minimizes one pass with Ceres, on one thread.
inline PassSummary minimize(const BundleModel& model, const PassLimits& limits,
                            const StopRequest& stop, BundleState& state) {
  StopCallback callback(stop);
  ceres::Solver::Options options;
  // Eigen's own algebra: the system's BLAS may be threaded, and then sums depend on the machine.
  options.dense_linear_algebra_library_type = ceres::EIGEN;
  options.sparse_linear_algebra_library_type = ceres::EIGEN_SPARSE;
  options.num_threads = 1;
  options.max_num_iterations = limits.iterations;
  options.function_tolerance = limits.cost_tolerance;
  options.initial_trust_region_radius = 1e6;
  options.jacobi_scaling = false;
  options.logging_type = ceres::SILENT;
  options.callbacks.push_back(&callback);
  ceres::Solver::Summary summary;
  CeresBundle(model, limits.kernels, state).solve(options, summary);
  return {std::max(0, static_cast<int>(summary.iterations.size()) - 1), callback.stopped};
}

}  // namespace stillmap::ceres_bundle
