// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/orb_extractor.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/feature/dead_leaves.hpp"
#include "stillmap/feature/matching.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <set>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Size kSize(640, 480);

/// Two views of one image, both sampled from a finer, smooth copy: pixel p of `a` is pixel H p of
/// `b`.
struct ViewPair {
  cv::Mat a, b;
  cv::Matx33d H;

  cv::Point2d in_b(const Keypoint& k) const {
    const cv::Vec3d p = H * cv::Vec3d(k.u, k.v, 1);
    return {p[0] / p[2], p[1] / p[2]};
  }
};

ViewPair make_views(const cv::Matx33d& H, std::uint64_t seed) {
  constexpr double kFiner = 2;
  cv::Mat source = dead_leaves({2 * 2 * kSize.width, 2 * 2 * kSize.height}, seed);
  cv::GaussianBlur(source, source, {0, 0}, 1);
  // Pixel p of `a` is pixel 2 p + (kSize / 2) * 2 of the source: `a` shows its center.
  const cv::Matx33d source_from_a(kFiner, 0, kSize.width, 0, kFiner, kSize.height, 0, 0, 1);
  ViewPair views;
  views.H = H;
  const int how = cv::INTER_CUBIC | cv::WARP_INVERSE_MAP;
  cv::warpPerspective(source, views.a, source_from_a, kSize, how);
  cv::warpPerspective(source, views.b, source_from_a * H.inv(), kSize, how);
  return views;
}

/// Rotation by `angle` (from x to y) and scaling by `scale` around the image center, with a slight
/// tilt.
cv::Matx33d similarity(double angle, double scale, double tilt = 0) {
  const double c = scale * std::cos(angle), s = scale * std::sin(angle);
  const double cx = kSize.width / 2.0, cy = kSize.height / 2.0;
  const cv::Matx33d from_center(1, 0, cx, 0, 1, cy, 0, 0, 1),
      to_center(1, 0, -cx, 0, 1, -cy, 0, 0, 1);
  return from_center * cv::Matx33d(c, -s, 0, s, c, 0, tilt, 0, 1) * to_center;
}

double level_scale(const Keypoint& k) { return std::pow(1.2, k.level); }

struct MatchQuality {
  int matches = 0;
  double inliers = 0;      // Share of matches within 3 pixels of their level [0..1].
  double rms = 0;          // RMS of the inliers at the two finest levels [pixels].
  double angle_error = 0;  // Median angle error [rad].
  // Share of a's keypoints that b has within 1.5 pixels of their level [0..1].
  double repeatability = 0;
};

MatchQuality match_quality(const ViewPair& views, const OrbOptions& options, double angle) {
  OrbExtractor extractor(options);
  const Features a = extractor.extract(views.a), b = extractor.extract(views.b);
  MatchQuality q;
  double sum = 0;
  int fine = 0, inliers = 0;
  std::vector<double> angle_errors;
  const auto matches = match_brute_force(a.descriptors, b.descriptors, {.max_distance = 64});
  for (const DescriptorMatch& m : matches) {
    const Keypoint &ka = a.keypoints[m.a], &kb = b.keypoints[m.b];
    const double error = cv::norm(views.in_b(ka) - cv::Point2d(kb.u, kb.v));
    if (error > 3 * level_scale(kb)) continue;
    ++inliers;
    angle_errors.push_back(std::abs(std::remainder(kb.angle - ka.angle - angle, 2 * CV_PI)));
    if (ka.level > 1 || kb.level > 1) continue;
    sum += error * error;
    ++fine;
  }
  q.matches = static_cast<int>(matches.size());
  q.inliers = inliers / std::max(1.0, static_cast<double>(matches.size()));
  q.rms = std::sqrt(sum / std::max(1, fine));
  if (!angle_errors.empty()) {
    const auto middle = angle_errors.begin() + static_cast<std::ptrdiff_t>(angle_errors.size() / 2);
    std::nth_element(angle_errors.begin(), middle, angle_errors.end());
    q.angle_error = *middle;
  }
  int visible = 0, repeated = 0;
  for (const Keypoint& k : a.keypoints) {
    const cv::Point2d p = views.in_b(k);
    if (!cv::Rect(60, 60, kSize.width - 120, kSize.height - 120).contains(p)) continue;
    ++visible;
    bool found = false;
    const auto radius = static_cast<float>(1.5 * level_scale(k));
    b.grid.for_each_near(static_cast<float>(p.x), static_cast<float>(p.y), radius, 0, 7,
                         [&](std::uint32_t) { found = true; });
    repeated += found ? 1 : 0;
  }
  q.repeatability = repeated / std::max(1.0, static_cast<double>(visible));
  return q;
}

struct View {
  const char* name;
  double angle, scale, tilt;
};

class OrbOnViews : public testing::TestWithParam<View> {};
INSTANTIATE_TEST_SUITE_P(Views, OrbOnViews,
                         testing::Values(View{"Shift", 0, 1.0, 0}, View{"Turned", 0.6, 1.0, 0},
                                         View{"UpsideDown", 3.0, 1.0, 0},
                                         View{"Closer", 0.1, 1.3, 0},
                                         View{"Farther", -0.1, 0.77, 0},
                                         View{"Tilted", 0.2, 1.05, 3e-4}),
                         [](const auto& suite) { return suite.param.name; });

