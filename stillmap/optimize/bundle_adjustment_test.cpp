// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/bundle_adjustment.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/optimize/ceres_bundle.hpp"
#include "stillmap/optimize/synthetic.hpp"

#include <cmath>
#include <cstring>
#include <limits>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using synthetic::BundleScene;
using synthetic::BundleShape;
using synthetic::Noise;

constexpr Noise kModelNoise{.pixel_sigma = 1.0, .disparity_sigma = 0.3};
constexpr BundleShape kSmall{.free_poses = 4, .fixed_poses = 3, .points = 300};

double distance(const Pose& a, const Pose& b) { return (a.inverse() * b).log().norm(); }

double worst_pose_error(const std::vector<Pose>& estimate, const std::vector<Pose>& truth) {
  double worst = 0;
  for (std::size_t i = 0; i < truth.size(); ++i) {
    worst = std::max(worst, distance(estimate[i], truth[i]));
  }
  return worst;
}

// NOLINTBEGIN(bugprone-suspicious-memory-comparison): bit equality is promised.
bool same_bits(const Pose& a, const Pose& b) {
  return std::memcmp(a.quaternion().coeffs().data(), b.quaternion().coeffs().data(),
                     4 * sizeof(double)) == 0 &&
         std::memcmp(a.translation().data(), b.translation().data(), 3 * sizeof(double)) == 0;
}
// NOLINTEND(bugprone-suspicious-memory-comparison)

bool same_bits(const BundleResult& a, const BundleResult& b) {
  bool same = a.pixel_outlier == b.pixel_outlier && a.depth_outlier == b.depth_outlier &&
              a.iterations == b.iterations && a.cost_after == b.cost_after;
  for (std::size_t i = 0; i < a.T_world_camera.size(); ++i) {
    same &= same_bits(a.T_world_camera[i], b.T_world_camera[i]);
  }
  for (std::size_t i = 0; i < a.points.size(); ++i) same &= a.points[i] == b.points[i];
  return same;
}

/// Both solvers must pass; the parameter selects Ceres.
class AdjustBundle : public ::testing::TestWithParam<bool> {
 protected:
  BundleResult adjust(const BundleProblem& problem, const StopRequest& stop = {}) const {
    return GetParam() ? adjust_bundle_with(ceres_bundle::minimize, problem, {}, stop)
                      : adjust_bundle(problem, stop);
  }
};

/// Pixels are floats, rounded to 3e-5 px, which is 1e-7 m here; averages are more precise.
TEST_P(AdjustBundle, FindsTheExactPosesAndPointsFromExactObservations) {
  for (unsigned seed = 0; seed < 5; ++seed) {
    const BundleScene scene = synthetic::bundle_scene(seed, kSmall, {});
    ASSERT_GT(worst_pose_error(scene.problem.T_world_camera, scene.T_world_camera), 0.005);
    const BundleResult result = adjust(scene.problem);
    EXPECT_LT(worst_pose_error(result.T_world_camera, scene.T_world_camera), 1e-7) << seed;
    for (std::size_t i = 0; i < scene.points.size(); ++i) {
      EXPECT_LT((result.points[i] - scene.points[i]).norm(), 1e-5) << seed;
    }
    EXPECT_LT(result.cost_after, 1e-6 * result.cost_before);
    EXPECT_EQ(std::count(result.pixel_outlier.begin(), result.pixel_outlier.end(), 1), 0);
    EXPECT_EQ(std::count(result.depth_outlier.begin(), result.depth_outlier.end(), 1), 0);
  }
}

TEST_P(AdjustBundle, FixedPosesAndPointsDoNotMove) {
  BundleScene scene = synthetic::bundle_scene(1, kSmall, kModelNoise);
  BundleProblem& problem = scene.problem;
  problem.point_fixed.assign(problem.points.size(), 0);
  for (std::size_t i = 0; i < problem.points.size(); i += 3) problem.point_fixed[i] = 1;
  const BundleResult result = adjust(problem);
  for (std::size_t i = 0; i < problem.pose_fixed.size(); ++i) {
    EXPECT_EQ(same_bits(result.T_world_camera[i], problem.T_world_camera[i]),
              problem.pose_fixed[i] != 0);
  }
  for (std::size_t i = 0; i < problem.points.size(); ++i) {
    EXPECT_EQ(result.points[i] == problem.points[i], problem.point_fixed[i] != 0) << i;
  }
}

TEST_P(AdjustBundle, FixedPointsAloneConstrainThePoses) {
  BundleScene scene = synthetic::bundle_scene(2, kSmall, {});
  scene.problem.points = scene.points;
  scene.problem.point_fixed.assign(scene.points.size(), 1);
  const BundleResult result = adjust(scene.problem);
  EXPECT_LT(worst_pose_error(result.T_world_camera, scene.T_world_camera), 1e-7);
}

