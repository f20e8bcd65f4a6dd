// SPDX-License-Identifier: Apache-2.0
/// Learns the 256 comparisons of the BRIEF descriptor and prints them as brief_pattern_table.inc,
/// after Rublee et al. 2011, section 4.3: a greedy search for tests of high variance and low
/// correlation. In addition, tests are ranked by how rarely their bit flips between two views of
/// the same corner, relative to how often it differs between two corners. The images are
/// dead-leaves images; the views differ by rotation, scale, tilt, noise and brightness, and by the
/// detector's own errors of position, level and angle. Deterministic.
#include "stillmap/feature/dead_leaves.hpp"
#include "stillmap/feature/orb_extractor.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdio>
#include <set>
#include <vector>

#include "commands.hpp"

namespace stillmap::lab {
namespace {

constexpr int kRadius = 15, kSide = 2 * kRadius + 1;
const cv::Size kSize(640, 480);

struct PatternArguments {
  int images = 60;                 ///< training images
  std::size_t candidates = 30000;  ///< random tests to choose from
  std::size_t tests = 256;         ///< tests to choose
};

/// Blurred patch around a corner, rotated upright: the input of the descriptor.
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

/// Returns the patches of all keypoints of an image.
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

/// Simulates a camera: changes the brightness, adds noise, and defocuses one of three images.
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

/// Adds the patches of keypoints that correspond in place and scale between two views.
void add_pairs_of_image(std::uint64_t seed, PatchPairs& pairs) {
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

/// One comparison of two pixels, and its outcome on all training patches.
struct Test {
  int ax, ay, bx, by;
  std::vector<std::uint64_t> bits;  // on the first views
  double mean = 0;                  // share of ones
  double unreliability = 0;         // flips between views, over differences between corners

  bool outcome(const Patch& p) const {
    return p[(ay + kRadius) * kSide + ax + kRadius] < p[(by + kRadius) * kSide + bx + kRadius];
  }
};

std::vector<Test> random_tests(std::size_t count) {
  TestRandom random(7);
  const auto point = [&] {
    for (;;) {
      const int x = random.below(kSide) - kRadius, y = random.below(kSide) - kRadius;
      if (x * x + y * y <= kRadius * kRadius) return cv::Point(x, y);
    }
  };
  std::set<std::array<int, 4>> seen;
  std::vector<Test> tests;
  while (tests.size() < count) {
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

/// Returns the absolute correlation of the bits of two tests (the phi coefficient).
double correlation(const Test& a, const Test& b, std::size_t count) {
  int both = 0;
  for (std::size_t w = 0; w < a.bits.size(); ++w) both += std::popcount(a.bits[w] & b.bits[w]);
  const double covariance =
      static_cast<double>(both) / static_cast<double>(count) - a.mean * b.mean;
  return std::abs(covariance) / std::sqrt(a.mean * (1 - a.mean) * b.mean * (1 - b.mean));
}

/// Returns the most reliable tests, with the lowest bound on their correlations that leaves enough
/// of them.
std::vector<const Test*> choose(const std::vector<Test>& sorted, std::size_t count,
                                std::size_t wanted) {
  for (double limit = 0.2;; limit *= 1.05) {
    std::vector<const Test*> chosen;
    for (const Test& test : sorted) {
      if (std::abs(test.mean - 0.5) > 0.2) continue;
      const bool fresh = std::none_of(chosen.begin(), chosen.end(), [&](const Test* other) {
        return correlation(test, *other, count) > limit;
      });
      if (fresh) chosen.push_back(&test);
      if (chosen.size() == wanted) {
        std::fprintf(stderr, "correlations up to %.3f\n", limit);
        return chosen;
      }
    }
  }
}

void learn(const PatternArguments& arguments) {
  PatchPairs pairs;
  for (int i = 0; i < arguments.images; ++i)
    add_pairs_of_image(static_cast<std::uint64_t>(i), pairs);
  std::fprintf(stderr, "%zu pairs of views\n", pairs.first.size());
  auto tests = random_tests(arguments.candidates);
  for (Test& test : tests) evaluate(test, pairs);
  std::stable_sort(tests.begin(), tests.end(),
                   [](const Test& a, const Test& b) { return a.unreliability < b.unreliability; });
  std::printf("// Made by stillmap_lab brief-pattern: ax, ay, bx, by of each comparison.\n");
  for (const Test* t : choose(tests, pairs.first.size(), arguments.tests)) {
    std::printf("{%d, %d, %d, %d},\n", t->ax, t->ay, t->bx, t->by);
  }
}

}  // namespace

void add_brief_pattern_command(CLI::App& app) {
  auto arguments = std::make_shared<PatternArguments>();
  CLI::App* command = app.add_subcommand(
      "brief-pattern", "learn the comparisons of the descriptor: feature/brief_pattern_table.inc");
  command->add_option("--images", arguments->images, "training images")->capture_default_str();
  command->add_option("--candidates", arguments->candidates, "random comparisons to choose from")
      ->capture_default_str();
  command->add_option("--tests", arguments->tests, "comparisons to choose")->capture_default_str();
  command->callback([arguments] { learn(*arguments); });
}

}  // namespace stillmap::lab
