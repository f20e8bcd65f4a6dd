// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_agreement.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Least number of counted masks and of pixels on an outline.
constexpr std::size_t kMinMasks = 10;
constexpr int kMinOutline = 50;
/// A depth is a jump if it is farther than the nearest one around by this share and this much [m].
constexpr double kJumpShare = 0.1, kJump = 0.05;
/// Share of pixels without depth around a pixel from which it is at the edge of a hole.
constexpr double kHole = 0.25;
/// Share of the bounding box above which a region is a rectangle.
constexpr double kRectangle = 0.95;

/// Returns the pixels with a jump of the depth, or a hole, at most `radius` pixels away.
cv::Mat1b jumps_within(const cv::Mat1f& depth, int radius) {
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  const cv::Mat1b unknown = depth <= 0;
  cv::Mat1f nearest = depth.clone(), farthest, unknown_share;
  constexpr float kNone = 1e9F;
  nearest.setTo(kNone, unknown);
  const cv::Mat square = cv::Mat::ones(window, CV_8U);
  cv::erode(nearest, nearest, square);
  cv::dilate(depth, farthest, square);
  cv::boxFilter(unknown / 255, unknown_share, CV_32F, window);
  const cv::Mat1f bound = nearest * (1 + kJumpShare) + kJump;
  return (farthest > bound) | (unknown_share > kHole);
}

/// Returns the outlines of the regions of a mask that are no rectangles, without the border of the
/// image.
cv::Mat1b outlines_in(const cv::Mat1b& mask, int border) {
  cv::Mat1i labels, stats;
  cv::Mat1d centers;
  const int count = cv::connectedComponentsWithStats(mask, labels, stats, centers, 8);
  cv::Mat1b regions = mask.clone();
  for (int label = 1; label < count; ++label) {
    const double box = stats(label, cv::CC_STAT_WIDTH) * stats(label, cv::CC_STAT_HEIGHT);
    if (stats(label, cv::CC_STAT_AREA) > kRectangle * box) regions.setTo(0, labels == label);
  }
  cv::Mat1b inner;
  cv::erode(regions, inner, cv::Mat::ones(3, 3, CV_8U));
  cv::Mat1b outlines = cv::Mat1b::zeros(mask.size());
  const cv::Rect inside(border, border, mask.cols - 2 * border, mask.rows - 2 * border);
  if (inside.width > 0 && inside.height > 0)
    cv::Mat1b(regions - inner)(inside).copyTo(outlines(inside));
  return outlines;
}

double share(const cv::Mat1b& pixels) {
  return cv::countNonZero(pixels) / static_cast<double>(pixels.total());
}

/// Returns the mean depth within `radius` of each pixel among those with depth in a region; 0
/// without any.
cv::Mat1f mean_depth(const cv::Mat1f& depth, const cv::Mat1b& region, int radius) {
  const cv::Size window(2 * radius + 1, 2 * radius + 1);
  const cv::Mat1b known = region & (depth > 0);
  cv::Mat1f in_region = cv::Mat1f::zeros(depth.size()), sum, count;
  depth.copyTo(in_region, known);
  cv::boxFilter(in_region, sum, CV_32F, window);
  cv::boxFilter(known / 255, count, CV_32F, window);
  cv::Mat1f mean = sum / count;
  mean.setTo(0, count <= 0);
  return mean;
}

/// Returns the share of these pixels with depths on both sides where that of the region is the
/// nearer one; 0 without any.
double nearer_share(const cv::Mat1b& region, const cv::Mat1f& depth, const cv::Mat1b& pixels,
                    int radius) {
  const cv::Mat1f inside = mean_depth(depth, region, radius),
                  outside = mean_depth(depth, ~region, radius);
  const cv::Mat1b both = pixels & (inside > 0) & (outside > 0);
  const int count = cv::countNonZero(both);
  return count > 0 ? cv::countNonZero(both & (inside < outside)) / static_cast<double>(count) : 0;
}

}  // namespace

void MaskAgreement::add(const cv::Mat1b& mask, const cv::Mat& depth) {
  if (depth.size() != mask.size()) return;
  const int radius = std::max(2, mask.cols / 53);  // 12 pixels of 640
  const bool large = 2 * cv::countNonZero(mask) > static_cast<int>(mask.total());
  const cv::Mat1b regions = large ? mask == 0 : mask > 0;
  const cv::Mat1b outlines = outlines_in(regions, radius + 1);
  const int length = cv::countNonZero(outlines);
  if (length < kMinOutline || cv::countNonZero(depth) == 0) return;
  const cv::Mat1b jumps = jumps_within(depth, radius);
  ++masks_;
  if (large) {
    ++large_;
    nearer_outside_ += nearer_share(regions, depth, outlines & jumps, radius);
  }
  at_outlines_ += cv::countNonZero(jumps & outlines) / static_cast<double>(length);
  anywhere_ += share(jumps);
}

bool MaskAgreement::inverted() const {
  constexpr double kNearlyAll = 0.9, kNearer = 0.7;
  return masks_ >= kMinMasks &&
         static_cast<double>(large_) > kNearlyAll * static_cast<double>(masks_) &&
         nearer_outside_ > kNearer * static_cast<double>(large_);
}

std::optional<double> MaskAgreement::agreement() const {
  const auto count = static_cast<double>(masks_);
  // Where nearly all pixels are near a jump, nothing can be told.
  constexpr double kMostJumps = 0.9;
  if (masks_ < kMinMasks || anywhere_ > kMostJumps * count) return std::nullopt;
  return (at_outlines_ - anywhere_) / (count - anywhere_);
}

}  // namespace stillmap
