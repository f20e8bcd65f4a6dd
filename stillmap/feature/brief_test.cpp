// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/brief.hpp"

#include "stillmap/feature/dead_leaves.hpp"

#include <cmath>
#include <set>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Returns `image` rotated by `angle` (from x to y) around the pixel `center`.
cv::Mat turned(const cv::Mat& image, cv::Point2f center, double angle) {
  const cv::Mat map = cv::getRotationMatrix2D(center, -angle * 180 / CV_PI, 1);
  cv::Mat result;
  cv::warpAffine(image, result, map, image.size(), cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
  return result;
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * CV_PI)); }

class BriefOnPath : public testing::TestWithParam<CpuPath> {};
INSTANTIATE_TEST_SUITE_P(Paths, BriefOnPath, testing::Values(CpuPath::kPortable, best_cpu_path()),
                         [](const auto& suite) { return suite.index == 0 ? "Portable" : "Best"; });

TEST_P(BriefOnPath, MomentsEqualTheDefinition) {
  const cv::Mat image = dead_leaves({80, 60}, 1);
  const std::vector<Corner> corners = {{16, 16, 0}, {40, 30, 0}, {63, 43, 0}};
  std::vector<PatchMoments> moments(corners.size());
  patch_moments(image, corners, moments, GetParam());
  for (std::size_t i = 0; i < corners.size(); ++i) {
    PatchMoments expected;
    for (int y = -15; y <= 15; ++y) {
      for (int x = -15; x <= 15; ++x) {
        if (x * x + y * y > 15.5 * 15.5) continue;
        const int gray = image.at<std::uint8_t>(corners[i].y + y, corners[i].x + x);
        expected.m10 += x * gray;
        expected.m01 += y * gray;
      }
    }
    EXPECT_EQ(moments[i], expected);
  }
}

TEST_P(BriefOnPath, BlurIsTheIntegerGaussian) {
  for (const cv::Size size : {cv::Size(4, 4), {33, 7}, {70, 41}}) {
    const cv::Mat image = dead_leaves(size, 2);
    cv::Mat expected;
    cv::GaussianBlur(image, expected, {7, 7}, 2, 2, cv::BORDER_REFLECT_101);
    Blur blur(GetParam());
    // Weights in 1/256 and rounding between the directions: no more than 2 gray values.
    EXPECT_LE(cv::norm(blur(image), expected, cv::NORM_INF), 2);
  }
}

TEST(PatchMoments, RotateWithTheImage) {
  const cv::Mat image = dead_leaves({201, 201}, 3);
  const std::vector<Corner> corner = {{100, 100, 0}};
  std::vector<PatchMoments> moments(1);
  patch_moments(image, corner, moments, best_cpu_path());
  const double before = moments[0].angle();
  for (double angle = -3; angle <= 3; angle += 0.37) {
    patch_moments(turned(image, {100, 100}, angle), corner, moments, best_cpu_path());
    EXPECT_LT(angle_between(moments[0].angle(), before + angle), 0.03) << angle;
  }
}

TEST(PatchMoments, OfAFlatPatchAreZero) {
  const cv::Mat image(40, 40, CV_8UC1, cv::Scalar(77));
  const std::vector<Corner> corner = {{20, 20, 0}};
  std::vector<PatchMoments> moments(1);
  patch_moments(image, corner, moments, best_cpu_path());
  EXPECT_EQ(moments[0], PatchMoments());
  EXPECT_EQ(moments[0].angle(), 0.0F);
}

TEST(BriefPattern, HasDistinctPairsWithinTheDisc) {
  const BriefPattern& p = brief_pattern();
  std::set<std::array<int, 4>> pairs;
  for (int i = 0; i < 256; ++i) {
    EXPECT_LE(p.ax[i] * p.ax[i] + p.ay[i] * p.ay[i], 225);
    EXPECT_LE(p.bx[i] * p.bx[i] + p.by[i] * p.by[i], 225);
    EXPECT_TRUE(p.ax[i] != p.bx[i] || p.ay[i] != p.by[i]);
    pairs.insert({p.ax[i], p.ay[i], p.bx[i], p.by[i]});
  }
  EXPECT_EQ(pairs.size(), 256U);
}

TEST_P(BriefOnPath, DescriptorsAreTheRotatedComparisons) {
  const cv::Mat image = dead_leaves({64, 64}, 4);
  const std::vector<Corner> corners = {{16, 16, 0}, {30, 35, 0}, {47, 47, 0}};
  const std::vector<PatchMoments> moments = {{1000, 0}, {0, -500}, {-300, 400}};
  std::vector<Descriptor> descriptors(corners.size());
  describe(image, corners, moments, descriptors, GetParam());
  const BriefPattern& p = brief_pattern();
  for (std::size_t k = 0; k < corners.size(); ++k) {
    const double c = std::cos(moments[k].angle()), s = std::sin(moments[k].angle());
    const auto gray = [&](double x, double y) {
      return image.at<std::uint8_t>(
          corners[k].y + static_cast<int>(std::floor(s * x + c * y + 0.5)),
          corners[k].x + static_cast<int>(std::floor(c * x - s * y + 0.5)));
    };
    int wrong = 0;
    for (int i = 0; i < 256; ++i) {
      const bool expected = gray(p.ax[i], p.ay[i]) < gray(p.bx[i], p.by[i]);
      const bool bit = ((descriptors[k][i / 64] >> (i % 64)) & 1) != 0;
      wrong += expected != bit ? 1 : 0;
    }
    // Sine and cosine have 10 bits, so a point on the border of two pixels may belong to either.
    EXPECT_LE(wrong, k == 2 ? 6 : 0);
  }
}

TEST(Brief, RecognizesARotatedPatch) {
  const cv::Mat image = dead_leaves({201, 201}, 5);
  const std::vector<Corner> corners = {{100, 100, 0}, {60, 90, 0}};
  Blur blur;
  const auto described = [&](const cv::Mat& view) {
    std::vector<PatchMoments> moments(2);
    std::vector<Descriptor> descriptors(2);
    patch_moments(view, corners, moments, best_cpu_path());
    describe(blur(view), corners, moments, descriptors, best_cpu_path());
    return descriptors;
  };
  const auto before = described(image);
  EXPECT_GT(distance(before[0], before[1]), 80);
  for (double angle = -3; angle <= 3; angle += 0.37) {
    EXPECT_LT(distance(described(turned(image, {100, 100}, angle))[0], before[0]), 40) << angle;
  }
}

}  // namespace
}  // namespace stillmap
