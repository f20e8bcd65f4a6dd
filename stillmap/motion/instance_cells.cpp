// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/instance_cells.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Half the depth of a thing that stands in its box [m].
constexpr float kHalfDepth = 0.3F;
/// Cells that a mask may be too small by.
constexpr int kMargin = 2;

/// The cells whose middle lies in a rectangle of pixels.
cv::Rect cells_within(const cv::Rect& pixels, const CellGrid& grid) {
  const auto first = [](int pixel) { return (pixel + kCellSide / 2 - 1) / kCellSide; };
  const cv::Point from(first(std::max(pixels.x, 0)), first(std::max(pixels.y, 0)));
  const cv::Point to(first(std::max(pixels.br().x, 0)), first(std::max(pixels.br().y, 0)));
  return cv::Rect(from, to) & cv::Rect({}, grid.size());
}

cv::Mat1b inside_mask(const Instance& instance, const CellGrid& grid) {
  cv::Mat1b inside = cv::Mat1b::zeros(grid.size());
  const cv::Rect cells = cells_within(instance.box, grid);
  for (int r = cells.y; r < cells.br().y; ++r) {
    for (int c = cells.x; c < cells.br().x; ++c) {
      const int y = r * kCellSide + kCellSide / 2 - instance.box.y;
      const int x = c * kCellSide + kCellSide / 2 - instance.box.x;
      inside(r, c) = instance.mask.at<std::uint8_t>(std::min(y, instance.mask.rows - 1),
                                                    std::min(x, instance.mask.cols - 1));
    }
  }
  return inside;
}

/// The cells in the middle half of a box that lie about as deep as most of them do.
cv::Mat1b middle_of_box(const cv::Rect& box, const CellGrid& grid) {
  const cv::Rect middle = cells_within(
      {box.x + box.width / 4, box.y + box.height / 4, box.width / 2, box.height / 2}, grid);
  cv::Mat1b core = cv::Mat1b::zeros(grid.size());
  const cv::Mat1f depth = grid.depth(middle);
  std::vector<float> known;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(known),
               [](float z) { return z > 0; });
  if (known.empty()) return core;
  const auto median = known.begin() + static_cast<std::ptrdiff_t>(known.size() / 2);
  std::nth_element(known.begin(), median, known.end());
  core(middle) = cv::abs(depth - *median) < kHalfDepth;
  return core;
}

const std::array<cv::Point, 4> kSteps = {{{1, 0}, {-1, 0}, {0, 1}, {0, -1}}};

/// Whether a surface goes on from a cell to its neighbour.
bool goes_on(const CellGrid& grid, cv::Point from, cv::Point to) {
  const float z = grid.depth(from), there = grid.depth(to);
  return z > 0 && there > 0 && std::abs(there - z) <= depth_tolerance(z);
}

/// Adds to `cells` what hangs together with them in depth, as far as `reach` goes.
void grow(cv::Mat1b& cells, const cv::Mat1b& reach, const CellGrid& grid) {
  std::vector<cv::Point> front;
  cv::findNonZero(cells, front);
  const cv::Rect bounds({}, grid.size());
  while (!front.empty()) {
    const cv::Point from = front.back();
    front.pop_back();
    for (const cv::Point step : kSteps) {
      const cv::Point to = from + step;
      if (!bounds.contains(to) || cells(to) != 0 || reach(to) == 0) continue;
      if (!goes_on(grid, from, to)) continue;
      cells(to) = 255;
      front.push_back(to);
    }
  }
}

/// A surface that hangs together in depth, within the reach of a mask.
struct Piece {
  std::vector<cv::Point> cells;
  int in_mask = 0;
  int open = 0;    ///< neighbours beyond the reach that the surface goes on to
  int closed = 0;  ///< neighbours anywhere that it ends at
};

/// Takes the piece around `start` out of what is `left` of the reach.
Piece take_piece(cv::Point start, const cv::Mat1b& inside, const cv::Mat1b& reach, cv::Mat1b& left,
                 const CellGrid& grid) {
  const cv::Rect bounds({}, grid.size());
  Piece piece;
  piece.cells.push_back(start);
  left(start) = 0;
  for (std::size_t next = 0; next < piece.cells.size(); ++next) {
    const cv::Point from = piece.cells[next];
    piece.in_mask += inside(from) != 0;
    for (const cv::Point step : kSteps) {
      const cv::Point to = from + step;
      if (!bounds.contains(to)) continue;
      if (!goes_on(grid, from, to)) {
        ++piece.closed;
      } else if (reach(to) == 0) {
        ++piece.open;
      } else if (left(to) != 0) {
        left(to) = 0;
        piece.cells.push_back(to);
      }
    }
  }
  return piece;
}

/// A thing ends where its mask does, but where it stands or leans on something. What lies behind it
/// goes on, on the far side of the strip that a mask too large, or late, takes of it.
bool goes_on_beyond(const Piece& piece) { return 4 * piece.open > piece.open + piece.closed; }

/// The pieces of surface that a mask covers, without those that lie behind the thing.
cv::Mat1b cells_of_mask(const Instance& instance, const CellGrid& grid) {
  const cv::Mat1b inside = inside_mask(instance, grid);
  cv::Mat1b reach;
  cv::dilate(inside, reach, cv::Mat(), {-1, -1}, kMargin);
  cv::Mat1b left = reach & (grid.depth > 0);
  std::vector<cv::Point> starts;
  cv::findNonZero(inside & left, starts);
  std::vector<Piece> pieces;
  for (const cv::Point start : starts) {
    if (left(start) != 0) pieces.push_back(take_piece(start, inside, reach, left, grid));
  }
  const auto largest =
      std::max_element(pieces.begin(), pieces.end(),
                       [](const Piece& a, const Piece& b) { return a.in_mask < b.in_mask; });
  cv::Mat1b cells = inside & (grid.depth <= 0);
  for (auto piece = pieces.begin(); piece != pieces.end(); ++piece) {
    if (piece != largest && goes_on_beyond(*piece)) continue;
    for (const cv::Point cell : piece->cells) cells(cell) = 255;
  }
  return cells;
}

cv::Mat1b cells_of_box(const Instance& instance, const CellGrid& grid) {
  cv::Mat1b cells = middle_of_box(instance.box, grid);
  cv::Mat1b reach = cv::Mat1b::zeros(grid.size());
  reach(cells_within(instance.box, grid)) = 255;
  grow(cells, reach, grid);
  return cells;
}

}  // namespace

cv::Mat1b instance_cells(const Instance& instance, const CellGrid& grid) {
  return instance.mask.empty() ? cells_of_box(instance, grid) : cells_of_mask(instance, grid);
}

}  // namespace stillmap
