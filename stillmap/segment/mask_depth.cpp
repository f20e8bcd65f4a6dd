// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_depth.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Side of the tiles with a median depth each [small pixels].
constexpr int kTile = 8;

/// Returns the known depths of masked pixels in a square around a tile; every second pixel
/// suffices.
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

/// A window of a frame with a border, so that all four neighbors of its pixels exist.
struct Field {
  cv::Mat1f depth;   // meters
  cv::Mat1b closed;  // Not 0 where a mask cannot grow: masked already, forbidden, or without depth.
  int stride = 0;

  Field(const SmallMask& mask, const SmallFrame& frame, const cv::Mat1b& allowed) {
    const cv::Mat1f inner = frame.depth(mask.window);
    cv::copyMakeBorder(inner, depth, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
    closed = cv::Mat1b(depth.size(), 1);
    stride = depth.cols;
    for (int y = 0; y < inner.rows; ++y) {
      const auto* z = inner.ptr<float>(y);
      const auto* own = mask.mask.ptr<std::uint8_t>(y);
      const auto* open = allowed.empty() ? nullptr : allowed.ptr<std::uint8_t>(y);
      auto* out = closed.ptr<std::uint8_t>(y + 1) + 1;
      for (int x = 0; x < inner.cols; ++x) out[x] = own[x] != 0 || z[x] <= 0;
      for (int x = 0; open != nullptr && x < inner.cols; ++x) out[x] |= open[x] == 0;
    }
  }
};

/// Returns the masked pixels with a depth next to an open pixel, as offsets into the field.
std::vector<int> front_of(const SmallMask& mask, const Field& field) {
  std::vector<int> front;
  const auto* closed = field.closed.ptr<std::uint8_t>();
  const auto* depth = field.depth.ptr<float>();
  for (int y = 0; y < mask.mask.rows; ++y) {
    const auto* own = mask.mask.ptr<std::uint8_t>(y);
    const int row = (y + 1) * field.stride + 1;
    for (int x = 0; x < mask.mask.cols; ++x) {
      const int p = row + x;
      const bool shut = closed[p - 1] != 0 && closed[p + 1] != 0 && closed[p - field.stride] != 0 &&
                        closed[p + field.stride] != 0;
      if (own[x] != 0 && !shut && depth[p] > 0) front.push_back(p);
    }
  }
  return front;
}

}  // namespace

void drop_background(SmallMask& mask, const SmallFrame& frame) {
  const TraceScope scope("trimming");
  if (mask.window.empty()) return;
  const cv::Mat1f depth = frame.depth(mask.window);
  const cv::Rect all(cv::Point(), mask.window.size());
  cv::Mat1b kept = mask.mask.clone();
  std::vector<float> depths;
  for (int y = 0; y < all.height; y += kTile) {
    for (int x = 0; x < all.width; x += kTile) {
      collect_depths(mask, depth, {x - kTile, y - kTile, 3 * kTile, 3 * kTile}, depths);
      if (depths.empty()) continue;
      const float limit = upper_median(depths) + static_cast<float>(kDepthApart);
      drop_behind(mask, depth, cv::Rect(x, y, kTile, kTile) & all, limit, kept);
    }
  }
  mask.mask = kept;
}

void drop_others(MovedMask& moved, const SmallFrame& target) {
  const auto apart = static_cast<float>(kDepthApart);
  const cv::Rect& window = moved.small.window;
  for (int y = 0; y < window.height; ++y) {
    auto* mask = moved.small.mask.ptr<std::uint8_t>(y);
    const auto* expected = moved.depth.ptr<float>(y);
    const auto* seen = target.depth.ptr<float>(y + window.y) + window.x;
    for (int x = 0; x < window.width; ++x) {
      const bool known = (expected[x] > 0) & (seen[x] > 0);
      const bool another = known & (std::abs(seen[x] - expected[x]) > apart);
      mask[x] = another ? 0 : mask[x];
    }
  }
}

void grow_on_surface(SmallMask& mask, const SmallFrame& frame, int rounds,
                     const cv::Mat1b& allowed) {
  const TraceScope scope("growing");
  Field field(mask, frame, allowed);
  auto* closed = field.closed.ptr<std::uint8_t>();
  const auto* depth = field.depth.ptr<float>();
  const std::array<int, 4> around{1, -1, field.stride, -field.stride};
  std::vector<int> front = front_of(mask, field), next;
  for (int round = 0; round < rounds && !front.empty(); ++round) {
    next.clear();
    for (const int p : front) {
      const float z = depth[p];
      const float tolerance = surface_step(z);
      for (const int direction : around) {
        const int q = p + direction;
        if (closed[q] != 0 || std::abs(depth[q] - z) >= tolerance) continue;
        closed[q] = 1;
        mask.mask(q / field.stride - 1, q % field.stride - 1) = 255;
        next.push_back(q);
      }
    }
    front.swap(next);
  }
}

}  // namespace stillmap
