// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_solver.hpp"

#include <cmath>
#include <limits>

#include <Eigen/Cholesky>
#include <Eigen/Eigenvalues>

namespace stillmap {
namespace {

/// Cost of a point that is (or strays) behind the camera: as much as a residual of this many
/// sigmas.
constexpr double kBehindCameraSigmas = 100;

/// One usable observation, ready for the inner loop.
struct Term {
  Eigen::Vector3d p_world;
  Measurement measurement;
  double weight;
  std::uint32_t observation;  // index into the caller's list
  bool use_pixel = true, use_disparity = true;
};

struct Kernels {
  HuberKernel pixel, disparity;
};

/// Normal equations H xi = -g, and the cost they are the model of.
struct NormalEquations {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0;
};

std::vector<Term> usable_terms(const Camera& camera, std::span<const PoseObservation> observations,
                               const ObservationNoise& noise) {
  std::vector<Term> terms;
  terms.reserve(observations.size());
  for (std::uint32_t i = 0; i < observations.size(); ++i) {
    const PoseObservation& o = observations[i];
    const Measurement m = make_measurement(camera, noise, o.u, o.v, o.depth, o.scale);
    if (!m.usable() || !o.p_world.allFinite() || !(o.weight > 0) || !std::isfinite(o.weight))
      continue;
    terms.push_back({o.p_world, m, o.weight, i, true, m.has_depth()});
  }
  return terms;
}

/// Sums over observations of what H and g are made of. With J = A [I, -[p]x], A the projection
/// Jacobian, and M = A^T W A, H has the blocks M, -M [p]x and [p]x^T M [p]x; A's zeros carry over
/// to M.
struct Accumulator {
  double tt[5] = {};  // M: xx xz yy yz zz
  double tr[9] = {};  // -M [p]x, row by row
  double rr[6] = {};  // [p]x^T M [p]x, upper triangle: xx xy xz yy yz zz
  double g[6] = {};
  double cost = 0;