TEST_P(OrbOnViews, DetectsAndMatchesTheSameCorners) {
  const View& view = GetParam();
  cv::Matx33d H = similarity(view.angle, view.scale, view.tilt);
  H(0, 2) += 3.37;  // Fractional pixels.
  H(1, 2) -= 2.61;
  const MatchQuality q = match_quality(make_views(H, 11), {}, view.angle);
  RecordProperty("matches", q.matches);
  EXPECT_GT(q.matches, 150);
  EXPECT_GT(q.inliers, 0.95);
  EXPECT_GT(q.repeatability, 0.5);
  EXPECT_LT(q.rms, 0.6);
  EXPECT_LT(q.angle_error, 0.1);
}

TEST(OrbExtractor, RefinementReducesTheError) {
  const ViewPair views = make_views(similarity(0.35, 1.07), 12);
  const double coarse = match_quality(views, {.subpixel = false}, 0.35).rms;
  const double fine = match_quality(views, {.subpixel = true}, 0.35).rms;
  EXPECT_LT(fine, 0.8 * coarse);
}

/// Expects bit-identical features.
void expect_same(const Features& a, const Features& b) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint &p = a.keypoints[i], &q = b.keypoints[i];
    ASSERT_EQ(std::tie(p.u, p.v, p.angle, p.response, p.depth, p.level),
              std::tie(q.u, q.v, q.angle, q.response, q.depth, q.level));
  }
  ASSERT_EQ(a.descriptors, b.descriptors);
}

TEST(OrbExtractor, GivesTheSameBitsOnEveryPath) {
  for (const cv::Size size : {kSize, cv::Size(321, 203)}) {
    const cv::Mat image = dead_leaves(size, 13);
    const Features portable = OrbExtractor({}, CpuPath::kPortable).extract(image);
    ASSERT_GT(portable.size(), 300U);
    expect_same(OrbExtractor({}, best_cpu_path()).extract(image), portable);
  }
}

TEST(OrbExtractor, DoesNotDependOnEarlierImages) {
  const cv::Mat image = dead_leaves(kSize, 14);
  const Features fresh = OrbExtractor().extract(image);
  OrbExtractor used;
  used.extract(dead_leaves({900, 700}, 15));
  used.extract(dead_leaves({200, 300}, 16));
  used.extract(cv::Mat());
  expect_same(used.extract(image), fresh);
  expect_same(used.extract(image), fresh);
}

TEST(OrbExtractor, AcceptsPartsOfLargerImages) {
  const cv::Mat large = dead_leaves({900, 700}, 17);
  const cv::Mat part = large(cv::Rect(100, 50, kSize.width, kSize.height));
  expect_same(OrbExtractor().extract(part), OrbExtractor().extract(part.clone()));
}

TEST(OrbExtractor, ReturnsTheWantedNumberOverAllLevels) {
  const Features features = OrbExtractor({.keypoints = 777}).extract(dead_leaves(kSize, 18));
  EXPECT_EQ(features.size(), 777U);
  EXPECT_EQ(features.descriptors.size(), 777U);
  std::array<int, 8> per_level{};
  for (const Keypoint& k : features.keypoints) ++per_level[k.level];
  for (int level = 0; level + 1 < 8; ++level) {
    EXPECT_NEAR(per_level[level + 1], per_level[level] / 1.2, 2) << level;
  }
}

int occupied_cells(const Features& features) {
  std::set<int> cells;
  for (const Keypoint& k : features.keypoints) {
    const int x = static_cast<int>(k.u - 20) / 40, y = static_cast<int>(k.v - 20) / 40;
    if (k.u >= 20 && x < 15 && k.v >= 20 && y < 11) cells.insert(15 * y + x);
  }
  return static_cast<int>(cells.size());
}

TEST(OrbExtractor, FewerKeypointsEqualThoseOfASmallerExtractor) {
  const cv::Mat image = dead_leaves(kSize, 19);
  OrbExtractor extractor;
  const Features all = extractor.extract(image);
  expect_same(extractor.extract(image, {}, 300), OrbExtractor({.keypoints = 300}).extract(image));
  expect_same(extractor.extract(image), all);
}

TEST(OrbExtractor, CoversLowContrastParts) {
  // All but the left fifth has a tenth of the contrast, so almost no corner exceeds the first
  // threshold there.
  cv::Mat image = dead_leaves(kSize, 19);
  cv::Mat faint = image(cv::Rect(128, 0, 512, 480));
  faint.convertTo(faint, CV_8U, 0.12, 110);
  EXPECT_GE(occupied_cells(OrbExtractor().extract(image)), 140);  // of 165 cells
  EXPECT_LE(occupied_cells(OrbExtractor({.fast_threshold_low = 20}).extract(image)), 100);
}

