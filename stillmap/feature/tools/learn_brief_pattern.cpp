// SPDX-License-Identifier: Apache-2.0
/// Learns the 256 comparisons of the BRIEF descriptor and prints them as brief_pattern_table.inc:
///
///     ninja -C build/release stillmap_learn_brief_pattern
///     build/release/.../stillmap_learn_brief_pattern > stillmap/feature/brief_pattern_table.inc
///
/// After Rublee et al. 2011, section 4.3 (a greedy search for tests of high variance and low
/// correlation), with one addition: the training material is pairs of views of the same corner,
/// so that tests can be ranked by how rarely their bit flips between two views, for how often it
/// differs between two corners. Pictures are dead-leaves images; the views differ by a turn, a
/// magnification, a tilt, noise and brightness, and by what our own detector makes of them (place,
/// level, angle). Deterministic.
#include "stillmap/feature/dead_leaves.hpp"
#include "stillmap/feature/orb_extractor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <set>
#include <vector>

namespace stillmap {
namespace {

constexpr int kRadius = 15, kSide = 2 * kRadius + 1;
constexpr int kPictures = 60, kCandidates = 30000, kTests = 256;
const cv::Size kSize(640, 480);

/// What the descriptor can see of a corner: the blurred patch, turned upright.
using Patch = std::array<std::uint8_t, kSide * kSide>;

struct PatchPairs {
  std::vector<Patch> first, second;
};

Patch upright_patch(const cv::Mat& blurred, cv::Point center, double angle) {
  Patch patch{};
  const double c = std::cos(angle), s = std::sin(angle);
  for (int y = -kRadius; y <= kRadius; ++y) {
    for (int x = -kRadius; x <= kRadius; ++x) {
      if (x * x + y * y > kRadius * kRadius) continue;
      const int u = center.x + static_cast<int>(std::floor(c * x - s * y + 0.5));
      const int v = center.y + static_cast<int>(std::floor(s * x + c * y + 0.5));
      patch[(y + kRadius) * kSide + x + kRadius] = blurred.at<std::uint8_t>(v, u);
    }
  }
  return patch;
}

/// The patches of all keypoints of an image.
std::vector<Patch> patches_of(const cv::Mat& image, const Features& features,
                              const OrbOptions& options) {
  ImagePyramid pyramid;
  pyramid.build(image, options.pyramid(), 2 * options.border + 1);
  std::vector<cv::Mat> blurred;
  Blur blur;
  for (int level = 0; level < pyramid.levels(); ++level)
    blurred.push_back(blur(pyramid[level]).clone());
  std::vector<Patch> patches;
  for (const Keypoint& k : features.keypoints) {
    const cv::Size size = pyramid[k.level].size();
    const cv::Point p(static_cast<int>(std::lround((k.u + 0.5) * size.width / image.cols - 0.5)),
                      static_cast<int>(std::lround((k.v + 0.5) * size.height / image.rows - 0.5)));
    patches.push_back(upright_patch(blurred[k.level], p, k.angle));
  }
  return patches;
}

cv::Matx33d random_warp(TestRandom& random) {
  const double angle = random.uniform(-0.5, 0.5), scale = std::exp(random.uniform(-0.25, 0.25));
  const double c = scale * std::cos(angle), s = scale * std::sin(angle);
  const cv::Matx33d to_center(1, 0, -320, 0, 1, -240, 0, 0, 1);
  const cv::Matx33d tilt(1, random.uniform(-0.1, 0.1), 0, 0, random.uniform(0.85, 1.15), 0,
                         random.uniform(-3e-4, 3e-4), random.uniform(-3e-4, 3e-4), 1);
  return to_center.inv() * cv::Matx33d(c, -s, 0, s, c, 0, 0, 0, 1) * tilt * to_center;
}

/// A camera's view: other brightness, noise, at times out of focus.
void photograph(cv::Mat& image, TestRandom& random) {
  if (random.below(3) == 0) cv::GaussianBlur(image, image, {0, 0}, random.uniform(0.5, 1.5));
  const double gain = random.uniform(0.3, 1), offset = random.uniform(0, 255 * (1 - gain));
  const double noise = random.uniform(1, 6);
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) {
      std::uint8_t& pixel = image.at<std::uint8_t>(y, x);
      const double bell = random.uniform(-1, 1) + random.uniform(-1, 1) + random.uniform(-1, 1);
      pixel = cv::saturate_cast<std::uint8_t>(offset + gain * pixel + noise * bell);
    }
  }
}

