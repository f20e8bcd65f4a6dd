// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_solver.hpp"

#include "stillmap/optimize/normal_equations.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace stillmap {
namespace {

/// One usable observation, ready for the inner loop.
struct Term {
  Eigen::Vector3d p_world;
  Measurement measurement;
  double weight;
  std::uint32_t observation;  // index into the caller's list
  Parts parts;                // what counts now
};

std::vector<Term> usable_terms(const Camera& camera, std::span<const PoseObservation> observations,
                               const ObservationNoise& noise) {
  std::vector<Term> terms;
  terms.reserve(observations.size());
  for (std::uint32_t i = 0; i < observations.size(); ++i) {
    const PoseObservation& o = observations[i];
    const Measurement m = make_measurement(camera, noise, o.u, o.v, o.depth, o.scale);
    const bool usable =
        m.usable() && o.weight > 0 && std::isfinite(o.weight) && is_plausible_point(o.p_world);
    if (!usable) continue;
    terms.push_back({o.p_world, m, o.weight, i, {true, m.has_depth()}});
  }
  return terms;
}

PoseNormal linearise(const Camera& camera, const Pose& T_camera_world, std::span<const Term> terms,
                     const Kernels& kernels) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d t = T_camera_world.translation();
  PoseNormalSum sum;
  for (const Term& term : terms) {
    if (!term.parts.pixel) continue;
    const Eigen::Vector3d p = R * term.p_world + t;
    sum.add(p, point_normal(camera, term.measurement, term.parts, term.weight, kernels, p));
  }
  return sum.equations();
}

/// Levenberg-Marquardt (Marquardt 1963, with the diagonal of H as scale) from and to
/// T_camera_world. Returns the number of linear systems solved.
int minimise(const Camera& camera, std::span<const Term> terms, const Kernels& kernels,
             const PoseSolverOptions& options, Pose& T_camera_world) {
  double lambda = 1e-7;
  PoseNormal now = linearise(camera, T_camera_world, terms, kernels);
  int iteration = 0;
  while (iteration < options.iterations) {
    ++iteration;
    Matrix6d H = now.H;
    H.diagonal() *= 1 + lambda;
    H.diagonal().array() += std::numeric_limits<double>::min();
    const Vector6d xi = -H.ldlt().solve(now.g);
    if (!xi.allFinite()) break;
    const Pose trial = Pose::exp(xi) * T_camera_world;
    const PoseNormal next = linearise(camera, trial, terms, kernels);
    // Rounding alone may raise the cost of a vanishing step.
    const bool better = next.cost <= now.cost * (1 + 1e-12);
    if (better) {
      T_camera_world = trial;
      now = next;
      lambda = std::max(lambda * 0.1, 1e-9);
    } else {
      lambda = std::max(lambda * 100, 1e-4);
    }
    if (xi.norm() < options.step_tolerance) break;
  }
  return iteration;
}

/// Chooses anew what agrees with T_camera_world. Returns whether anything changed.
bool classify(const Camera& camera, const Pose& T_camera_world, const PoseSolverOptions& options,
              std::span<Term> terms) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d t = T_camera_world.translation();
  bool changed = false;
  for (Term& term : terms) {
    const Parts parts = agreement(camera, term.measurement, R * term.p_world + t,
                                  options.pixel_chi2, options.disparity_chi2);
    changed |= parts != term.parts;
    term.parts = parts;
  }
  return changed;
}

/// Whether the worst standard deviation of a 3x3 covariance block stays within `bound`.
bool within(const Eigen::Matrix3d& covariance, double bound) {
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> eigen(covariance, Eigen::EigenvaluesOnly);
  return eigen.eigenvalues().z() <= bound * bound;
}

bool well_posed(const PoseSolution& solution, const PoseSolverOptions& options) {
  if (solution.inliers < options.min_inliers || !solution.information.allFinite()) return false;
  const Eigen::LDLT<Matrix6d> ldlt(solution.information);
  if (!ldlt.isPositive() || ldlt.rcond() < 1e-14) return false;
  const Matrix6d covariance = ldlt.solve(Matrix6d::Identity());
  return within(covariance.topLeftCorner<3, 3>(), options.max_translation_sigma) &&
         within(covariance.bottomRightCorner<3, 3>(), options.max_rotation_sigma);
}

/// Flags, counts and quality of the final pose.
void describe(const Camera& camera, const Pose& T_camera_world, std::span<const Term> terms,
              const PoseSolverOptions& options, PoseSolution& solution) {
  double sum = 0;
  for (const Term& term : terms) {
    if (!term.parts.pixel) continue;
    const Chi2 c = chi2(term.measurement, predict(camera, T_camera_world * term.p_world));
    sum += c.pixel + (term.parts.disparity ? c.disparity : 0);
    solution.inlier[term.observation] = 1;
    solution.depth_inlier[term.observation] = term.parts.disparity;
    ++solution.inliers;
    solution.depth_inliers += term.parts.disparity;
  }
  const int components = 2 * solution.inliers + solution.depth_inliers;
  solution.rms = components > 0 ? std::sqrt(sum / components) : 0;
  solution.information = linearise(camera, T_camera_world, terms, Kernels{.robust = false}).H;
  solution.well_posed = well_posed(solution, options);
}

bool finite(const Pose& pose) {
  return pose.translation().allFinite() && pose.quaternion().coeffs().allFinite();
}

}  // namespace

PoseSolution solve_pose(const Camera& camera, const Pose& T_world_camera_guess,
                        std::span<const PoseObservation> observations,
                        const PoseSolverOptions& options) {
  PoseSolution solution;
  solution.T_world_camera = T_world_camera_guess;
  solution.inlier.assign(observations.size(), 0);
  solution.depth_inlier.assign(observations.size(), 0);
  if (!finite(T_world_camera_guess)) return solution;

  std::vector<Term> terms = usable_terms(camera, observations, options.noise);
  if (terms.empty()) return solution;
  Pose T_camera_world = T_world_camera_guess.inverse();
  Kernels kernels{{options.pixel_chi2}, {options.disparity_chi2}};
  for (int round = 0; round < options.robust_rounds + options.plain_rounds; ++round) {
    kernels.robust = round < options.robust_rounds;
    solution.iterations += minimise(camera, terms, kernels, options, T_camera_world);
    const bool changed = classify(camera, T_camera_world, options, terms);
    if (!kernels.robust && !changed) break;
  }
  if (!finite(T_camera_world)) return solution;
  solution.T_world_camera = T_camera_world.inverse();
  describe(camera, T_camera_world, terms, options, solution);
  return solution;
}

}  // namespace stillmap