TEST_P(AdjustBundle, FixedPosesAloneConstrainThePoints) {
  const BundleScene scene =
      synthetic::bundle_scene(2, {.free_poses = 0, .fixed_poses = 5, .points = 100}, {});
  const BundleResult result = adjust(scene.problem);
  for (std::size_t i = 0; i < scene.points.size(); ++i) {
    EXPECT_LT((result.points[i] - scene.points[i]).norm(), 1e-5) << i;
  }
}

TEST_P(AdjustBundle, FindsOutliersAmongNoise) {
  Noise noise = kModelNoise;
  noise.outliers = 0.3;
  const BundleScene scene = synthetic::bundle_scene(3, kSmall, noise);
  const BundleResult result = adjust(scene.problem);
  EXPECT_LT(worst_pose_error(result.T_world_camera, scene.T_world_camera), 0.008);
  int outliers = 0, found = 0, good = 0, wrongly_dropped = 0;
  for (std::size_t i = 0; i < scene.corruption.size(); ++i) {
    (scene.corruption[i].pixel ? outliers : good)++;
    (scene.corruption[i].pixel ? found : wrongly_dropped) += result.pixel_outlier[i];
  }
  ASSERT_GT(outliers, 300);
  EXPECT_GT(found, 0.97 * outliers);
  // The chi-square test drops 5 %; the rest are points with a majority of outliers.
  EXPECT_LT(wrongly_dropped, 0.12 * good);
}

TEST_P(AdjustBundle, AWrongDepthDiscardsTheDepthAndNotThePixel) {
  Noise noise = kModelNoise;
  noise.depth_outliers = 0.3;
  const BundleScene scene = synthetic::bundle_scene(4, kSmall, noise);
  const BundleResult result = adjust(scene.problem);
  EXPECT_LT(worst_pose_error(result.T_world_camera, scene.T_world_camera), 0.006);
  int wrong = 0, found = 0, pixels_dropped = 0;
  for (std::size_t i = 0; i < scene.corruption.size(); ++i) {
    if (!scene.corruption[i].depth) continue;
    ++wrong, found += result.depth_outlier[i], pixels_dropped += result.pixel_outlier[i];
  }
  ASSERT_GT(wrong, 300);
  EXPECT_GT(found, 0.92 * wrong);  // Most of a point's five depths may be wrong.
  EXPECT_LT(pixels_dropped, 0.1 * wrong);
}

TEST_P(AdjustBundle, IgnoresObservationsWithoutWeightOrNotFinite) {
  BundleScene scene = synthetic::bundle_scene(5, kSmall, kModelNoise);
  const BundleResult expected = adjust(scene.problem);
  const std::size_t good = scene.problem.observations.size();
  const auto spoil = [&](auto&& change) {
    BundleObservation o = scene.problem.observations.front();
    o.u += 20;  // The error would be visible if it were used.
    change(o);
    scene.problem.observations.push_back(o);
  };
  constexpr float kNaN = std::numeric_limits<float>::quiet_NaN();
  spoil([](BundleObservation& o) { o.weight = 0; });
  spoil([](BundleObservation& o) { o.weight = kNaN; });
  spoil([](BundleObservation& o) { o.u = kNaN; });
  spoil([](BundleObservation& o) { o.scale = -1; });
  scene.problem.points.emplace_back(kNaN, 0, 0);
  spoil([&](BundleObservation& o) { o.point = static_cast<std::uint32_t>(scene.points.size()); });
  const BundleResult result = adjust(scene.problem);
  for (std::size_t i = 0; i < expected.T_world_camera.size(); ++i) {
    EXPECT_TRUE(same_bits(result.T_world_camera[i], expected.T_world_camera[i]));
  }
  for (std::size_t i = good; i < scene.problem.observations.size(); ++i) {
    EXPECT_EQ(result.pixel_outlier[i], 1);
    EXPECT_EQ(result.depth_outlier[i], 1);
  }
}

TEST_P(AdjustBundle, UnobservedPosesAndPointsStayUnchanged) {
  BundleScene scene = synthetic::bundle_scene(6, kSmall, kModelNoise);
  scene.problem.points.emplace_back(1, 2, 3);
  scene.problem.T_world_camera.emplace_back(Eigen::Quaterniond::Identity(),
                                            Eigen::Vector3d(4, 5, 6));
  scene.problem.pose_fixed.push_back(0);
  const BundleResult result = adjust(scene.problem);
  EXPECT_EQ(result.points.back(), scene.problem.points.back());
  EXPECT_TRUE(same_bits(result.T_world_camera.back(), scene.problem.T_world_camera.back()));
}