/// Keypoints of two views that lie on the same place at the same magnification.
void add_pairs_of_picture(std::uint64_t seed, PatchPairs& pairs) {
  TestRandom random(1000 + seed);
  cv::Mat first = dead_leaves(kSize, seed), second;
  const cv::Matx33d H = random_warp(random);
  cv::warpPerspective(first, second, H, kSize, cv::INTER_CUBIC, cv::BORDER_REFLECT_101);
  photograph(first, random);
  photograph(second, random);

  const OrbOptions options;
  OrbExtractor extractor(options);
  const Features a = extractor.extract(first), b = extractor.extract(second);
  const auto patches_a = patches_of(first, a, options), patches_b = patches_of(second, b, options);
  const double magnification = std::sqrt(std::abs(cv::determinant(H)));
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint& k = a.keypoints[i];
    const cv::Vec3d p = H * cv::Vec3d(k.u, k.v, 1);
    const int level =
        k.level + static_cast<int>(std::lround(std::log(magnification) / std::log(1.2)));
    const auto radius = static_cast<float>(1.5 * std::pow(1.2, level));
    int found = -1;
    b.grid.for_each_near(static_cast<float>(p[0] / p[2]), static_cast<float>(p[1] / p[2]), radius,
                         level, level, [&](std::uint32_t j) { found = static_cast<int>(j); });
    if (found < 0) continue;
    pairs.first.push_back(patches_a[i]);
    pairs.second.push_back(patches_b[found]);
  }
}

/// One comparison, and its outcome on all training patches.
struct Test {
  int ax, ay, bx, by;
  std::vector<std::uint64_t> bits;  // on the first views
  double mean = 0;                  // share of ones
  double unreliability = 0;         // flips between views, over differences between corners

  bool outcome(const Patch& p) const {
    return p[(ay + kRadius) * kSide + ax + kRadius] < p[(by + kRadius) * kSide + bx + kRadius];
  }
};

std::vector<Test> random_tests() {
  TestRandom random(7);
  const auto point = [&] {
    for (;;) {
      const int x = random.below(kSide) - kRadius, y = random.below(kSide) - kRadius;
      if (x * x + y * y <= kRadius * kRadius) return cv::Point(x, y);
    }
  };
  std::set<std::array<int, 4>> seen;
  std::vector<Test> tests;
  while (tests.size() < kCandidates) {
    const cv::Point a = point(), b = point();
    const int dx = a.x - b.x, dy = a.y - b.y;
    if (dx * dx + dy * dy < 4 || seen.contains({b.x, b.y, a.x, a.y})) continue;
    if (seen.insert({a.x, a.y, b.x, b.y}).second) tests.push_back({a.x, a.y, b.x, b.y, {}});
  }
  return tests;
}

void evaluate(Test& test, const PatchPairs& pairs) {
  const std::size_t count = pairs.first.size();
  test.bits.assign((count + 63) / 64, 0);
  int ones = 0, flips = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const bool first = test.outcome(pairs.first[i]), second = test.outcome(pairs.second[i]);
    if (first) test.bits[i / 64] |= 1ULL << (i % 64);
    ones += first ? 1 : 0;
    flips += first != second ? 1 : 0;
  }
  test.mean = static_cast<double>(ones) / static_cast<double>(count);
  const double differences = 2 * test.mean * (1 - test.mean);
  test.unreliability = flips / (static_cast<double>(count) * differences + 1);
}

/// Correlation of two tests' bits (the phi coefficient), without its sign.
double correlation(const Test& a, const Test& b, std::size_t count) {
  int both = 0;
  for (std::size_t w = 0; w < a.bits.size(); ++w) both += std::popcount(a.bits[w] & b.bits[w]);
  const double covariance =
      static_cast<double>(both) / static_cast<double>(count) - a.mean * b.mean;
  return std::abs(covariance) / std::sqrt(a.mean * (1 - a.mean) * b.mean * (1 - b.mean));
}

/// The most reliable tests of which no two are correlated more than need be.
std::vector<const Test*> choose(const std::vector<Test>& sorted, std::size_t count) {
  for (double limit = 0.2;; limit *= 1.05) {
    std::vector<const Test*> chosen;
    for (const Test& test : sorted) {
      if (std::abs(test.mean - 0.5) > 0.2) continue;
      const bool fresh = std::none_of(chosen.begin(), chosen.end(), [&](const Test* other) {
        return correlation(test, *other, count) > limit;
      });
      if (fresh) chosen.push_back(&test);
      if (chosen.size() == kTests) {
        std::fprintf(stderr, "correlations up to %.3f\n", limit);
        return chosen;
      }
    }
  }
}

}  // namespace
}  // namespace stillmap

int main() {
  using namespace stillmap;
  cv::setNumThreads(1);
  PatchPairs pairs;
  for (int i = 0; i < kPictures; ++i) add_pairs_of_picture(static_cast<std::uint64_t>(i), pairs);
  std::fprintf(stderr, "%zu pairs of views\n", pairs.first.size());
  auto tests = random_tests();
  for (Test& test : tests) evaluate(test, pairs);
  std::stable_sort(tests.begin(), tests.end(),
                   [](const Test& a, const Test& b) { return a.unreliability < b.unreliability; });
  std::printf("// Made by tools/learn_brief_pattern.cpp: ax, ay, bx, by of each comparison.\n");
  for (const Test* t : choose(tests, pairs.first.size())) {
    std::printf("{%d, %d, %d, %d},\n", t->ax, t->ay, t->bx, t->by);
  }
}
