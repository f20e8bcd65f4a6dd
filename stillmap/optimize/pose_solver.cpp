// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_solver.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/optimize/normal_equations.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace stillmap {
namespace {

/// Number of rounds with Huber kernels; inliers are selected again after each.
constexpr int kRobustRounds = 2;
/// Number of following rounds of plain least squares on the inliers.
constexpr int kPlainRounds = 2;
/// Maximum number of iterations per round.
constexpr int kIterations = 10;
/// A round ends when a step |(v, w)| falls below this [m, rad]. The remaining error is of the order
/// of the step squared.
constexpr double kStepTolerance = 1e-5;
/// Factor of kStepTolerance in a robust round, which only separates inliers from outliers.
constexpr double kRobustStepFactor = 10;
/// Minimum number of inliers of a well-posed solution.
constexpr int kMinInliers = 6;
/// Maximum predicted standard deviation in the worst direction of a well-posed solution [m].
constexpr double kMaxTranslationSigma = 0.1;
/// Maximum predicted standard deviation about the worst axis of a well-posed solution [rad].
constexpr double kMaxRotationSigma = 0.05;

/// Two usable observations. The second lane of an odd last one is empty: information and weight 0,
/// never used.
struct Term {
  Pair x = Pair::Ones(), y = Pair::Ones(), z = Pair::Ones();  // p_world
  Pair u = Pair::Zero(), v = Pair::Zero(), d = Pair::Zero();
  Pair pixel_information = Pair::Zero(), disparity_information = Pair::Zero();
  Pair weight = Pair::Zero();
  Pair use_pixel = Pair::Zero(), use_disparity = Pair::Zero();  // 1 for the parts in use, else 0.
  std::array<std::uint32_t, 2> observation = {0, 0};            // Indices into the caller's list.

  Observed<Pair> observed() const {
    return {u,
            v,
            d,
            use_pixel * pixel_information,
            use_disparity * disparity_information,
            use_pixel * weight};
  }
};

void fill(const PoseObservation& o, const Measurement& m, std::uint32_t index, std::size_t lane,
          Term& term) {
  const auto i = static_cast<Eigen::Index>(lane);
  term.x(i) = o.p_world.x(), term.y(i) = o.p_world.y(), term.z(i) = o.p_world.z();
  term.u(i) = m.uvd.x(), term.v(i) = m.uvd.y(), term.d(i) = m.uvd.z();
  term.pixel_information(i) = m.pixel_information;
  term.disparity_information(i) = m.disparity_information;
  term.weight(i) = o.weight;
  term.use_pixel(i) = 1;
  term.use_disparity(i) = m.has_depth() ? 1 : 0;
  term.observation[lane] = index;
}

std::vector<Term> usable_terms(const Camera& camera,
                               std::span<const PoseObservation> observations) {
  std::vector<Term> terms;
  terms.reserve(observations.size() / 2 + 1);
  std::size_t lane = 0;
  for (std::uint32_t i = 0; i < observations.size(); ++i) {
    const PoseObservation& o = observations[i];
    const Measurement m =
        make_measurement(camera, observation_noise(camera, o.depth), o.u, o.v, o.depth, o.scale);
    const bool usable =
        m.usable() && o.weight > 0 && std::isfinite(o.weight) && is_plausible_point(o.p_world);
    if (!usable) continue;
    if (lane == 0) terms.emplace_back();
    fill(o, m, i, lane, terms.back());
    lane = 1 - lane;
  }
  return terms;
}

/// Two points in the camera frame.
struct PairInCamera {
  Pair x, y, z;

