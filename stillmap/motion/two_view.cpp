// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/two_view.hpp"

#include <cmath>
#include <limits>
#include <utility>

#include <opencv2/calib3d.hpp>

namespace stillmap {
namespace {

/// Probability of at least one sample without outliers at which the search ends.
constexpr double kConfidence = 0.99;
/// Maximum number of samples.
constexpr int kMaxIterations = 500;
/// Seed of the generator in every call.
constexpr int kSeed = 1;

/// OpenCV's USAC framework (Raguram et al., TPAMI 2013), on one thread: MSAC's score, local
/// optimization, and a generator of its own that starts from the seed.
cv::UsacParams usac_params(double threshold) {
  cv::UsacParams params;
  params.threshold = threshold;
  params.confidence = kConfidence;
  params.maxIterations = kMaxIterations;
  params.randomGeneratorState = kSeed;
  params.isParallel = false;
  params.sampler = cv::SAMPLING_UNIFORM;
  params.score = cv::SCORE_METHOD_MSAC;
  params.loMethod = cv::LOCAL_OPTIM_INNER_LO;
  return params;
}

std::optional<cv::Matx33d> as_model(const cv::Mat& model) {
  if (model.rows != 3 || model.cols != 3 || !cv::checkRange(model)) return std::nullopt;
  return cv::Matx33d(model);
}

}  // namespace

std::optional<cv::Matx33d> find_homography(const PointPairs& pairs, double threshold) {
  constexpr std::size_t kFewest = 4;
  if (pairs.size() < kFewest) return std::nullopt;
  cv::Mat mask;
  return as_model(cv::findHomography(pairs.before, pairs.now, mask, usac_params(threshold)));
}

cv::Matx33d nearest_rigid(const cv::Matx33d& H, const std::vector<cv::Point2f>& points) {
  std::vector<std::pair<cv::Point2d, cv::Point2d>> pairs;  // p and H p
  cv::Point2d mean, mean_mapped;
  for (const cv::Point2f& point : points) {
    const cv::Vec3d mapped = H * cv::Vec3d(point.x, point.y, 1);
    if (mapped[2] == 0) continue;
    pairs.emplace_back(point, cv::Point2d(mapped[0] / mapped[2], mapped[1] / mapped[2]));
    mean += pairs.back().first;
    mean_mapped += pairs.back().second;
  }
  if (pairs.empty()) return cv::Matx33d::eye();
  mean /= static_cast<double>(pairs.size());
  mean_mapped /= static_cast<double>(pairs.size());
  double dot = 0, cross = 0;
  for (const auto& [point, mapped] : pairs) {
    const cv::Point2d a = point - mean, b = mapped - mean_mapped;
    dot += a.dot(b);
    cross += a.cross(b);
  }
  const double angle = std::atan2(cross, dot);
  const double c = std::cos(angle), s = std::sin(angle);
  return {c, -s, mean_mapped.x - c * mean.x + s * mean.y,
          s, c,  mean_mapped.y - s * mean.x - c * mean.y,
          0, 0,  1};
}

std::optional<cv::Matx33d> find_fundamental(const PointPairs& pairs, double threshold) {
  constexpr std::size_t kFewest = 8;
  if (pairs.size() < kFewest) return std::nullopt;
  cv::Mat mask;
  return as_model(cv::findFundamentalMat(pairs.before, pairs.now, mask, usac_params(threshold)));
}

double warp_error(const cv::Matx33d& H, cv::Point2f before, cv::Point2f now) {
  const cv::Vec3d p = H * cv::Vec3d(before.x, before.y, 1);
  if (p[2] == 0) return std::numeric_limits<double>::infinity();
  return std::hypot(p[0] / p[2] - now.x, p[1] / p[2] - now.y);
}

double epipolar_distance(const cv::Matx33d& F, cv::Point2f before, cv::Point2f now) {
  const cv::Vec3d line = F * cv::Vec3d(before.x, before.y, 1);
  const double length = std::hypot(line[0], line[1]);
  if (length == 0) return 0;
  return std::abs(line[0] * now.x + line[1] * now.y + line[2]) / length;
}

}  // namespace stillmap
