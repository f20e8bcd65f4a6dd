// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/bundle_solver.hpp"
#include "stillmap/optimize/reduced_system.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

namespace stillmap {
namespace {

/// Maximum number of free poses for which the reduced camera system is solved dense.
constexpr std::uint32_t kDensePoses = 40;
constexpr std::int32_t kFixed = -1;

using Matrix63d = Eigen::Matrix<double, 6, 3>;

/// Levenberg-Marquardt damping (Marquardt 1963): a diagonal d becomes d + lambda (d + kFloor).
struct Damping {
  double lambda = 1e-6;
  static constexpr double kFloor = 1e-3;  // Damping of unconstrained variables [1/m^2, 1/rad^2].
  double of(double d) const { return d + lambda * (d + kFloor); }
  void relax() { lambda = std::max(lambda * 0.1, 1e-8); }
  void tighten() { lambda *= 10; }
  bool hopeless() const { return lambda > 1e8; }
};

/// Block (pose, point) of the normal equations.
struct Coupling {
  std::int32_t slot;  // of the free pose
  Matrix63d W;
};

/// A point with its terms and couplings. A fixed point has no couplings, V or g.
struct PointPart {
  std::uint32_t point;
  bool free;
  std::uint32_t first_term, last_term;
  std::uint32_t first_coupling, last_coupling;
  Eigen::Matrix3d V = Eigen::Matrix3d::Zero();          // Diagonal block of H.
  Eigen::Vector3d g = Eigen::Vector3d::Zero();          // Part of the gradient.
  Eigen::Matrix3d V_inverse = Eigen::Matrix3d::Zero();  // Inverse of the damped V.
};

Eigen::Matrix3d information_of(const PointNormal<double>& n) {
  Eigen::Matrix3d M;
  M << n.xx, 0, n.xz, 0, n.yy, n.yz, n.xz, n.yz, n.zz;
  return M;
}

struct Step {
  std::vector<Vector6d> poses;          // per slot
  std::vector<Eigen::Vector3d> points;  // per part; zero where fixed
};

/// Normal equations of a pass, point by point: terms, couplings and parts are stored in reading
/// order.
class SchurSolver {
 public:
  SchurSolver(const BundleModel& model, const Kernels& kernels, BundleState& state);
  PassSummary minimize(const PassLimits& limits, const StopRequest& stop);

 private:
  void lay_out();
  std::vector<ReducedSystem::Block> coupled_poses() const;
  double cost(const BundleState& state) const;
  void linearize();
  void linearize(PointPart& part, const std::vector<Eigen::Matrix3d>& R,
                 std::vector<PoseNormalSum<double>>& sums);
  std::optional<Step> solve(const Damping& damping);
  void eliminate(PointPart& part, const Damping& damping, Eigen::VectorXd& rhs);
  BundleState moved(const Step& step) const;