  PairInCamera(const Eigen::Matrix3d& R, const Eigen::Vector3d& t, const Term& w)
      : x(R(0, 0) * w.x + R(0, 1) * w.y + R(0, 2) * w.z + t.x()),
        y(R(1, 0) * w.x + R(1, 1) * w.y + R(1, 2) * w.z + t.y()),
        z(R(2, 0) * w.x + R(2, 1) * w.y + R(2, 2) * w.z + t.z()) {}
};

/// Returns the normal equations of one observation of a pair, which may be behind the camera.
PointNormal<double> lane_normal(const Camera& camera, const Observed<Pair>& o,
                                const Kernels& kernels, const PairInCamera& p, Eigen::Index i) {
  if (p.z(i) < kNearPlane) return behind_camera(o.weight(i));
  const Observed<double> lane = {
      o.u(i), o.v(i), o.d(i), o.pixel_information(i), o.disparity_information(i), o.weight(i)};
  return point_normal(camera, lane, kernels, p.x(i), p.y(i), p.z(i));
}

/// Returns the normal equations of a prior, whose residual is log(T_prior^-1 T_world_camera). A
/// left perturbation xi of T_camera_world changes it by -xi, to first order in the residual.
PoseNormal prior_normal(const PosePrior& prior, const Pose& T_camera_world) {
  const Vector6d residual = -(T_camera_world * prior.T_world_camera).log();
  return {prior.information, -prior.information * residual,
          residual.dot(prior.information * residual)};
}

PoseNormal linearize(const Camera& camera, const Pose& T_camera_world, std::span<const Term> terms,
                     const Kernels& kernels, const std::optional<PosePrior>& prior) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d& t = T_camera_world.translation();
  PoseNormalSum<Pair> pairs;
  PoseNormalSum<double> singles;
  for (const Term& term : terms) {
    const PairInCamera p(R, t, term);
    const Observed<Pair> o = term.observed();
    if (p.z.minCoeff() >= kNearPlane) {
      pairs.add(p.x, p.y, p.z, point_normal(camera, o, kernels, p.x, p.y, p.z));
      continue;
    }
    for (Eigen::Index i = 0; i < 2; ++i) {
      singles.add(p.x(i), p.y(i), p.z(i), lane_normal(camera, o, kernels, p, i));
    }
  }
  PoseNormal sum = pairs.equations();
  sum += singles.equations();
  if (prior) sum += prior_normal(*prior, T_camera_world);
  return sum;
}

/// Levenberg-Marquardt on T_camera_world (Marquardt 1963, scaled by the diagonal of H). Returns the
/// number of linear systems solved.
int minimize(const Camera& camera, std::span<const Term> terms, const Kernels& kernels,
             const std::optional<PosePrior>& prior, Pose& T_camera_world) {
  const double step_tolerance = (kernels.robust ? kRobustStepFactor : 1) * kStepTolerance;
  double lambda = 1e-7;
  PoseNormal now = linearize(camera, T_camera_world, terms, kernels, prior);
  int iteration = 0;
  while (iteration < kIterations) {
    ++iteration;
    Matrix6d H = now.H;
    H.diagonal() *= 1 + lambda;
    H.diagonal().array() += std::numeric_limits<double>::min();
    const Vector6d xi = -H.ldlt().solve(now.g);
    if (!xi.allFinite()) break;
    const Pose trial = Pose::exp(xi) * T_camera_world;
    const PoseNormal next = linearize(camera, trial, terms, kernels, prior);
    // Rounding can raise the cost of a vanishing step.
    const bool better = next.cost <= now.cost * (1 + 1e-12);
    if (better) {
      T_camera_world = trial;
      now = next;
      lambda = std::max(lambda * 0.1, 1e-9);
    } else {
      lambda = std::max(lambda * 100, 1e-4);
    }
    if (xi.norm() < step_tolerance) break;
  }
  return iteration;
}

/// Squared residuals of two observations [sigma^2]; infinite behind the camera.
struct PairChi2 {
  Pair pixel, disparity;

  PairChi2(const Camera& camera, const PairInCamera& p, const Term& term) {
    const Pair iz = 1.0 / p.z;
    const Pair eu = camera.fx * p.x * iz + camera.cx - term.u;
    const Pair ev = camera.fy * p.y * iz + camera.cy - term.v;
    const Pair ed = camera.bf() * iz - term.d;
    pixel = term.pixel_information * (eu * eu + ev * ev);
    disparity = term.disparity_information * ed * ed;
    for (Eigen::Index i = 0; i < 2; ++i) {
      if (!(p.z(i) >= kNearPlane)) pixel(i) = std::numeric_limits<double>::infinity();
    }
  }
};