/// The distance is unconstrained, but the point must not diverge.
TEST_P(AdjustBundle, APointSeenOnceWithoutDepthStaysNearItsGuess) {
  BundleScene scene = synthetic::bundle_scene(6, kSmall, kModelNoise);
  BundleObservation o = scene.problem.observations.front();
  o.point = static_cast<std::uint32_t>(scene.problem.points.size());
  o.depth = 0;
  scene.problem.points.push_back(scene.problem.points[scene.problem.observations.front().point]);
  scene.problem.observations.push_back(o);
  const BundleResult result = adjust(scene.problem);
  EXPECT_LT((result.points.back() - scene.problem.points.back()).norm(), 0.2);
}

TEST_P(AdjustBundle, ToleratesPosesWithOneOrTwoObservations) {
  BundleScene scene = synthetic::bundle_scene(7, kSmall, {});
  const BundleObservation seen = scene.problem.observations.front();
  for (int count = 1; count <= 2; ++count) {
    const auto pose = static_cast<std::uint32_t>(scene.problem.T_world_camera.size());
    scene.problem.T_world_camera.push_back(scene.T_world_camera[seen.pose]);
    scene.problem.pose_fixed.push_back(0);
    for (int i = 0; i < count; ++i) {
      BundleObservation o = seen;
      o.pose = pose;
      scene.problem.observations.push_back(o);  // The duplicate adds no constraint.
    }
  }
  const BundleResult result = adjust(scene.problem);
  EXPECT_LT(worst_pose_error(result.T_world_camera, scene.T_world_camera), 1e-6);
  for (std::size_t i = scene.T_world_camera.size(); i < result.T_world_camera.size(); ++i) {
    EXPECT_LT(distance(result.T_world_camera[i], scene.T_world_camera[seen.pose]), 0.1);
  }
}

TEST_P(AdjustBundle, AnInterruptedRunReturnsTheBestSoFar) {
  const BundleScene scene = synthetic::bundle_scene(8, kSmall, kModelNoise);
  const BundleResult whole = adjust(scene.problem);
  EXPECT_FALSE(whole.interrupted);

  const BundleResult at_once = adjust(scene.problem, [] { return true; });
  EXPECT_TRUE(at_once.interrupted);
  EXPECT_EQ(at_once.iterations, 0);
  EXPECT_LT(worst_pose_error(at_once.T_world_camera, scene.problem.T_world_camera), 1e-12);

  int asked = 0;
  const BundleResult soon = adjust(scene.problem, [&] { return ++asked > 2; });
  EXPECT_TRUE(soon.interrupted);
  EXPECT_LT(soon.iterations, whole.iterations);
  EXPECT_LT(soon.cost_after, 0.5 * soon.cost_before);
  EXPECT_LT(worst_pose_error(soon.T_world_camera, scene.T_world_camera),
            worst_pose_error(scene.problem.T_world_camera, scene.T_world_camera));
}

TEST_P(AdjustBundle, IsDeterministic) {
  Noise noise = kModelNoise;
  noise.outliers = 0.1, noise.depthless = 0.2;
  const BundleScene scene = synthetic::bundle_scene(9, kSmall, noise);
  EXPECT_TRUE(same_bits(adjust(scene.problem), adjust(scene.problem)));
}

TEST_P(AdjustBundle, RefusesInconsistentProblems) {
  const BundleProblem good = synthetic::bundle_scene(10, kSmall, {}).problem;
  const auto refused = [&](auto&& spoil) {
    BundleProblem bad = good;
    spoil(bad);
    EXPECT_THROW(adjust(bad), Error);
  };
  refused([](BundleProblem& p) { p.pose_fixed.assign(p.pose_fixed.size(), 0); });
  refused([](BundleProblem& p) { p.pose_fixed.pop_back(); });
  refused([](BundleProblem& p) { p.point_fixed = {1, 0}; });
  refused([](BundleProblem& p) { p.observations[3].pose = 1000; });
  refused([](BundleProblem& p) { p.observations[3].point = 1000; });
  refused([](BundleProblem& p) {
    p.T_world_camera[0] = Pose(Eigen::Quaterniond::Identity(), {NAN, 0, 0});
  });
  refused([](BundleProblem& p) { p = {}; });
  EXPECT_NO_THROW(adjust(good));
}

INSTANTIATE_TEST_SUITE_P(Solver, AdjustBundle, ::testing::Bool(),
                         [](const auto& test) { return test.param ? "Ceres" : "Schur"; });

/// At convergence and without outliers both solvers must reach the same minimum.
void expect_same_minimum(const BundleProblem& problem) {
  const BundleLimits limits{
      .robust_iterations = 50, .plain_iterations = 50, .cost_tolerance = 1e-14};
  const BundleResult schur = adjust_bundle_with(minimize_with_schur, problem, limits);
  const BundleResult ceres = adjust_bundle_with(ceres_bundle::minimize, problem, limits);
  EXPECT_EQ(schur.pixel_outlier, ceres.pixel_outlier);
  EXPECT_EQ(schur.depth_outlier, ceres.depth_outlier);
  EXPECT_NEAR(schur.cost_after, ceres.cost_after, 1e-6 * ceres.cost_after);
  EXPECT_LT(worst_pose_error(schur.T_world_camera, ceres.T_world_camera), 1e-6);
  for (std::size_t i = 0; i < schur.points.size(); ++i) {
    EXPECT_LT((schur.points[i] - ceres.points[i]).norm(), 1e-5) << i;
  }
}

