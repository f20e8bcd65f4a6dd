// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_flow.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"

#include <optional>

#include <opencv2/imgproc.hpp>
#include <opencv2/video/tracking.hpp>

namespace stillmap {
namespace {

/// Spacing of the optical flow points [pixels of the full image]; tuned on people at 1 to 4 m in
/// 640 x 480 images, against true masks.
constexpr int kGrid = 20;
/// Side of the optical flow window [pixels of the full image]; tuned like kGrid.
constexpr int kWindow = 28;
/// Number of pyramid levels above the first: finds motion of +-80 small pixels.
constexpr int kLevels = 3;
/// Number of levels with a prediction: finds deviations of +-20 small pixels.
constexpr int kNearLevels = 1;
/// Number of Lucas-Kanade iterations per level.
constexpr int kIterations = 8;
/// Step below which the iteration stops [small pixels].
constexpr double kPrecise = 0.05;
/// Minimum eigenvalue of the gradient matrix per pixel.
constexpr double kTexture = 1e-3;

/// Returns the side of the optical flow window [small pixels].
int window_of(int shrink) { return std::max(5, kWindow / shrink); }

MaskCell make_cell(const SmallMask& mask, const cv::Rect& area) {
  int count = 0, sum_x = 0, sum_y = 0;
  for (int y = area.y; y < area.br().y; ++y) {
    const auto* row = mask.mask.ptr<std::uint8_t>(y);
    for (int x = area.x; x < area.br().x; ++x) {
      const int inside = row[x] != 0 ? 1 : 0;
      count += inside;
      sum_x += inside * x;
      sum_y += inside * y;
    }
  }
  if (count == 0) return {};
  const auto mean = [&](int sum, int origin) {
    return static_cast<float>(sum) / static_cast<float>(count) + static_cast<float>(origin);
  };
  return {.area = area,
          .center = {mean(sum_x, mask.window.x), mean(sum_y, mask.window.y)},
          .flow = {},
          .measured = false};
}

float depth_at(const cv::Mat1f& depth, cv::Point2f p) {
  const cv::Point at(cvRound(p.x), cvRound(p.y));
  return cv::Rect(cv::Point(), depth.size()).contains(at) ? depth(at) : 0.0F;
}

/// Returns the component-wise median of the measured flows within `reach` cells; nothing if there
/// are too few.
std::optional<cv::Point2f> median_flow(const MaskGrid& grid, int row, int column, int reach) {
  constexpr std::size_t kEnough = 3;
  std::vector<float> x, y;
  for (int r = std::max(0, row - reach); r <= std::min(grid.rows - 1, row + reach); ++r) {
    for (int c = std::max(0, column - reach); c <= std::min(grid.columns - 1, column + reach);
         ++c) {
      if (!grid.at(r, c).measured) continue;
      x.push_back(grid.at(r, c).flow.x);
      y.push_back(grid.at(r, c).flow.y);
    }
  }
  if (x.size() < kEnough) return std::nullopt;
  return cv::Point2f(upper_median(x), upper_median(y));
}

/// Sets every cell to the median of the smallest sufficient neighborhood.
void smooth_flow(MaskGrid& grid) {
  const MaskGrid measured = grid;
  const int widest = std::max(grid.rows, grid.columns);
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      if (grid.at(r, c).area.empty()) continue;
      std::optional<cv::Point2f> flow;
      for (int reach = 1; !flow && reach <= widest; reach *= 2) {
        flow = median_flow(measured, r, c, reach);
      }
      grid.at(r, c).flow = flow.value_or(cv::Point2f());
    }
  }
}

/// Returns the flow rounded to whole small pixels.
cv::Point shift_of(const MaskCell& cell) { return {cvRound(cell.flow.x), cvRound(cell.flow.y)}; }

cv::Rect reached_window(const MaskGrid& grid, cv::Point origin, int margin, const cv::Rect& image) {
  cv::Rect reached;
  for (const MaskCell& cell : grid.cells) {
    if (!cell.area.empty()) reached |= cell.area + origin + shift_of(cell);
  }
  if (reached.empty()) return {};
  const cv::Point corner(margin, margin);
  return cv::Rect(reached.tl() - corner, reached.br() + corner) & image;
}

