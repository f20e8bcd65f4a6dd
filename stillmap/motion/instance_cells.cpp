// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/instance_cells.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Largest difference of depth from the median in the center of a box: half the depth of an object
/// [m].
constexpr float kHalfDepth = 0.3F;
/// Error by which a mask may be too small [cells].
constexpr int kMargin = 2;

/// Returns the cells whose center is in a rectangle of pixels.
cv::Rect cells_within(const cv::Rect& pixels, const CellGrid& grid) {
  const auto first = [](int pixel) { return (pixel + kCellSide / 2 - 1) / kCellSide; };
  const cv::Point from(first(std::max(pixels.x, 0)), first(std::max(pixels.y, 0)));
  const cv::Point to(first(std::max(pixels.br().x, 0)), first(std::max(pixels.br().y, 0)));
  return cv::Rect(from, to) & cv::Rect({}, grid.size());
}

/// Returns the cells in the central half of a box at about its median depth.
cv::Mat1b center_of_box(const cv::Rect& box, const CellGrid& grid) {
  const cv::Rect center = cells_within(
      {box.x + box.width / 4, box.y + box.height / 4, box.width / 2, box.height / 2}, grid);
  cv::Mat1b core = cv::Mat1b::zeros(grid.size());
  const cv::Mat1f depth = grid.depth(center);
  std::vector<float> known;
  std::copy_if(depth.begin(), depth.end(), std::back_inserter(known),
               [](float z) { return z > 0; });
  if (known.empty()) return core;
  core(center) = cv::abs(depth - upper_median(known)) < kHalfDepth;
  return core;
}

/// A window of the grid with a border around it: all four neighbors of its cells exist.
struct Surroundings {
  cv::Rect window;
  cv::Mat1f depth;  // [m]; 0 where unknown, negative outside the grid
  std::array<int, 4> steps;
  DepthPolynomial<float> tolerance;

  Surroundings(const cv::Rect& cells, const CellGrid& grid)
      : window(cells), depth(cells.height + 2, cells.width + 2, -1.0F), tolerance(grid.tolerance) {
    const cv::Rect bounds({}, grid.size());
    const cv::Rect known = cv::Rect(cells.x - 1, cells.y - 1, depth.cols, depth.rows) & bounds;
    grid.depth(known).copyTo(depth(known - cells.tl() + cv::Point(1, 1)));
    steps = {1, -1, depth.cols, -depth.cols};
  }
  /// Returns whether a cell and its neighbor are on one surface.
  bool connected(int from, int to) const {
    const float z = depth(from), z_to = depth(to);
    return z > 0 && z_to > 0 && std::abs(z_to - z) <= tolerance.at(z);
  }
  /// Returns the window of an image of the grid's cells; 0 in the border.
  cv::Mat1b part_of(const cv::Mat1b& map) const {
    cv::Mat1b part = cv::Mat1b::zeros(depth.size());
    map(window).copyTo(part(inner()));
    return part;
  }
  cv::Rect inner() const { return {cv::Point(1, 1), window.size()}; }
};

/// Adds to `cells` the cells within `reach` that are connected with them in depth.
void grow(cv::Mat1b& cells, const cv::Rect& reach, const CellGrid& grid) {
  if (reach.empty()) return;
  const Surroundings near(reach, grid);
  cv::Mat1b grown = near.part_of(cells);
  cv::Mat1b open = cv::Mat1b::zeros(grown.size());
  open(near.inner()) = 255;
  std::vector<int> front;
  for (int i = 0; i < static_cast<int>(grown.total()); ++i) {
    if (grown(i) != 0) front.push_back(i);
  }
  while (!front.empty()) {
    const int from = front.back();
    front.pop_back();
    for (const int step : near.steps) {
      const int to = from + step;
      if (open(to) == 0 || grown(to) != 0 || !near.connected(from, to)) continue;
      grown(to) = 255;
      front.push_back(to);
    }
  }
  grown(near.inner()).copyTo(cells(reach));
}

