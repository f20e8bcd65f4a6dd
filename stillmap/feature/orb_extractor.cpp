// SPDX-License-Identifier: Apache-2.0
#include "stillmap/feature/orb_extractor.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/span_names.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/subpixel.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <string>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Side of the cells in which corners are searched again with the low threshold [pixels of the
/// level].
constexpr int kCell = 30;
/// The range of the nine depths around a keypoint exceeds six standard deviations of one with a
/// probability below .001.
constexpr double kEdgeSigmas = 6;
/// Radius of the circle of the FAST test [pixels of the level].
constexpr float kCircle = 3;

void require(bool condition, const char* problem, const char* where, const char* fix) {
  if (!condition) throw Error(problem, where, fix);
}

/// Returns a geometric series with ratio 1 / scale_factor from level to level and the sum
/// `keypoints`.
std::vector<int> shares(const OrbOptions& options, int keypoints) {
  const double q = 1 / options.scale_factor;
  const double first = keypoints * (1 - q) / (1 - std::pow(q, options.levels));
  std::vector<int> share(options.levels);
  int rest = keypoints;
  for (int level = 0; level < options.levels; ++level) {
    const bool last = level + 1 == options.levels;
    share[level] =
        last ? rest : std::min(rest, static_cast<int>(std::lround(first * std::pow(q, level))));
    rest -= share[level];
  }
  return share;
}

void check_images(const cv::Mat& gray, const cv::Mat& depth, const cv::Mat& ignored) {
  require(gray.empty() || gray.type() == CV_8UC1, "the image is not 8-bit gray",
          "OrbExtractor::extract", "convert it with cv::cvtColor(..., cv::COLOR_BGR2GRAY)");
  require(depth.empty() || depth.type() == CV_32FC1, "the depth image is not 32-bit float",
          "OrbExtractor::extract",
          "convert it to meters with depth.convertTo(..., CV_32F, 1 / depth_factor)");
  require(depth.empty() || depth.size() == gray.size(),
          "the depth image has another size than the gray one", "OrbExtractor::extract",
          "register the depth to the color image");
  require(ignored.empty() || (ignored.type() == CV_8UC1 && ignored.size() == gray.size()),
          "the image of ignored pixels is not 8-bit with one channel, or of another size",
          "OrbExtractor::extract", "make it from RgbdFrame::ignored");
}

bool known(float depth) { return std::isfinite(depth) && depth > 0; }

}  // namespace

DepthEdge depth_edge_of(const DepthSensor& sensor) {
  return {.noise = sensor.tolerance<double>(kEdgeSigmas, 0)};
}

float depth_at(const cv::Mat& depth, float u, float v, const DepthEdge& edge) {
  if (depth.empty()) return 0;
  const int x = std::clamp(static_cast<int>(std::lround(u)), 0, depth.cols - 1);
  const int y = std::clamp(static_cast<int>(std::lround(v)), 0, depth.rows - 1);
  const float center = depth.at<float>(y, x);
  if (!known(center)) return 0;
  float nearest = center, farthest = center;
  for (int j = std::max(y - 1, 0); j <= std::min(y + 1, depth.rows - 1); ++j) {
    for (int i = std::max(x - 1, 0); i <= std::min(x + 1, depth.cols - 1); ++i) {
      const float d = depth.at<float>(j, i);
      if (!known(d)) continue;
      nearest = std::min(nearest, d);
      farthest = std::max(farthest, d);
    }
  }
  return edge.between(nearest, farthest) ? nearest : center;
}

OrbExtractor::OrbExtractor(const OrbOptions& options, CpuPath path)
    : options_(options),
      path_(path),
      pyramid_(path),
      detector_(options.fast_threshold, options.fast_threshold_low, kCell, options.border, path),
      blur_(path) {}

Features OrbExtractor::extract(const cv::Mat& gray, const cv::Mat& depth,
                               std::optional<int> keypoints, const cv::Mat& ignored) {
  const TraceScope scope(span::kFeatures);
  check_images(gray, depth, ignored);
  ignore(ignored);
  const int most = keypoints.value_or(options_.keypoints);
  Features features;
  if (gray.empty()) return features;
  features.keypoints.reserve(most);
  features.descriptors.reserve(most);

  pyramid_.build(gray, options_.pyramid(), 2 * options_.border + 1);
  const std::vector<int> share = shares(options_, most);
  int wanted = 0;  // Remaining keypoints of finer levels plus this level's share.
  for (int level = 0; level < pyramid_.levels(); ++level) {
    const std::size_t before = features.size();
    wanted += share[level];
    extract_level(level, wanted, features);
    wanted -= static_cast<int>(features.size() - before);
  }
  const TraceScope depths("depth");
  for (Keypoint& k : features.keypoints) k.depth = depth_at(depth, k.u, k.v, options_.depth_edge);
  features.grid = KeypointGrid(features.keypoints, gray.cols, gray.rows);
  return features;
}

/// Computes the distances only if the mask has changed; frames of one camera share one mask.
void OrbExtractor::ignore(const cv::Mat& pixels) {
  if (pixels.data == ignored_.data) return;
  ignored_ = pixels;
  distance_.release();
  if (!pixels.empty()) cv::distanceTransform(pixels == 0, distance_, cv::DIST_L2, cv::DIST_MASK_5);
}

/// Returns the corners of a level whose FAST circle contains no ignored pixel.
const std::vector<Corner>& OrbExtractor::used(const std::vector<Corner>& corners, int level) {
  if (distance_.empty()) return corners;
  const float radius = kCircle * static_cast<float>(options_.pyramid().scale(level));
  used_.clear();
  std::copy_if(corners.begin(), corners.end(), std::back_inserter(used_), [&](const Corner& c) {
    const cv::Point2f p = pyramid_.to_full_size(cv::Point(c.x, c.y), level);
    return distance_.at<float>(std::clamp(cvRound(p.y), 0, distance_.rows - 1),
                               std::clamp(cvRound(p.x), 0, distance_.cols - 1)) > radius;
  });
  return used_;
}

void OrbExtractor::extract_level(int level, int wanted, Features& features) {
  const cv::Mat& image = pyramid_[level];
  const int border = options_.border;
  const cv::Rect area(border, border, image.cols - 2 * border, image.rows - 2 * border);
  const std::vector<Corner>& corners =
      spreader_.spread(used(detector_.detect(image), level), area, wanted);
  if (corners.empty()) return;

  moments_.resize(corners.size());
  patch_moments(image, corners, moments_, path_);
  const std::size_t first = features.descriptors.size();
  features.descriptors.resize(first + corners.size());
  describe(blur_(image), corners, moments_, std::span(features.descriptors).subspan(first), path_);

  for (std::size_t i = 0; i < corners.size(); ++i) {
    const Corner& c = corners[i];
    const cv::Point2f on_level =
        options_.subpixel ? refine_corner(detector_.scores(), c) : cv::Point2f(cv::Point(c.x, c.y));
    const cv::Point2f p = pyramid_.to_full_size(on_level, level);
    features.keypoints.push_back({p.x, p.y, moments_[i].angle(), static_cast<float>(c.score), 0,
                                  static_cast<std::uint8_t>(level)});
  }
}

}  // namespace stillmap
