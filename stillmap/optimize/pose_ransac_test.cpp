// SPDX-License-Identifier: Apache-2.0
#include "stillmap/optimize/pose_ransac.hpp"

#include "stillmap/optimize/synthetic.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr int kMinInliers = 15;

double meters(const Pose& a, const Pose& b) { return (a.inverse() * b).translation().norm(); }
double radians(const Pose& a, const Pose& b) { return (a.inverse() * b).angle(); }

/// Points seen by two cameras, with some wrong pairs.
struct TwoViews {
  Camera camera;
  Pose T_a_b;
  std::vector<RigidPair> pairs;
  /// The same pairs with b as the world frame and a as the camera.
  std::vector<AbsolutePair> pixels;
  std::vector<std::uint8_t> right;
};

TwoViews two_views(unsigned seed, int count, double wrong_share, double pixel_sigma,
                   double depth_share) {
  std::mt19937 rng(seed);
  std::normal_distribution<double> normal;
  std::uniform_real_distribution<double> uniform(0, 1);
  TwoViews views;
  views.T_a_b = synthetic::random_pose(rng, 0.4, 0.3);
  const Camera& camera = views.camera;
  // Adds pixel noise and a relative depth error.
  const auto measure = [&](const Eigen::Vector3d& p, Eigen::Vector2d& uv) -> Eigen::Vector3d {
    const double v_noise = normal(rng),
                 u_noise = normal(rng);  // not as arguments, whose order is free
    uv = camera.project(p) + pixel_sigma * Eigen::Vector2d(u_noise, v_noise);
    return camera.unproject(uv.x(), uv.y(), p.z() * (1 + depth_share * normal(rng)));
  };
  while (static_cast<int>(views.pairs.size()) < count) {
    const auto pixel = synthetic::random_pixel(rng, camera);
    const Eigen::Vector3d p_a = camera.unproject(pixel.u, pixel.v, pixel.depth);
    Eigen::Vector3d p_b = views.T_a_b.inverse() * p_a;
    if (p_b.z() < 0.5 || !camera.contains(camera.project(p_b).x(), camera.project(p_b).y()))
      continue;
    const bool wrong = uniform(rng) < wrong_share;
    if (wrong) {
      const auto other = synthetic::random_pixel(rng, camera);
      p_b = camera.unproject(other.u, other.v, other.depth);
    }
    RigidPair pair;
    pair.p_a = measure(p_a, pair.uv_a);
    pair.p_b = measure(p_b, pair.uv_b);
    views.pairs.push_back(pair);
    views.pixels.push_back({pair.p_b, pair.uv_a, 1});
    views.right.push_back(!wrong);
  }
  return views;
}

int wrong_inliers(const TwoViews& views, const Consensus<Pose>& found) {
  int wrong = 0;
  for (std::size_t i = 0; i < views.right.size(); ++i) wrong += found.inlier[i] && !views.right[i];
  return wrong;
}

TEST(FindRigidMotion, IsExactWithoutNoise) {
  for (unsigned seed = 0; seed < 10; ++seed) {
    const TwoViews views = two_views(seed, 100, 0.5, 0, 0);
    const auto found = find_rigid_motion(views.camera, views.pairs, kMinInliers);
    ASSERT_TRUE(found) << seed;
    EXPECT_LT(meters(found->model, views.T_a_b), 1e-9);
    EXPECT_LE(wrong_inliers(views, *found), 1);
  }
}

/// 70 % wrong pairs, 0.7 pixels and 1 % of depth noise: one point has an error of about 3 cm,
/// averaged over 20 to 30 points, but a narrow group of points constrains the rotation less.
TEST(FindRigidMotion, ToleratesSeventyPercentWrongPairs) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const TwoViews views = two_views(seed, 100, 0.7, 0.7, 0.01);
    const auto found = find_rigid_motion(views.camera, views.pairs, kMinInliers);
    ASSERT_TRUE(found) << seed;
    EXPECT_LT(meters(found->model, views.T_a_b), 0.06) << seed;
    EXPECT_LT(radians(found->model, views.T_a_b), 0.03) << seed;
    EXPECT_LE(wrong_inliers(views, *found), 2) << seed;
  }
}

TEST(FindRigidMotion, ReturnsNothingWithoutConsensus) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const TwoViews views = two_views(seed, 100, 1, 0.7, 0.01);
    EXPECT_FALSE(find_rigid_motion(views.camera, views.pairs, kMinInliers)) << seed;
  }
  EXPECT_FALSE(find_rigid_motion(Camera{}, {}, kMinInliers));
}

TEST(FindRigidMotion, DrawsFewerSamplesWithMoreInliers) {
  const auto samples = [](double wrong) {
    const TwoViews views = two_views(3, 200, wrong, 0.5, 0.005);
    return find_rigid_motion(views.camera, views.pairs, kMinInliers)->iterations;
  };
  EXPECT_LT(samples(0.1), 30);
  EXPECT_GT(samples(0.7), samples(0.1));
}

TEST(FindRigidMotion, TheSameSeedGivesTheSameResult) {
  const TwoViews views = two_views(4, 150, 0.6, 0.7, 0.01);
  const auto first = find_rigid_motion(views.camera, views.pairs, kMinInliers);
  const auto second = find_rigid_motion(views.camera, views.pairs, kMinInliers);
  EXPECT_EQ(first->inlier, second->inlier);
  EXPECT_EQ(first->model.translation(), second->model.translation());
}

TEST(FindAbsolutePose, NeedsNoDepth) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const TwoViews views = two_views(seed, 120, 0.5, 0.5, 0);
    const auto found = find_absolute_pose(views.camera, views.pixels, kMinInliers);
    ASSERT_TRUE(found) << seed;
    EXPECT_LT(meters(found->model, views.T_a_b.inverse()), 0.08)
        << seed;  // The pose comes from three pixels, not from all.
    EXPECT_LT(radians(found->model, views.T_a_b.inverse()), 0.04) << seed;
    EXPECT_LE(wrong_inliers(views, *found), 2) << seed;
  }
}

TEST(FindAbsolutePose, ReturnsNothingWithoutConsensus) {
  for (unsigned seed = 0; seed < 20; ++seed) {
    const TwoViews views = two_views(seed, 100, 1, 0.7, 0.01);
    EXPECT_FALSE(find_absolute_pose(views.camera, views.pixels, kMinInliers)) << seed;
  }
}

}  // namespace
}  // namespace stillmap