/// A surface connected in depth, within the reach of a mask.
struct Piece {
  std::vector<int> cells;
  int in_mask = 0;  ///< Number of its cells in the mask.
  int open = 0;     ///< Number of neighbors beyond the reach that continue the surface.
  int closed = 0;   ///< Number of neighbors that do not continue the surface.
};

/// Returns the piece around `start` and removes it from `left`, the rest of the reach.
Piece extract_piece(int start, const cv::Mat1b& inside, const cv::Mat1b& reach, cv::Mat1b& left,
                    const Surroundings& near) {
  Piece piece;
  piece.cells.push_back(start);
  left(start) = 0;
  for (std::size_t next = 0; next < piece.cells.size(); ++next) {
    const int from = piece.cells[next];
    piece.in_mask += inside(from) != 0;
    for (const int step : near.steps) {
      const int to = from + step;
      if (near.depth(to) < 0) continue;
      if (!near.connected(from, to)) {
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

/// Returns whether a surface mostly continues beyond the mask, as the background does in the strip
/// that a mask that is too large or late includes. An object ends with its mask, except at its
/// support.
bool continues_beyond(const Piece& piece) { return 4 * piece.open > piece.open + piece.closed; }

/// Returns the surfaces in a mask without those behind the object.
cv::Mat1b cells_of_mask(const Instance& instance, const CellGrid& grid) {
  cv::Mat1b cells = cells_in_mask(instance, grid);
  const cv::Rect box = cells_within(instance.box, grid);
  const cv::Rect window = cv::Rect(box.x - kMargin, box.y - kMargin, box.width + 2 * kMargin,
                                   box.height + 2 * kMargin) &
                          cv::Rect({}, grid.size());
  if (box.empty()) return cells;
  const Surroundings near(window, grid);
  const cv::Mat1b inside = near.part_of(cells);
  cv::Mat1b reach;
  cv::dilate(cells(window), reach, cv::Mat(), {-1, -1}, kMargin);
  cv::copyMakeBorder(reach, reach, 1, 1, 1, 1, cv::BORDER_CONSTANT, cv::Scalar(0));
  cv::Mat1b left = reach & (near.depth > 0);
  std::vector<Piece> pieces;
  for (int start = 0; start < static_cast<int>(left.total()); ++start) {
    if (left(start) != 0 && inside(start) != 0) {
      pieces.push_back(extract_piece(start, inside, reach, left, near));
    }
  }
  const auto largest =
      std::max_element(pieces.begin(), pieces.end(),
                       [](const Piece& a, const Piece& b) { return a.in_mask < b.in_mask; });
  cv::Mat1b kept = inside & (near.depth <= 0);
  for (auto piece = pieces.begin(); piece != pieces.end(); ++piece) {
    if (piece != largest && continues_beyond(*piece)) continue;
    for (const int cell : piece->cells) kept(cell) = 255;
  }
  kept(near.inner()).copyTo(cells(window));
  return cells;
}

cv::Mat1b cells_of_box(const Instance& instance, const CellGrid& grid) {
  cv::Mat1b cells = center_of_box(instance.box, grid);
  grow(cells, cells_within(instance.box, grid), grid);
  return cells;
}

}  // namespace

cv::Mat1b cells_in_mask(const Instance& instance, const CellGrid& grid) {
  cv::Mat1b inside = cv::Mat1b::zeros(grid.size());
  const cv::Rect cells = cells_within(instance.box, grid);
  if (instance.mask.empty()) inside(cells) = 255;
  if (instance.mask.empty()) return inside;
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

cv::Mat1b instance_cells(const Instance& instance, const CellGrid& grid) {
  return instance.mask.empty() ? cells_of_box(instance, grid) : cells_of_mask(instance, grid);
}

InstanceCellsPtr instance_cells(const SegmentedFramePtr& segmented, const CellGrid& grid) {
  if (!segmented) return nullptr;
  auto cells = std::make_shared<InstanceCells>();
  for (const Instance& instance : segmented->instances) {
    cells->push_back(instance_cells(instance, grid));
  }
  return cells;
}

}  // namespace stillmap
