// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/optimize/residual.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <type_traits>

#include <Eigen/Core>

/// Normal equations of both solvers, written out to exploit the structure of the Jacobians:
/// internal to the module.
namespace stillmap {

/// Cost of a point behind the camera: that of a residual of this many sigmas.
inline constexpr double kBehindCameraSigmas = 100;

/// Robust kernels of a pass; plain least squares if `robust` is false.
struct Kernels {
  HuberKernel pixel{kPixelChi2}, disparity{kDisparityChi2};
  bool robust = true;
};

/// Parts of a measurement that are used. Without the pixel nothing is used: the match is then
/// wrong.
struct Parts {
  bool pixel = true, disparity = true;
  bool operator==(const Parts&) const = default;
};

/// Returns the cost of one observation at p_camera [sigma^2]: weight times the squared, possibly
/// robust, residual.
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

/// Returns whether the pixel and, if it does, the disparity are inliers at p_camera.
inline Parts inlier_parts(const Camera& camera, const Measurement& m,
                          const Eigen::Vector3d& p_camera, double pixel_chi2,
                          double disparity_chi2) {
  if (!(p_camera.z() >= kNearPlane)) return {false, false};
  const Chi2 s = chi2(m, predict(camera, p_camera));
  const bool pixel = s.pixel <= pixel_chi2;
  return {pixel, pixel && m.has_depth() && s.disparity <= disparity_chi2};
}

/// Two observations in one vector register. All functions below work on one (double) or two (Pair)
/// at a time; a pair fits a register of every 64-bit processor, so no run-time dispatch is needed.
using Pair = Eigen::Array2d;

inline double smaller(double a, double b) { return std::min(a, b); }
inline double larger(double a, double b) { return std::max(a, b); }
inline double root(double a) { return std::sqrt(a); }
inline bool any_above(double a, double b) { return a > b; }
inline Pair smaller(const Pair& a, double b) { return a.min(b); }
inline Pair larger(const Pair& a, double b) { return a.max(b); }
inline Pair root(const Pair& a) { return a.sqrt(); }
inline bool any_above(const Pair& a, double b) { return a.maxCoeff() > b; }

/// The inner loops of both solvers are inlined into one function each, so that their sums stay in
/// registers.
#if defined(__GNUC__)
#define STILLMAP_INLINE [[gnu::always_inline]] inline
#else
#define STILLMAP_INLINE inline
#endif

/// Replaces a squared residual s by rho(s) and scales the information by rho'(s). Both branches of
/// Huber's kernel in one: with q = sqrt(k^2 max(s, k^2)), rho = min(s, k^2) + 2 (q - k^2) and rho'
/// = k^2 / q.
template <typename T>
STILLMAP_INLINE void apply(const HuberKernel& kernel, T& s, T& information) {
  if (!any_above(s, kernel.bound)) return;
  const T q = root(T(kernel.bound * larger(s, kernel.bound)));
  s = smaller(s, kernel.bound) + 2 * (q - kernel.bound);
  information *= kernel.bound / q;
}

/// One or two measurements with their weights. The information of unused parts is 0.
template <typename T>
struct Observed {
  T u, v, d;
  T pixel_information, disparity_information;
  T weight;
};

inline Observed<double> observed(const Measurement& m, Parts parts, double weight) {
  return {m.uvd.x(),
          m.uvd.y(),
          m.uvd.z(),
          parts.pixel ? m.pixel_information : 0,
          parts.disparity ? m.disparity_information : 0,
          weight};
}

/// Normal equations in p_camera of one or two observations: M = A^T W A and r = A^T W e, with the
/// projection Jacobian A and W containing information, kernel weight (iteratively reweighted least
/// squares) and static probability. A is zero at (0,1) and (1,0), and so is M.
template <typename T>
struct PointNormal {
  T xx, xz, yy, yz, zz;
  T rx, ry, rz;
  T cost;  ///< As observation_cost().
};

/// Returns the normal equations of a point beyond the near plane.
template <typename T>
STILLMAP_INLINE PointNormal<T> point_normal(const Camera& camera, const Observed<T>& o,
                                            const Kernels& kernels, const T& x, const T& y,
                                            const T& z) {
  const T iz = 1.0 / z;
  const T au = camera.fx * iz, av = camera.fy * iz, d = camera.bf() * iz;  // A: diagonal
  const T xn = x * iz, yn = y * iz;
  const T bu = -au * xn, bv = -av * yn, bd = -d * iz;  // A: last column
  const T eu = camera.fx * xn + camera.cx - o.u, ev = camera.fy * yn + camera.cy - o.v;
  const T ed = d - o.d;
  T wp = o.pixel_information, wd = o.disparity_information;
  T sp = wp * (eu * eu + ev * ev), sd = wd * ed * ed;
  if (kernels.robust) {
    apply(kernels.pixel, sp, wp);
    apply(kernels.disparity, sd, wd);
  }
  wp *= o.weight, wd *= o.weight;
  const T wau = wp * au, wav = wp * av, wbd = wd * bd;
  PointNormal<T> n;
  n.xx = wau * au, n.xz = wau * bu, n.yy = wav * av, n.yz = wav * bv;
  n.zz = wp * (bu * bu + bv * bv) + wbd * bd;
  n.rx = wau * eu, n.ry = wav * ev, n.rz = wp * (bu * eu + bv * ev) + wbd * ed;
  n.cost = o.weight * (sp + sd);
  return n;
}

/// Returns the constant cost of a point behind the near plane, with zero derivative.
inline PointNormal<double> behind_camera(double weight) {
  return {0, 0, 0, 0, 0, 0, 0, 0, weight * kBehindCameraSigmas * kBehindCameraSigmas};
}

/// Normal equations H xi = -g of one camera's left perturbation, with their cost.
struct PoseNormal {
  Matrix6d H = Matrix6d::Zero();
  Vector6d g = Vector6d::Zero();
  double cost = 0;