TEST(SchurSolver, FindsTheMinimumThatCeresFinds) {
  const Noise noise{
      .pixel_sigma = 1, .disparity_sigma = 0.3, .outliers = 0.02, .depth_outliers = 0.02};
  expect_same_minimum(synthetic::bundle_scene(11, kSmall, noise).problem);
}

// Uses the sparse factorization.
TEST(SchurSolver, FindsTheMinimumThatCeresFindsWithManyPosesToo) {
  const BundleShape shape{.free_poses = 50, .fixed_poses = 2, .points = 500, .spacing = 0.1};
  expect_same_minimum(synthetic::bundle_scene(12, shape, kModelNoise).problem);
}

TEST(SchurSolver, TwoObservationsAreOneOfTwiceTheWeight) {
  BundleProblem twice = synthetic::bundle_scene(13, kSmall, kModelNoise).problem;
  BundleProblem heavy = twice;
  for (BundleObservation& o : heavy.observations) o.weight = 2;
  twice.observations.insert(twice.observations.end(), heavy.observations.begin(),
                            heavy.observations.end());
  for (BundleObservation& o : twice.observations) o.weight = 1;
  const BundleResult a = adjust_bundle(twice), b = adjust_bundle(heavy);
  EXPECT_LT(worst_pose_error(a.T_world_camera, b.T_world_camera), 1e-9);
  EXPECT_NEAR(a.cost_after, b.cost_after, 1e-9 * b.cost_after);
}

/// Returns the dense inverse covariance of the free poses after elimination of the points, from the
/// Jacobians at the truth.
Eigen::MatrixXd marginal_information(const BundleScene& scene, int free_poses,
                                     const ObservationNoise& noise) {
  const auto poses = 6 * free_poses;
  const auto size = poses + 3 * static_cast<Eigen::Index>(scene.points.size());
  Eigen::MatrixXd H = Eigen::MatrixXd::Zero(size, size);
  for (const BundleObservation& o : scene.problem.observations) {
    const Pose T_camera_world = scene.T_world_camera[o.pose].inverse();
    const Eigen::Vector3d p = T_camera_world * scene.points[o.point];
    const Eigen::Matrix3d A = projection_jacobian(scene.problem.camera, p);
    Eigen::MatrixXd J = Eigen::MatrixXd::Zero(3, size);
    if (static_cast<int>(o.pose) < free_poses) J.middleCols<6>(6 * o.pose) = pose_jacobian(A, p);
    J.middleCols<3>(poses + 3 * o.point) = point_jacobian(A, T_camera_world.rotation());
    const double wp = 1 / (noise.pixel_sigma * noise.pixel_sigma);
    const double wd = 1 / (noise.disparity_sigma * noise.disparity_sigma);
    H += J.transpose() * Eigen::Vector3d(wp, wp, wd).asDiagonal() * J;
  }
  const auto points = size - poses;
  return H.topLeftCorner(poses, poses) -
         H.topRightCorner(poses, points) *
             H.bottomRightCorner(points, points).llt().solve(H.bottomLeftCorner(points, poses));
}

/// Squared pose errors in units of their covariance: chi-square with 12 degrees of freedom for 2
/// poses, whose mean over 40 trials is 12 +- 0.8. Cutting tails at 95 % adds some error.
TEST(SchurSolver, ErrorsMatchTheCovariance) {
  const BundleShape shape{
      .free_poses = 2, .fixed_poses = 2, .points = 40, .observations_per_point = 4};
  double sum = 0;
  constexpr unsigned kTrials = 40;
  for (unsigned seed = 0; seed < kTrials; ++seed) {
    const BundleScene scene = synthetic::bundle_scene(seed, shape, kModelNoise);
    const BundleResult result = adjust_bundle(scene.problem);
    Eigen::VectorXd xi(12);
    for (std::size_t i = 0; i < 2; ++i) {
      xi.segment<6>(6 * static_cast<Eigen::Index>(i)) =
          (scene.T_world_camera[i].inverse() * result.T_world_camera[i]).log();
    }
    const double error = xi.dot(marginal_information(scene, 2, {}) * xi);
    EXPECT_LT(error, 50) << seed;
    sum += error;
  }
  EXPECT_NEAR(sum / kTrials, 13.5, 3.5);
}

}  // namespace
}  // namespace stillmap