  NormalEquations equations() const {
    NormalEquations e;
    e.H.topLeftCorner<3, 3>() << tt[0], 0, tt[1], 0, tt[2], tt[3], tt[1], tt[3], tt[4];
    e.H.topRightCorner<3, 3>() << tr[0], tr[1], tr[2], tr[3], tr[4], tr[5], tr[6], tr[7], tr[8];
    e.H.bottomLeftCorner<3, 3>() = e.H.topRightCorner<3, 3>().transpose();
    e.H.bottomRightCorner<3, 3>() << rr[0], rr[1], rr[2], rr[1], rr[3], rr[4], rr[2], rr[4], rr[5];
    e.g << g[0], g[1], g[2], g[3], g[4], g[5];
    e.cost = 0.5 * cost;
    return e;
  }
};

/// Adds one observation at p = p_camera: residuals e, informations w (kernel and weight included).
inline void add(const Camera& c, const Eigen::Vector3d& p, double iz, const Eigen::Vector3d& e,
                double w_pixel, double w_disparity, Accumulator& s) {
  const double x = p.x(), y = p.y(), z = p.z();
  const double au = c.fx * iz, av = c.fy * iz;                                // A: diagonal
  const double bu = -au * x * iz, bv = -av * y * iz, bd = -c.bf() * iz * iz;  // A: last column
  const double wau = w_pixel * au, wav = w_pixel * av;
  const double mxx = wau * au, mxz = wau * bu, myy = wav * av, myz = wav * bv;
  const double mzz = w_pixel * (bu * bu + bv * bv) + w_disparity * bd * bd;
  s.tt[0] += mxx, s.tt[1] += mxz, s.tt[2] += myy, s.tt[3] += myz, s.tt[4] += mzz;
  // N = -M [p]x.
  const double n00 = mxz * y, n01 = mxx * z - mxz * x, n02 = -mxx * y;
  const double n10 = myz * y - myy * z, n11 = -myz * x, n12 = myy * x;
  const double n20 = mzz * y - myz * z, n21 = mxz * z - mzz * x, n22 = myz * x - mxz * y;
  s.tr[0] += n00, s.tr[1] += n01, s.tr[2] += n02;
  s.tr[3] += n10, s.tr[4] += n11, s.tr[5] += n12;
  s.tr[6] += n20, s.tr[7] += n21, s.tr[8] += n22;
  // [p]x N.
  s.rr[0] += y * n20 - z * n10, s.rr[1] += y * n21 - z * n11, s.rr[2] += y * n22 - z * n12;
  s.rr[3] += z * n01 - x * n21, s.rr[4] += z * n02 - x * n22, s.rr[5] += x * n12 - y * n02;
  const double gx = wau * e.x(), gy = wav * e.y();
  const double gz = w_pixel * (bu * e.x() + bv * e.y()) + w_disparity * bd * e.z();
  s.g[0] += gx, s.g[1] += gy, s.g[2] += gz;
  s.g[3] += y * gz - z * gy, s.g[4] += z * gx - x * gz, s.g[5] += x * gy - y * gx;
}

/// Normal equations at T_camera_world over the terms in use; kernels may be null for plain least
/// squares.
NormalEquations linearise(const Camera& camera, const Pose& T_camera_world,
                          std::span<const Term> terms, const Kernels* kernels) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d t = T_camera_world.translation();
  Accumulator sum;
  for (const Term& term : terms) {
    if (!term.use_pixel) continue;
    const Eigen::Vector3d p = R * term.p_world + t;
    if (p.z() < kNearPlane) {
      sum.cost += term.weight * kBehindCameraSigmas * kBehindCameraSigmas;
      continue;
    }
    const double iz = 1.0 / p.z();
    const Measurement& m = term.measurement;
    const Eigen::Vector3d e(camera.fx * p.x() * iz + camera.cx - m.uvd.x(),
                            camera.fy * p.y() * iz + camera.cy - m.uvd.y(),
                            camera.bf() * iz - m.uvd.z());
    double w_pixel = m.pixel_information * term.weight;
    double w_disparity = term.use_disparity ? m.disparity_information * term.weight : 0;
    const double s_pixel = m.pixel_information * (e.x() * e.x() + e.y() * e.y());
    const double s_disparity = term.use_disparity ? m.disparity_information * e.z() * e.z() : 0;
    if (kernels) {
      sum.cost += term.weight * (kernels->pixel.rho(s_pixel) + kernels->disparity.rho(s_disparity));
      w_pixel *= kernels->pixel.weight(s_pixel);
      w_disparity *= kernels->disparity.weight(s_disparity);
    } else {
      sum.cost += term.weight * (s_pixel + s_disparity);
    }
    add(camera, p, iz, e, w_pixel, w_disparity, sum);
  }
  return sum.equations();
}

/// Levenberg-Marquardt (Marquardt 1963, with the diagonal of H as scale) from and to
/// T_camera_world. Returns the number of linear systems solved.
int minimise(const Camera& camera, std::span<const Term> terms, const Kernels* kernels,
             const PoseSolverOptions& options, Pose& T_camera_world) {
  double lambda = 1e-7;
  NormalEquations now = linearise(camera, T_camera_world, terms, kernels);
  int iteration = 0;
  while (iteration < options.iterations) {
    ++iteration;
    Matrix6d H = now.H;
    H.diagonal() *= 1 + lambda;
    H.diagonal().array() += std::numeric_limits<double>::min();
    const Vector6d xi = -H.ldlt().solve(now.g);
    if (!xi.allFinite()) break;
    const Pose trial = Pose::exp(xi) * T_camera_world;
    const NormalEquations next = linearise(camera, trial, terms, kernels);
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

/// Chooses anew which terms, and which depths of them, agree with T_camera_world. Returns whether
/// any changed.
bool classify(const Camera& camera, const Pose& T_camera_world, const PoseSolverOptions& options,
              std::span<Term> terms) {
  const Eigen::Matrix3d R = T_camera_world.rotation();
  const Eigen::Vector3d t = T_camera_world.translation();
  bool changed = false;
  for (Term& term : terms) {
    const Eigen::Vector3d p = R * term.p_world + t;
    const bool in_front = p.z() >= kNearPlane;
    const Chi2 c = in_front ? chi2(term.measurement, predict(camera, p)) : Chi2{};
    const bool pixel = in_front && c.pixel <= options.pixel_chi2;
    const bool disparity =
        pixel && term.measurement.has_depth() && c.disparity <= options.disparity_chi2;
    changed |= pixel != term.use_pixel || disparity != term.use_disparity;
    term.use_pixel = pixel;
    term.use_disparity = disparity;
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
    if (!term.use_pixel) continue;
    const Chi2 c = chi2(term.measurement, predict(camera, T_camera_world * term.p_world));
    sum += c.pixel + (term.use_disparity ? c.disparity : 0);
    solution.inlier[term.observation] = 1;
    solution.depth_inlier[term.observation] = term.use_disparity;
    ++solution.inliers;
    solution.depth_inliers += term.use_disparity;
  }
  const int components = 2 * solution.inliers + solution.depth_inliers;
  solution.rms = components > 0 ? std::sqrt(sum / components) : 0;
  solution.information = linearise(camera, T_camera_world, terms, nullptr).H;
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
  const Kernels kernels{{options.pixel_chi2}, {options.disparity_chi2}};
  for (int round = 0; round < options.robust_rounds + options.plain_rounds; ++round) {
    const bool robust = round < options.robust_rounds;
    solution.iterations +=
        minimise(camera, terms, robust ? &kernels : nullptr, options, T_camera_world);
    const bool changed = classify(camera, T_camera_world, options, terms);
    if (!robust && !changed) break;
  }
  if (!finite(T_camera_world)) return solution;
  solution.T_world_camera = T_camera_world.inverse();
  describe(camera, T_camera_world, terms, options, solution);
  return solution;
}

}  // namespace stillmap