  PoseNormal& operator+=(const PoseNormal& other) {
    H += other.H, g += other.g, cost += other.cost;
    return *this;
  }
};

/// Accumulates the normal equations of one camera. With J = A [I, -[p]x], H has the blocks M, -M
/// [p]x and -[p]x M [p]x, and g = (r, p x r).
template <typename T>
class PoseNormalSum {
 public:
  STILLMAP_INLINE void add(const T& x, const T& y, const T& z, const PointNormal<T>& n) {
    cost_ += n.cost;
    tt_[0] += n.xx, tt_[1] += n.xz, tt_[2] += n.yy, tt_[3] += n.yz, tt_[4] += n.zz;
    const T n00 = n.xz * y, n01 = n.xx * z - n.xz * x, n02 = -n.xx * y;
    const T n10 = n.yz * y - n.yy * z, n11 = -n.yz * x, n12 = n.yy * x;
    const T n20 = n.zz * y - n.yz * z, n21 = n.xz * z - n.zz * x, n22 = n.yz * x - n.xz * y;
    tr_[0] += n00, tr_[1] += n01, tr_[2] += n02;
    tr_[3] += n10, tr_[4] += n11, tr_[5] += n12;
    tr_[6] += n20, tr_[7] += n21, tr_[8] += n22;
    rr_[0] += y * n20 - z * n10, rr_[1] += y * n21 - z * n11, rr_[2] += y * n22 - z * n12;
    rr_[3] += z * n01 - x * n21, rr_[4] += z * n02 - x * n22, rr_[5] += x * n12 - y * n02;
    g_[0] += n.rx, g_[1] += n.ry, g_[2] += n.rz;
    g_[3] += y * n.rz - z * n.ry, g_[4] += z * n.rx - x * n.rz, g_[5] += x * n.ry - y * n.rx;
  }

  PoseNormal equations() const {
    std::array<double, 5> tt;
    std::array<double, 9> tr;
    std::array<double, 6> rr, g;
    const auto sum = [](const T& x) { return total(x); };
    std::ranges::transform(tt_, tt.begin(), sum);
    std::ranges::transform(tr_, tr.begin(), sum);
    std::ranges::transform(rr_, rr.begin(), sum);
    std::ranges::transform(g_, g.begin(), sum);
    PoseNormal e;
    e.H.topLeftCorner<3, 3>() << tt[0], 0, tt[1], 0, tt[2], tt[3], tt[1], tt[3], tt[4];
    e.H.topRightCorner<3, 3>() =
        Eigen::Map<const Eigen::Matrix<double, 3, 3, Eigen::RowMajor>>(tr.data());
    e.H.bottomLeftCorner<3, 3>() = e.H.topRightCorner<3, 3>().transpose();
    e.H.bottomRightCorner<3, 3>() << rr[0], rr[1], rr[2], rr[1], rr[3], rr[4], rr[2], rr[4], rr[5];
    e.g = Eigen::Map<const Vector6d>(g.data());
    e.cost = total(cost_);
    return e;
  }

 private:
  static double total(double x) { return x; }
  static double total(const Pair& x) { return x(0) + x(1); }
  template <std::size_t N>
  static std::array<T, N> zeros() {
    std::array<T, N> a;
    a.fill(zero());
    return a;
  }
  static T zero() {
    if constexpr (std::is_same_v<T, double>) {
      return 0;
    } else {
      return T::Zero();
    }
  }

  std::array<T, 5> tt_ = zeros<5>();  // M: xx xz yy yz zz
  std::array<T, 9> tr_ = zeros<9>();  // -M [p]x, row by row
  std::array<T, 6> rr_ = zeros<6>();  // -[p]x M [p]x: xx xy xz yy yz zz
  std::array<T, 6> g_ = zeros<6>();
  T cost_ = zero();
};

}  // namespace stillmap
