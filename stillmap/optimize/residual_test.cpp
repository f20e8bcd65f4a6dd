// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/residual.hpp"

#include "stillmap/optimize/normal_equations.hpp"

#include <cmath>
#include <limits>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

const Camera kCamera{.fx = 535.4, .fy = 539.2, .cx = 320.1, .cy = 247.6};
const Pose kPose(so3_exp({0.3, -0.2, 0.5}), {0.1, 0.2, 0.4});
const Eigen::Vector3d kPoint(0.4, -0.3, 1.7);

/// Returns central differences of f at zero, column by column.
template <int N, typename F>
Eigen::Matrix<double, 3, N> numeric_derivative(F&& f) {
  constexpr double h = 1e-6;
  Eigen::Matrix<double, 3, N> J;
  for (int i = 0; i < N; ++i) {
    const Eigen::Matrix<double, N, 1> step = h * Eigen::Matrix<double, N, 1>::Unit(i);
    J.col(i) = (f(step) - f(-step)) / (2 * h);
  }
  return J;
}

TEST(Residual, PoseJacobianIsTheDerivativeOfTheLeftPerturbation) {
  const Eigen::Vector3d p = kPose * kPoint;
  const Matrix36d J = pose_jacobian(projection_jacobian(kCamera, p), p);
  const Matrix36d numeric = numeric_derivative<6>(
      [&](const Vector6d& xi) { return predict(kCamera, Pose::exp(xi) * kPose * kPoint); });
  EXPECT_LT((J - numeric).norm(), 1e-6 * J.norm());
}

TEST(Residual, PointJacobianIsTheDerivativeInTheWorld) {
  const Eigen::Matrix3d J =
      point_jacobian(projection_jacobian(kCamera, kPose * kPoint), kPose.rotation());
  const Eigen::Matrix3d numeric = numeric_derivative<3>(
      [&](const Eigen::Vector3d& d) { return predict(kCamera, kPose * (kPoint + d)); });
  EXPECT_LT((J - numeric).norm(), 1e-6 * J.norm());
}

TEST(Residual, EqualsTheRightCoordinateWithItsFullCovariance) {
  const ObservationNoise noise{.pixel_sigma = 0.8, .disparity_sigma = 0.2};
  const Eigen::Vector3d predicted = predict(kCamera, kPose * kPoint);
  const Measurement m = make_measurement(kCamera, noise, predicted.x() + 1.1, predicted.y() - 0.7,
                                         kCamera.bf() / (predicted.z() + 0.3), 1.44);
  const Chi2 c = chi2(m, predicted);

  // u_r = u - d: the error of (u, v, u_r) is T times that of (u, v, d).
  const double variance = std::pow(0.8 * 1.44, 2);
  Eigen::Matrix3d T;
  T << 1, 0, 0, 0, 1, 0, 1, 0, -1;
  const Eigen::Matrix3d covariance =
      T * Eigen::Vector3d(variance, variance, 0.04).asDiagonal() * T.transpose();
  const Eigen::Vector3d e = T * (predicted - m.uvd);
  EXPECT_NEAR(c.pixel + c.disparity, e.dot(covariance.inverse() * e), 1e-9);
}

TEST(Residual, AnInvalidDepthIsUnknownAndAnInvalidPixelUnusable) {
  const ObservationNoise noise;
  EXPECT_TRUE(make_measurement(kCamera, noise, 10, 20, 1.5, 1).has_depth());
  for (const double depth : {0.0, -1.0, kNaN, HUGE_VAL}) {
    const Measurement m = make_measurement(kCamera, noise, 10, 20, depth, 1);
    EXPECT_TRUE(m.usable()) << depth;
    EXPECT_FALSE(m.has_depth()) << depth;
  }
  EXPECT_FALSE(make_measurement(kCamera, noise, kNaN, 20, 1.5, 1).usable());
  EXPECT_FALSE(make_measurement(kCamera, noise, 10, HUGE_VAL, 1.5, 1).usable());
  EXPECT_FALSE(make_measurement(kCamera, noise, 10, 20, 1.5, 0).usable());
  EXPECT_FALSE(make_measurement(kCamera, noise, 10, 20, 1.5, kNaN).usable());
}

TEST(Residual, ThePixelSigmaGrowsWithTheLevelAndTheDisparitySigmaDoesNot) {
  const ObservationNoise noise{.pixel_sigma = 0.5, .disparity_sigma = 0.25};
  const Measurement m = make_measurement(kCamera, noise, 10, 20, 1.5, 1.728);
  EXPECT_NEAR(m.pixel_information, 1 / std::pow(0.5 * 1.728, 2), 1e-12);
  EXPECT_NEAR(m.disparity_information, 16, 1e-12);
}