/// Selects the inliers at T_camera_world. Returns whether the selection changed.
bool classify(const Camera& camera, const Pose& T_camera_world, std::span<Term> terms) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d& t = T_camera_world.translation();
  bool changed = false;
  for (Term& term : terms) {
    const PairChi2 s(camera, PairInCamera(R, t, term), term);
    for (Eigen::Index i = 0; i < 2; ++i) {
      const bool pixel = term.pixel_information(i) > 0 && s.pixel(i) <= kPixelChi2;
      const bool disparity =
          pixel && term.disparity_information(i) > 0 && s.disparity(i) <= kDisparityChi2;
      changed |= pixel != (term.use_pixel(i) > 0) || disparity != (term.use_disparity(i) > 0);
      term.use_pixel(i) = pixel ? 1 : 0;
      term.use_disparity(i) = disparity ? 1 : 0;
    }
  }
  return changed;
}

/// Returns whether the largest standard deviation of a 3x3 covariance block is within `bound`.
bool within(const Eigen::Matrix3d& covariance, double bound) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().z() <= bound * bound;
}

bool well_posed(const PoseSolution& solution) {
  if (solution.inliers < kMinInliers || !solution.information.allFinite()) return false;
  const Eigen::LDLT<Matrix6d> ldlt(solution.information);
  if (!ldlt.isPositive() || ldlt.rcond() < 1e-14) return false;
  const Matrix6d covariance = ldlt.solve(Matrix6d::Identity());
  return within(covariance.topLeftCorner<3, 3>(), kMaxTranslationSigma) &&
         within(covariance.bottomRightCorner<3, 3>(), kMaxRotationSigma);
}

/// Sets the inlier flags, counts and quality measures of the final pose.
void describe(const Camera& camera, const Pose& T_camera_world, std::span<const Term> terms,
              const std::optional<PosePrior>& prior, PoseSolution& solution) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d& t = T_camera_world.translation();
  double sum = 0;
  for (const Term& term : terms) {
    const PairChi2 s(camera, PairInCamera(R, t, term), term);
    for (std::size_t lane = 0; lane < 2; ++lane) {
      const auto i = static_cast<Eigen::Index>(lane);
      if (term.use_pixel(i) == 0) continue;
      const bool disparity = term.use_disparity(i) > 0;
      sum += s.pixel(i) + (disparity ? s.disparity(i) : 0);
      solution.inlier[term.observation[lane]] = 1;
      solution.depth_inlier[term.observation[lane]] = disparity;
      ++solution.inliers;
      solution.depth_inliers += disparity;
    }
  }
  const int components = 2 * solution.inliers + solution.depth_inliers;
  solution.rms = components > 0 ? std::sqrt(sum / components) : 0;
  solution.information =
      linearize(camera, T_camera_world, terms, Kernels{.robust = false}, prior).H;
  solution.well_posed = well_posed(solution);
}

bool finite(const Pose& pose) {
  return pose.translation().allFinite() && pose.quaternion().coeffs().allFinite();
}

}  // namespace

PoseSolution solve_pose(const Camera& camera, const Pose& T_world_camera_guess,
                        std::span<const PoseObservation> observations,
                        const std::optional<PosePrior>& prior) {
  const TraceScope scope("solve");
  PoseSolution solution;
  solution.T_world_camera = T_world_camera_guess;
  solution.inlier.assign(observations.size(), 0);
  solution.depth_inlier.assign(observations.size(), 0);
  if (!finite(T_world_camera_guess)) return solution;

  std::vector<Term> terms = usable_terms(camera, observations);
  if (terms.empty()) return solution;
  Pose T_camera_world = T_world_camera_guess.inverse();
  Kernels kernels{{kPixelChi2}, {kDisparityChi2}};
  for (int round = 0; round < kRobustRounds + kPlainRounds; ++round) {
    kernels.robust = round < kRobustRounds;
    solution.iterations += minimize(camera, terms, kernels, prior, T_camera_world);
    const bool changed = classify(camera, T_camera_world, terms);
    if (!kernels.robust && !changed) break;
  }
  if (!finite(T_camera_world)) return solution;
  solution.T_world_camera = T_camera_world.inverse();
  describe(camera, T_camera_world, terms, prior, solution);
  return solution;
}

}  // namespace stillmap