TEST(OrbExtractor, LocalizesACornerWithSubpixelAccuracy) {
  // A bright square with edges between pixels; its blurred corner is at (200.25, 150.25).
  cv::Mat fine(4 * 480, 4 * 640, CV_8UC1, cv::Scalar(50));
  fine(cv::Rect(803, 603, 400, 400)) = 220;
  cv::Mat image;
  cv::resize(fine, image, kSize, 0, 0, cv::INTER_AREA);
  const Features features = OrbExtractor().extract(image);
  for (int level = 0; level < 5; ++level) {
    bool found = false;
    const auto reach = static_cast<float>(1.5 * std::pow(1.2, level));
    features.grid.for_each_near(200.25F, 150.25F, reach, level, level,
                                [&](std::uint32_t) { found = true; });
    EXPECT_TRUE(found) << level;
  }
}

TEST(OrbExtractor, FindsNothingWithoutTexture) {
  OrbExtractor extractor;
  for (const cv::Mat& image :
       {cv::Mat(), cv::Mat(480, 640, CV_8UC1, cv::Scalar(90)), dead_leaves({1, 1}, 20),
        dead_leaves({32, 32}, 20), dead_leaves({640, 20}, 20)}) {
    EXPECT_EQ(extractor.extract(image).size(), 0U);
  }
  EXPECT_EQ(OrbExtractor({.keypoints = 0}).extract(dead_leaves(kSize, 20)).size(), 0U);
  EXPECT_NO_THROW(extractor.extract(dead_leaves({33, 33}, 20)));
  EXPECT_NO_THROW(extractor.extract(dead_leaves({2000, 40}, 20)));
}

TEST(OrbExtractor, FindsNothingAtIgnoredPixelsAndAsMuchElsewhere) {
  const cv::Mat image = make_views(similarity(0, 1), 7).a;
  cv::Mat ignored(image.size(), CV_8UC1, cv::Scalar(0));
  ignored.colRange(200, 440).setTo(1);
  OrbExtractor extractor;
  const std::size_t all = extractor.extract(image).size();
  const Features features = extractor.extract(image, {}, std::nullopt, ignored);
  EXPECT_GT(features.size(), all * 9 / 10) << "others take the places of the ignored ones";
  for (const Keypoint& k : features.keypoints) {
    const double outside = std::max(200 - k.u, k.u - 439.0F);
    EXPECT_GE(outside, 2 * level_scale(k)) << "the circle of 3 pixels, with half a pixel refined";
  }
  EXPECT_EQ(extractor.extract(image).size(), all) << "the next image is used as a whole";
}

TEST(OrbExtractor, RejectsWrongImages) {
  OrbExtractor extractor;
  const cv::Mat gray = dead_leaves({100, 80}, 21);
  EXPECT_THROW(extractor.extract(cv::Mat(80, 100, CV_8UC3)), Error);
  EXPECT_THROW(extractor.extract(gray, cv::Mat(80, 100, CV_16UC1)), Error);
  EXPECT_THROW(extractor.extract(gray, cv::Mat(60, 100, CV_32FC1)), Error);
}

TEST(DepthAt, IsThatOfTheNearestPixel) {
  cv::Mat depth(20, 30, CV_32FC1, cv::Scalar(2));
  depth.at<float>(7, 9) = 2.05F;
  EXPECT_EQ(depth_at(depth, 9.4F, 6.6F, {}), 2.05F);
  EXPECT_EQ(depth_at(depth, 9.6F, 6.6F, {}), 2.0F);
  EXPECT_EQ(depth_at(depth, -0.4F, 19.4F, {}), 2.0F);
  EXPECT_EQ(depth_at({}, 5, 5, {}), 0.0F);
}

TEST(DepthAt, IsUnknownIfThePixelIsUnknown) {
  for (const float hole : {0.0F, -1.0F, std::nanf(""), HUGE_VALF}) {
    cv::Mat depth(20, 30, CV_32FC1, cv::Scalar(2));
    depth.at<float>(7, 9) = hole;
    EXPECT_EQ(depth_at(depth, 9, 7, {}), 0.0F);
    EXPECT_EQ(depth_at(depth, 10, 7, {}), 2.0F);  // A neighboring hole is no edge.
  }
}

TEST(DepthAt, IgnoresStepsThatNoiseReaches) {
  cv::Mat depth(20, 30, CV_32FC1, cv::Scalar(2));
  depth.colRange(10, 30) = 2.3;
  const auto limit = [](double quadratic) { return DepthEdge{.noise = {.quadratic = quadratic}}; };
  EXPECT_EQ(depth_at(depth, 10, 7, limit(0.07)), 2.0F);  // .28 m at 2 m
  EXPECT_EQ(depth_at(depth, 10, 7, limit(0.08)), 2.3F);  // .32 m
}

TEST(DepthAt, UsesTheNearerSideOfAnEdge) {
  cv::Mat depth(20, 30, CV_32FC1, cv::Scalar(2));
  depth.colRange(10, 30) = 3;
  EXPECT_EQ(depth_at(depth, 9, 7, {}), 2.0F);
  EXPECT_EQ(depth_at(depth, 10, 7, {}), 2.0F);
  EXPECT_EQ(depth_at(depth, 11, 7, {}), 3.0F);
}

}  // namespace
}  // namespace stillmap
