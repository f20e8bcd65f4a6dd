// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/residual.hpp"

#include <cmath>

#include <Eigen/Core>

/// What both solvers sum up, written out so that the structure of the Jacobians is used: internal
/// to the room.
namespace stillmap {

/// Cost of a point that is, or strays, behind the camera: as much as a residual of this many
/// sigmas.
inline constexpr double kBehindCameraSigmas = 100;

/// The robust kernels of a pass; with `robust` false plain least squares.
struct Kernels {
  HuberKernel pixel{kPixelChi2}, disparity{kDisparityChi2};
  bool robust = true;
};

/// Which parts of a measurement count now. Without the pixel nothing does: it is another thing's
/// then.
struct Parts {
  bool pixel = true, disparity = true;
  bool operator==(const Parts&) const = default;
};

/// Cost of one observation at p_camera [sigma^2]: weight times the squared, perhaps robust,
/// residual.
inline double observation_cost(const Camera& camera, const Measurement& m, Parts parts,
                               double weight, const Kernels& kernels,
                               const Eigen::Vector3d& p_camera) {
  if (!parts.pixel) return 0;
  if (p_camera.z() < kNearPlane) return weight * kBehindCameraSigmas * kBehindCameraSigmas;
  Chi2 s = chi2(m, predict(camera, p_camera));
  if (!parts.disparity) s.disparity = 0;
  if (!kernels.robust) return weight * (s.pixel + s.disparity);
  return weight * (kernels.pixel.rho(s.pixel) + kernels.disparity.rho(s.disparity));
}

/// Whether pixel and, given that, disparity agree with p_camera.
inline Parts agreement(const Camera& camera, const Measurement& m, const Eigen::Vector3d& p_camera,
                       double pixel_chi2, double disparity_chi2) {
  if (!(p_camera.z() >= kNearPlane)) return {false, false};
  const Chi2 s = chi2(m, predict(camera, p_camera));
  const bool pixel = s.pixel <= pixel_chi2;
  return {pixel, pixel && m.has_depth() && s.disparity <= disparity_chi2};
}

/// One observation's normal equations in p_camera: M = A^T W A and r = A^T W e, with A the
/// projection Jacobian and W the informations, kernel weights (iteratively reweighted least
/// squares) and static probability included. A has no entry in (0,1), (1,0), so M has none either.
struct PointNormal {
  double xx = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  Eigen::Vector3d r = Eigen::Vector3d::Zero();
  double cost = 0;  ///< as observation_cost()

  Eigen::Matrix3d M() const {
    Eigen::Matrix3d m;
    m << xx, 0, xz, 0, yy, yz, xz, yz, zz;
    return m;
  }
};

inline PointNormal point_normal(const Camera& camera, const Measurement& m, Parts parts,
                                double weight, const Kernels& kernels, const Eigen::Vector3d& p) {
  PointNormal n;
  if (!parts.pixel) return n;
  if (p.z() < kNearPlane) {
    n.cost = weight * kBehindCameraSigmas * kBehindCameraSigmas;
    return n;
  }
  const double iz = 1.0 / p.z();
  const double au = camera.fx * iz, av = camera.fy * iz, bf_iz = camera.bf() * iz;  // A: diagonal
  const double bu = -au * p.x() * iz, bv = -av * p.y() * iz, bd = -bf_iz * iz;  // A: last column
  const double eu = au * p.x() + camera.cx - m.uvd.x(), ev = av * p.y() + camera.cy - m.uvd.y();
  const double ed = bf_iz - m.uvd.z();
  double wp = m.pixel_information, wd = parts.disparity ? m.disparity_information : 0;
  const double sp = wp * (eu * eu + ev * ev), sd = wd * ed * ed;
  n.cost = sp + sd;
  if (kernels.robust) {
    n.cost = kernels.pixel.rho(sp) + kernels.disparity.rho(sd);
    wp *= kernels.pixel.weight(sp);
    wd *= kernels.disparity.weight(sd);
  }
  n.cost *= weight, wp *= weight, wd *= weight;
  const double wau = wp * au, wav = wp * av;
  n.xx = wau * au, n.xz = wau * bu, n.yy = wav * av, n.yz = wav * bv;
  n.zz = wp * (bu * bu + bv * bv) + wd * bd * bd;
  n.r << wau * eu, wav * ev, wp * (bu * eu + bv * ev) + wd * bd * ed;
  return n;
}

/// Normal equations H xi = -g of one camera's left perturbation, and the cost they model.
struct PoseNormal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0;
};

/// Sums one camera's normal equations. With J = A [I, -[p]x], H has the blocks M, -M [p]x and
/// -[p]x M [p]x, and g = (r, p x r).
class PoseNormalSum {
 public:
  void add(const Eigen::Vector3d& p, const PointNormal& n) {
    const double x = p.x(), y = p.y(), z = p.z();
    cost_ += n.cost;
    tt_[0] += n.xx, tt_[1] += n.xz, tt_[2] += n.yy, tt_[3] += n.yz, tt_[4] += n.zz;
    const double n00 = n.xz * y, n01 = n.xx * z - n.xz * x, n02 = -n.xx * y;
    const double n10 = n.yz * y - n.yy * z, n11 = -n.yz * x, n12 = n.yy * x;
    const double n20 = n.zz * y - n.yz * z, n21 = n.xz * z - n.zz * x, n22 = n.yz * x - n.xz * y;
    tr_[0] += n00, tr_[1] += n01, tr_[2] += n02;
    tr_[3] += n10, tr_[4] += n11, tr_[5] += n12;
    tr_[6] += n20, tr_[7] += n21, tr_[8] += n22;
    rr_[0] += y * n20 - z * n10, rr_[1] += y * n21 - z * n11, rr_[2] += y * n22 - z * n12;
    rr_[3] += z * n01 - x * n21, rr_[4] += z * n02 - x * n22, rr_[5] += x * n12 - y * n02;
    g_[0] += n.r.x(), g_[1] += n.r.y(), g_[2] += n.r.z();
    g_[3] += y * n.r.z() - z * n.r.y();
    g_[4] += z * n.r.x() - x * n.r.z();
    g_[5] += x * n.r.y() - y * n.r.x();
  }

  PoseNormal equations() const {
    PoseNormal e;
    e.H.topLeftCorner<3, 3>() << tt_[0], 0, tt_[1], 0, tt_[2], tt_[3], tt_[1], tt_[3], tt_[4];
    e.H.topRightCorner<3, 3>() << tr_[0], tr_[1], tr_[2], tr_[3], tr_[4], tr_[5], tr_[6], tr_[7],
        tr_[8];
    e.H.bottomLeftCorner<3, 3>() = e.H.topRightCorner<3, 3>().transpose();
    e.H.bottomRightCorner<3, 3>() << rr_[0], rr_[1], rr_[2], rr_[1], rr_[3], rr_[4], rr_[2], rr_[4],
        rr_[5];
    e.g << g_[0], g_[1], g_[2], g_[3], g_[4], g_[5];
    e.cost = cost_;
    return e;
  }

 private:
  double tt_[5] = {};  // M: xx xz yy yz zz
  double tr_[9] = {};  // -M [p]x, row by row
  double rr_[6] = {};  // -[p]x M [p]x: xx xy xz yy yz zz
  double g_[6] = {};
  double cost_ = 0;
};

}  // namespace stillmap
