// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/adjoint.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Adjoint, MovesATwistFromTheSourceToTheTargetFrame) {
  const Pose T(so3_exp({0.3, -0.5, 1.1}), {4, -2, 1});
  Eigen::Matrix<double, 6, 1> x;
  x << 0.2, -0.1, 0.3, 0.4, 0.1, -0.2;
  const Pose moved = Pose::exp(adjoint(T) * x) * T, expected = T * Pose::exp(x);
  EXPECT_LT((moved.inverse() * expected).log().norm(), 1e-12);
}

}  // namespace
}  // namespace stillmap
