// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_depth.hpp"

namespace stillmap {
namespace {

constexpr int kTile = 8;  // small pixels

/// Known depths of masked pixels in a square around a tile; every second pixel will do.
void collect_depths(const SmallMask& mask, const cv::Mat1f& depth, cv::Rect area,
                    std::vector<float>& depths) {
  depths.clear();
  area &= cv::Rect(cv::Point(), mask.window.size());
  for (int y = area.y; y < area.br().y; y += 2) {
    for (int x = area.x; x < area.br().x; x += 2) {
      if (mask.mask(y, x) != 0 && depth(y, x) > 0) depths.push_back(depth(y, x));
    }
  }
}

void drop_behind(const SmallMask& mask, const cv::Mat1f& depth, const cv::Rect& area, float limit,
                 cv::Mat1b& kept) {
  for (int y = area.y; y < area.br().y; ++y) {
    for (int x = area.x; x < area.br().x; ++x) {
      if (mask.mask(y, x) != 0 && depth(y, x) > limit) kept(y, x) = 0;
    }
  }
}

/// Masked pixels that touch an unmasked one (4-neighbours).
std::vector<cv::Point> outline(const cv::Mat1b& mask) {
  std::vector<cv::Point> points;
  for (int y = 0; y < mask.rows; ++y) {
    const auto* row = mask.ptr<std::uint8_t>(y);
    const auto* above = mask.ptr<std::uint8_t>(std::max(y - 1, 0));
    const auto* below = mask.ptr<std::uint8_t>(std::min(y + 1, mask.rows - 1));
    for (int x = 0; x < mask.cols; ++x) {
      if (row[x] == 0) continue;
      const bool inner = row[std::max(x - 1, 0)] != 0 && row[std::min(x + 1, mask.cols - 1)] != 0 &&
                         above[x] != 0 && below[x] != 0;
      if (!inner) points.emplace_back(x, y);
    }
  }
  return points;
}

}  // namespace

void drop_background(SmallMask& mask, const SmallFrame& frame, const CarryOptions& options) {
  if (mask.window.empty()) return;
  const cv::Mat1f depth = frame.depth(mask.window);
  const cv::Rect all(cv::Point(), mask.window.size());
  cv::Mat1b kept = mask.mask.clone();
  std::vector<float> depths;
  for (int y = 0; y < all.height; y += kTile) {
    for (int x = 0; x < all.width; x += kTile) {
      collect_depths(mask, depth, {x - kTile, y - kTile, 3 * kTile, 3 * kTile}, depths);
      if (depths.empty()) continue;
      const auto middle = depths.begin() + static_cast<std::ptrdiff_t>(depths.size() / 2);
      std::nth_element(depths.begin(), middle, depths.end());
      const float limit = *middle + static_cast<float>(options.depth_apart);
      drop_behind(mask, depth, cv::Rect(x, y, kTile, kTile) & all, limit, kept);
    }
  }
  mask.mask = kept;
}

void drop_others(MovedMask& moved, const SmallFrame& target, const CarryOptions& options) {
  const auto apart = static_cast<float>(options.depth_apart);
  const cv::Rect& window = moved.small.window;
  for (int y = 0; y < window.height; ++y) {
    auto* mask = moved.small.mask.ptr<std::uint8_t>(y);
    const auto* expected = moved.depth.ptr<float>(y);
    const auto* seen = target.depth.ptr<float>(y + window.y) + window.x;
    for (int x = 0; x < window.width; ++x) {
      const bool known = expected[x] > 0 && seen[x] > 0;
      if (known && std::abs(seen[x] - expected[x]) > apart) mask[x] = 0;
    }
  }
}

void grow_on_surface(SmallMask& mask, const SmallFrame& frame, int rounds, const cv::Mat1b& allowed,
                     const CarryOptions& options) {
  constexpr float kAt = 2;  // metres: where depth_step holds. A Kinect's noise grows with z^2
  const auto step = static_cast<float>(options.depth_step);
  const std::array<cv::Point, 4> around{cv::Point(1, 0), {-1, 0}, {0, 1}, {0, -1}};
  const cv::Mat1f depth = frame.depth(mask.window);
  const cv::Rect all(cv::Point(), mask.window.size());
  std::vector<cv::Point> front = outline(mask.mask), next;
  for (int round = 0; round < rounds && !front.empty(); ++round) {
    next.clear();
    for (const cv::Point p : front) {
      const float z = depth(p);
      if (z <= 0) continue;
      const float tolerance = step * std::max(1.0F, z * z / (kAt * kAt));
      for (const cv::Point direction : around) {
        const cv::Point q = p + direction;
        if (!all.contains(q) || mask.mask(q) != 0 || depth(q) <= 0) continue;
        if (std::abs(depth(q) - z) >= tolerance || (!allowed.empty() && allowed(q) == 0)) continue;
        mask.mask(q) = 255;
        next.push_back(q);
      }
    }
    front.swap(next);
  }
}

}  // namespace stillmap
