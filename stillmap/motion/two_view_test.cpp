// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/two_view.hpp"

#include "stillmap/motion/test_two_view.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::TwoViews;

TEST(EpipolarDistance, IsThatOfAPointFromALine) {
  // F * (1, 2, 1)' = (3, 4, 10)' is the line 3 x + 4 y + 10 = 0.
  const cv::Matx33d F(3, 0, 0, 0, 2, 0, 4, 3, 0);
  EXPECT_NEAR(epipolar_distance(F, {1, 2}, {0, 0}), 2, 1e-6);
  EXPECT_NEAR(epipolar_distance(F, {1, 2}, {-2, -1}), 0, 1e-6);
  EXPECT_NEAR(epipolar_distance(F, {1, 2}, {5, 10}), 13, 1e-6);
  EXPECT_NEAR(epipolar_distance(-2 * F, {1, 2}, {5, 10}), 13, 1e-6);
  EXPECT_EQ(epipolar_distance(cv::Matx33d::zeros(), {1, 2}, {5, 10}), 0);
}

TEST(EpipolarDistance, IsZeroForStaticPointsAndTheStepAcrossTheLineForMovingOnes) {
  const TwoViews views;
  for (const Eigen::Vector3d& p : views.cloud(50, 1)) {
    const cv::Point2f before = views.in_first(p), now = views.in_second(p);
    EXPECT_NEAR(epipolar_distance(views.F(), before, now), 0, 1e-3);  // points are floats
    const cv::Vec3d line = views.F() * cv::Vec3d(before.x, before.y, 1);
    const double length = std::hypot(line[0], line[1]);
    const cv::Point2f across(static_cast<float>(line[0] / length),
                             static_cast<float>(line[1] / length));
    EXPECT_NEAR(epipolar_distance(views.F(), before, now + 5 * across), 5, 1e-3);
  }
}

TEST(WarpError, IsTheDistanceAfterTheDivision) {
  const cv::Matx33d H(2, 0, 3, 0, 2, 4, 0, 0, 2);
  EXPECT_NEAR(warp_error(H, {10, 20}, {11.5F + 3, 22 + 4}), 5, 1e-9);
  const cv::Matx33d to_infinity(1, 0, 0, 0, 1, 0, 1, 0, -10);
  EXPECT_TRUE(std::isinf(warp_error(to_infinity, {10, 5}, {0, 0})));
}

TEST(NearestRigid, IsTheHomographyItselfIfThatIsARotationAndATranslation) {
  const double c = std::cos(0.3), s = std::sin(0.3);
  const cv::Matx33d rigid(c, -s, 12, s, c, -7, 0, 0, 1);
  const std::vector<cv::Point2f> points{{0, 0}, {300, 10}, {200, 200}, {40, 180}};
  EXPECT_LT(cv::norm(nearest_rigid(-2 * rigid, points) - rigid), 1e-5);
}

TEST(NearestRigid, OfAScaleKeepsTheMeanOfThePoints) {
  const std::vector<cv::Point2f> points{{0, 0}, {100, 0}, {0, 100}, {100, 100}};
  const cv::Matx33d twice(2, 0, 5, 0, 2, 6, 0, 0, 1);
  EXPECT_LT(cv::norm(nearest_rigid(twice, points) - cv::Matx33d(1, 0, 55, 0, 1, 56, 0, 0, 1)),
            1e-5);
}

/// Pairs of a cloud or a plane, the first 40 % of them replaced by random ones.
struct PairsWithOutliers {
  PointPairs pairs;
  std::size_t outliers = 0;
  PairsWithOutliers(const TwoViews& views, const std::vector<Eigen::Vector3d>& cloud) {
    cv::RNG rng(5);
    outliers = cloud.size() * 4 / 10;
    for (std::size_t i = 0; i < cloud.size(); ++i) {
      const cv::Point2f chance(rng.uniform(0.0F, 640.0F), rng.uniform(0.0F, 480.0F));
      const cv::Point2f noise(static_cast<float>(rng.gaussian(0.2)),
                              static_cast<float>(rng.gaussian(0.2)));
      pairs.add(views.in_first(cloud[i]),
                i < outliers ? chance : views.in_second(cloud[i]) + noise);
    }
  }
};

TEST(FindFundamental, ToleratesFortyPercentOutliers) {
  const TwoViews views;
  const auto cloud = views.cloud(300, 2);
  const auto F = find_fundamental(PairsWithOutliers(views, cloud).pairs, 1);
  ASSERT_TRUE(F);
  // Tested on other points without noise, as the noise of 0.2 pixels must be averaged.
  double sum = 0;
  const auto fresh = views.cloud(200, 3);
  for (const auto& p : fresh) sum += epipolar_distance(*F, views.in_first(p), views.in_second(p));
  EXPECT_LT(sum / static_cast<double>(fresh.size()), 0.2);
}

TEST(FindHomography, ToleratesFortyPercentOutliers) {
  const TwoViews views;
  const auto H = find_homography(PairsWithOutliers(views, views.plane(300, 2)).pairs, 1.5);
  ASSERT_TRUE(H);
  for (const auto& p : views.plane(200, 3)) {
    EXPECT_LT(warp_error(*H, views.in_first(p), views.in_second(p)), 0.3);
  }
}

TEST(Ransac, IsDeterministic) {
  const TwoViews views;
  const PairsWithOutliers pairs_with_outliers(views, views.cloud(200, 2));
  const auto F = find_fundamental(pairs_with_outliers.pairs, 1.5);
  const auto H = find_homography(pairs_with_outliers.pairs, 1.5);
  ASSERT_TRUE(F && H);
  const int threads = cv::getNumThreads();
  for (const int n : {1, 2, 7}) {
    cv::setNumThreads(n);
    cv::setRNGSeed(n + 100);
    EXPECT_EQ(cv::norm(*find_fundamental(pairs_with_outliers.pairs, 1.5), *F, cv::NORM_INF), 0);
    EXPECT_EQ(cv::norm(*find_homography(pairs_with_outliers.pairs, 1.5), *H, cv::NORM_INF), 0);
  }
  cv::setNumThreads(threads);
}

TEST(Ransac, DegeneratePairsGiveNoModelOrAFiniteOne) {
  PointPairs none, few, equal, line;
  for (int i = 0; i < 50; ++i) {
    if (i < 3) few.add({10.0F * static_cast<float>(i), 5}, {3, 4});
    equal.add({100, 100}, {100, 100});
    line.add({static_cast<float>(10 * i), 7}, {static_cast<float>(10 * i), 9});
  }
  for (const PointPairs& pairs : {none, few}) {
    EXPECT_FALSE(find_fundamental(pairs, 1.5));
    EXPECT_FALSE(find_homography(pairs, 1.5));
  }
  for (const PointPairs& pairs : {equal, line}) {
    const auto F = find_fundamental(pairs, 1.5);
    const auto H = find_homography(pairs, 1.5);
    EXPECT_TRUE(!F || cv::checkRange(*F));
    EXPECT_TRUE(!H || cv::checkRange(*H));
  }
}

}  // namespace
}  // namespace stillmap