void move_cell(const MaskCell& cell, const SmallMask& mask, const SmallFrame& source,
               MovedMask& moved) {
  const cv::Point to_window = mask.window.tl() + shift_of(cell) - moved.small.window.tl();
  const cv::Rect area = cell.area & (cv::Rect(cv::Point(), moved.small.window.size()) - to_window);
  for (int y = area.y; y < area.br().y; ++y) {
    const auto* in = mask.mask.ptr<std::uint8_t>(y);
    const auto* z = source.depth.ptr<float>(y + mask.window.y) + mask.window.x;
    auto* out = moved.small.mask.ptr<std::uint8_t>(y + to_window.y) + to_window.x;
    auto* expected = moved.depth.ptr<float>(y + to_window.y) + to_window.x;
    for (int x = area.x; x < area.br().x; ++x) {
      if (in[x] == 0) continue;
      out[x] = 255;
      if (z[x] > 0 && (expected[x] == 0 || z[x] < expected[x])) expected[x] = z[x];
    }
  }
}

}  // namespace

FlowFrame::FlowFrame(const RgbdFrame& frame, Role role) : small(frame) {
  const TraceScope scope("pyramid");
  const int window = window_of(small.shrink);
  cv::buildOpticalFlowPyramid(small.gray, pyramid, cv::Size(window, window), kLevels,
                              role == Role::kSource);
}

MaskGrid cut_into_cells(const SmallMask& mask, int shrink) {
  const int spacing = std::max(2, kGrid / shrink);
  MaskGrid grid;
  const cv::Rect all(cv::Point(), mask.window.size());
  grid.columns = (all.width + spacing - 1) / spacing;
  grid.rows = (all.height + spacing - 1) / spacing;
  for (int r = 0; r < grid.rows; ++r) {
    for (int c = 0; c < grid.columns; ++c) {
      const cv::Rect area(c * spacing, r * spacing, spacing, spacing);
      grid.cells.push_back(make_cell(mask, area & all));
    }
  }
  return grid;
}

void follow_cells(MaskGrid& grid, const FlowFrame& source, const FlowFrame& target,
                  std::size_t age) {
  const TraceScope scope("flow");
  const bool known = grid.age > 0;
  const float pace = known ? static_cast<float>(age) / static_cast<float>(grid.age) : 0.0F;
  grid.age = age;
  std::vector<MaskCell*> cells;
  std::vector<cv::Point2f> from, to;
  for (MaskCell& cell : grid.cells) {
    if (cell.area.empty()) continue;
    cells.push_back(&cell);
    from.push_back(cell.center);
    to.push_back(cell.center + pace * cell.flow);
  }
  if (cells.empty()) return;
  std::vector<std::uint8_t> found;
  const int window = window_of(source.small.shrink);
  cv::calcOpticalFlowPyrLK(source.pyramid, target.pyramid, from, to, found, cv::noArray(),
                           cv::Size(window, window), known ? kNearLevels : kLevels,
                           {cv::TermCriteria::COUNT + cv::TermCriteria::EPS, kIterations, kPrecise},
                           cv::OPTFLOW_USE_INITIAL_FLOW, kTexture);
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const float before = depth_at(source.small.depth, from[i]);
    const float after = depth_at(target.small.depth, to[i]);
    const bool apart = before > 0 && after > 0 && std::abs(after - before) > kDepthApart;
    cells[i]->measured = found[i] != 0 && !apart;
    cells[i]->flow = to[i] - from[i];
  }
  smooth_flow(grid);
}

MovedMask move_mask(const SmallMask& mask, const MaskGrid& grid, const SmallFrame& source,
                    int margin) {
  const TraceScope scope("moving");
  MovedMask moved;
  moved.small.window = reached_window(grid, mask.window.tl(), margin, source.bounds());
  moved.small.mask = cv::Mat1b::zeros(moved.small.window.size());
  moved.depth = cv::Mat1f::zeros(moved.small.window.size());
  if (moved.small.window.empty()) return moved;
  for (const MaskCell& cell : grid.cells) {
    if (!cell.area.empty()) move_cell(cell, mask, source, moved);
  }
  // Diverging cells leave gaps between them.
  cv::morphologyEx(moved.small.mask, moved.small.mask, cv::MORPH_CLOSE, cv::Mat1b::ones(3, 3));
  return moved;
}

cv::Point2f common_flow(const MaskGrid& grid) {
  std::vector<float> x, y;
  for (const MaskCell& cell : grid.cells) {
    if (cell.area.empty()) continue;
    x.push_back(cell.flow.x);
    y.push_back(cell.flow.y);
  }
  return x.empty() ? cv::Point2f() : cv::Point2f(upper_median(x), upper_median(y));
}

}  // namespace stillmap