  const BundleModel& model_;
  const Kernels& kernels_;
  BundleState& state_;
  std::vector<BundleTerm> terms_;          // terms in use
  std::vector<std::int32_t> slot_;         // slot of each pose, or kFixed
  std::vector<std::uint32_t> free_poses_;  // pose of each slot
  std::vector<PointPart> parts_;
  std::vector<Coupling> couplings_;
  std::vector<PoseNormal> U_;  // per slot
  std::optional<ReducedSystem> reduced_;
};

SchurSolver::SchurSolver(const BundleModel& model, const Kernels& kernels, BundleState& state)
    : model_(model), kernels_(kernels), state_(state), slot_(model.pose_free.size(), kFixed) {
  for (std::uint32_t i = 0; i < model.pose_free.size(); ++i) {
    if (!model.pose_free[i]) continue;
    slot_[i] = static_cast<std::int32_t>(free_poses_.size());
    free_poses_.push_back(i);
  }
  lay_out();
  const auto poses = static_cast<std::uint32_t>(free_poses_.size());
  const bool dense = poses <= kDensePoses;
  reduced_.emplace(poses, dense ? std::vector<ReducedSystem::Block>{} : coupled_poses(), dense);
}

/// Groups the terms by point and creates one coupling per pair of free point and free pose.
void SchurSolver::lay_out() {
  for (const BundleTerm& term : model_.terms) {
    const bool free = model_.point_free[term.point] != 0;
    const std::int32_t slot = slot_[term.pose];
    if (!term.parts.pixel || (!free && slot == kFixed)) continue;
    const auto index = static_cast<std::uint32_t>(terms_.size());
    const auto coupling = static_cast<std::uint32_t>(couplings_.size());
    if (parts_.empty() || parts_.back().point != term.point) {
      parts_.push_back({.point = term.point,
                        .free = free,
                        .first_term = index,
                        .last_term = index,
                        .first_coupling = coupling,
                        .last_coupling = coupling});
    }
    PointPart& part = parts_.back();
    const bool known = part.first_coupling < coupling && couplings_.back().slot == slot;
    if (free && slot != kFixed && !known) couplings_.push_back({slot, Matrix63d::Zero()});
    terms_.push_back(term);
    part.last_term = static_cast<std::uint32_t>(terms_.size());
    part.last_coupling = static_cast<std::uint32_t>(couplings_.size());
  }
}

/// Returns the pairs of poses that observe a common point, which are coupled in the reduced system.
std::vector<ReducedSystem::Block> SchurSolver::coupled_poses() const {
  std::vector<ReducedSystem::Block> blocks;
  for (const PointPart& part : parts_) {
    for (auto a = part.first_coupling; a < part.last_coupling; ++a) {
      for (auto b = part.first_coupling; b < a; ++b) {
        blocks.emplace_back(couplings_[a].slot, couplings_[b].slot);
      }
    }
  }
  std::ranges::sort(blocks, {}, [](const auto& b) { return std::pair(b.second, b.first); });
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

double SchurSolver::cost(const BundleState& state) const {
  double sum = 0;
  for (const BundleTerm& term : terms_) {
    sum += observation_cost(model_.camera, term.measurement, term.parts, term.weight, kernels_,
                            state.T_camera_world[term.pose] * state.points[term.point]);
  }
  return sum;
}

void SchurSolver::linearize() {
  std::vector<Eigen::Matrix3d> R;
  R.reserve(state_.T_camera_world.size());
  for (const Pose& pose : state_.T_camera_world) R.push_back(pose.rotation());
  std::vector<PoseNormalSum<double>> sums(free_poses_.size());
  for (PointPart& part : parts_) linearize(part, R, sums);
  U_.clear();
  for (const PoseNormalSum<double>& sum : sums) U_.push_back(sum.equations());
}

void SchurSolver::linearize(PointPart& part, const std::vector<Eigen::Matrix3d>& R,
                            std::vector<PoseNormalSum<double>>& sums) {
  part.V.setZero();
  part.g.setZero();
  for (auto i = part.first_coupling; i < part.last_coupling; ++i) couplings_[i].W.setZero();
  auto coupling = part.first_coupling;
  for (auto i = part.first_term; i < part.last_term; ++i) {
    const BundleTerm& term = terms_[i];
    const Eigen::Matrix3d& R_camera_world = R[term.pose];
    const Eigen::Vector3d p =
        R_camera_world * state_.points[part.point] + state_.T_camera_world[term.pose].translation();
    const PointNormal<double> n =
        p.z() < kNearPlane
            ? behind_camera(term.weight)
            : point_normal(model_.camera, observed(term.measurement, term.parts, term.weight),
                           kernels_, p.x(), p.y(), p.z());
    const std::int32_t slot = slot_[term.pose];
    if (slot != kFixed) sums[static_cast<std::size_t>(slot)].add(p.x(), p.y(), p.z(), n);
    if (!part.free) continue;
    const Eigen::Matrix3d MR = information_of(n) * R_camera_world;
    part.V.noalias() += R_camera_world.transpose() * MR;
    part.g.noalias() += R_camera_world.transpose() * Eigen::Vector3d(n.rx, n.ry, n.rz);
    if (slot == kFixed) continue;
    if (couplings_[coupling].slot != slot) ++coupling;  // both sorted by pose
    couplings_[coupling].W.topRows<3>() += MR;
    couplings_[coupling].W.bottomRows<3>().noalias() += skew(p) * MR;
  }
}

/// Eliminates the point: S -= W V^-1 W^T, rhs += W V^-1 g.
void SchurSolver::eliminate(PointPart& part, const Damping& damping, Eigen::VectorXd& rhs) {
  Eigen::Matrix3d V = part.V;
  for (int i = 0; i < 3; ++i) V(i, i) = damping.of(V(i, i));
  part.V_inverse = V.llt().solve(Eigen::Matrix3d::Identity());
  for (auto a = part.first_coupling; a < part.last_coupling; ++a) {
    const auto row = static_cast<std::uint32_t>(couplings_[a].slot);
    const Matrix63d WV = couplings_[a].W * part.V_inverse;
    rhs.segment<6>(6 * row).noalias() += WV * part.g;
    for (auto b = part.first_coupling; b <= a; ++b) {
      reduced_->add(row, static_cast<std::uint32_t>(couplings_[b].slot),
                    -WV * couplings_[b].W.transpose());
    }
  }
}

std::optional<Step> SchurSolver::solve(const Damping& damping) {
  const auto poses = static_cast<std::uint32_t>(free_poses_.size());
  Eigen::VectorXd rhs(6 * poses);
  reduced_->set_zero();
  for (std::uint32_t slot = 0; slot < poses; ++slot) {
    Matrix6d U = U_[slot].H;
    for (int i = 0; i < 6; ++i) U(i, i) = damping.of(U(i, i));
    reduced_->add(slot, slot, U);
    rhs.segment<6>(6 * slot) = -U_[slot].g;
  }
  for (PointPart& part : parts_) {
    if (part.free) eliminate(part, damping, rhs);
  }
  Step step;
  if (poses > 0) {
    const auto x = reduced_->solve(rhs);
    if (!x || !x->allFinite()) return std::nullopt;
    for (std::uint32_t slot = 0; slot < poses; ++slot)
      step.poses.emplace_back(x->segment<6>(6 * slot));
  }
  step.points.assign(parts_.size(), Eigen::Vector3d::Zero());
  for (std::size_t i = 0; i < parts_.size(); ++i) {
    const PointPart& part = parts_[i];
    if (!part.free) continue;
    Eigen::Vector3d right = -part.g;
    for (auto c = part.first_coupling; c < part.last_coupling; ++c) {
      right -=
          couplings_[c].W.transpose() * step.poses[static_cast<std::size_t>(couplings_[c].slot)];
    }
    step.points[i] = part.V_inverse * right;
  }
  return step;
}

BundleState SchurSolver::moved(const Step& step) const {
  BundleState state = state_;
  for (std::size_t slot = 0; slot < free_poses_.size(); ++slot) {
    Pose& pose = state.T_camera_world[free_poses_[slot]];
    pose = Pose::exp(step.poses[slot]) * pose;
  }
  for (std::size_t i = 0; i < parts_.size(); ++i) state.points[parts_[i].point] += step.points[i];
  return state;
}

PassSummary SchurSolver::minimize(const PassLimits& limits, const StopRequest& stop) {
  PassSummary summary;
  Damping damping;
  double now = cost(state_);
  bool linearized = false;
  while (summary.iterations < limits.iterations && !damping.hopeless()) {
    if (stop && stop()) {
      summary.interrupted = true;
      break;
    }
    ++summary.iterations;
    if (!linearized) linearize();
    linearized = true;
    const auto step = solve(damping);
    if (!step) {
      damping.tighten();
      continue;
    }
    BundleState trial = moved(*step);
    const double next = cost(trial);
    const bool converged = std::abs(now - next) <= limits.cost_tolerance * now;
    if (next < now) {
      state_ = std::move(trial);
      now = next;
      linearized = false;
      damping.relax();
    } else {
      damping.tighten();
    }
    if (converged) break;
  }
  return summary;
}

}  // namespace

PassSummary minimize_with_schur(const BundleModel& model, const PassLimits& limits,
                                const StopRequest& stop, BundleState& state) {
  return SchurSolver(model, limits.kernels, state).minimize(limits, stop);
}

}  // namespace stillmap