TEST(HuberKernel, IsSmoothAtItsBoundAndItsWeightIsItsDerivative) {
  const HuberKernel kernel{5.991};
  EXPECT_NEAR(kernel.rho(5.991 - 1e-9), kernel.rho(5.991 + 1e-9), 1e-8);
  for (const double s : {0.5, 5.0, 7.0, 100.0, 1e6}) {
    const double h = 1e-5 * s;
    EXPECT_NEAR(kernel.weight(s), (kernel.rho(s + h) - kernel.rho(s - h)) / (2 * h), 1e-7) << s;
  }
}

/// The explicit sums must equal H = J^T W J and g = J^T W e from the Jacobians.
TEST(NormalEquations, AreThoseOfTheJacobians) {
  const Eigen::Vector3d p = kPose * kPoint;
  const ObservationNoise noise{.pixel_sigma = 0.8, .disparity_sigma = 0.2};
  const Eigen::Vector3d uvd = predict(kCamera, p);
  const Measurement m = make_measurement(kCamera, noise, uvd.x() + 9, uvd.y() - 4,
                                         kCamera.bf() / (uvd.z() + 0.1), 1.2);
  const double weight = 0.7;
  const Kernels kernels;
  const PointNormal<double> n =
      point_normal(kCamera, observed(m, {}, weight), kernels, p.x(), p.y(), p.z());
  PoseNormalSum<double> sum;
  sum.add(p.x(), p.y(), p.z(), n);
  const PoseNormal normal = sum.equations();

  const Chi2 s = chi2(m, uvd);
  ASSERT_GT(s.pixel, kPixelChi2);  // The kernel is active.
  const double wp = weight * m.pixel_information * kernels.pixel.weight(s.pixel);
  const double wd = weight * m.disparity_information;
  const Eigen::DiagonalMatrix<double, 3> W(wp, wp, wd);
  const Eigen::Matrix3d A = projection_jacobian(kCamera, p);
  const Matrix36d J = pose_jacobian(A, p);
  const Eigen::Vector3d e = uvd - m.uvd;
  const Eigen::Matrix3d M = A.transpose() * W * A;
  const Matrix6d H = J.transpose() * W * J;
  const Vector6d g = J.transpose() * W * e;
  EXPECT_NEAR(n.zz, M(2, 2), 1e-12 * M.norm());
  EXPECT_LT((normal.H - H).norm(), 1e-12 * H.norm());
  EXPECT_LT((normal.g - g).norm(), 1e-12 * g.norm());
  EXPECT_NEAR(normal.cost, weight * (kernels.pixel.rho(s.pixel) + s.disparity), 1e-9);
  EXPECT_NEAR(normal.cost, observation_cost(kCamera, m, {}, weight, kernels, p), 1e-9);
}

/// The result for a pair must equal the sum of both, with residuals inside and outside the kernel
/// bounds.
TEST(NormalEquations, OfAPairAreTheSumOfBoth) {
  const ObservationNoise noise{.pixel_sigma = 0.8, .disparity_sigma = 0.2};
  const Kernels kernels;
  PoseNormalSum<double> singles;
  Pair x, y, z;
  Observed<Pair> pair;
  for (int i = 0; i < 2; ++i) {
    const Eigen::Vector3d p = kPose * (kPoint + i * Eigen::Vector3d(0.3, 0.2, 0.5));
    const Eigen::Vector3d uvd = predict(kCamera, p);
    const Measurement m = make_measurement(kCamera, noise, uvd.x() + 9 * i + 0.1, uvd.y() - 0.3,
                                           kCamera.bf() / (uvd.z() + 0.9 - 0.8 * i), 1.2);
    const Observed<double> o = observed(m, {}, 0.7);
    singles.add(p.x(), p.y(), p.z(), point_normal(kCamera, o, kernels, p.x(), p.y(), p.z()));
    x(i) = p.x(), y(i) = p.y(), z(i) = p.z();
    pair.u(i) = o.u, pair.v(i) = o.v, pair.d(i) = o.d, pair.weight(i) = o.weight;
    pair.pixel_information(i) = o.pixel_information;
    pair.disparity_information(i) = o.disparity_information;
  }
  PoseNormalSum<Pair> pairs;
  pairs.add(x, y, z, point_normal(kCamera, pair, kernels, x, y, z));
  const PoseNormal a = singles.equations(), b = pairs.equations();
  EXPECT_LT((a.H - b.H).norm(), 1e-12 * a.H.norm());
  EXPECT_LT((a.g - b.g).norm(), 1e-12 * a.g.norm());
  EXPECT_NEAR(a.cost, b.cost, 1e-9);
}

}  // namespace
}  // namespace stillmap
