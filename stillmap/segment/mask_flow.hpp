// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/propagation_options.hpp"
#include "stillmap/segment/small_frame.hpp"

#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// One square of a mask's grid, and where it goes.
struct MaskCell {
  cv::Rect area;          ///< small pixels, within the mask; empty where the mask is
  cv::Point2f center;     ///< of the masked pixels in it; small pixels of the frame
  cv::Point2f flow;       ///< to the target; small pixels
  bool measured = false;  ///< whether the flow is its own, and believed
};

/// The squares of one mask, row by row.
struct MaskGrid {
  int rows = 0, columns = 0;
  std::size_t age = 0;  ///< frames that the cells' flows span; 0: none is known yet
  std::vector<MaskCell> cells;
  MaskCell& at(int row, int column) {
    return cells[static_cast<std::size_t>(row * columns + column)];
  }
  const MaskCell& at(int row, int column) const {
    return cells[static_cast<std::size_t>(row * columns + column)];
  }
};

/// A frame made ready for optical flow, to be followed from or to be found in: the former takes its
/// gradients, too.
struct FlowFrame {
  enum class Role { kSource, kTarget };
  SmallFrame small;
  std::vector<cv::Mat> pyramid;
  FlowFrame(const RgbdFrame& frame, Role role, const PropagationOptions& options);
};

/// Cuts a mask into squares of `options.grid`.
MaskGrid cut_into_cells(const SmallMask& mask, int spacing);

/// Measures where each cell goes: pyramidal Lucas-Kanade (Bouguet 2001) at its center. A grid that
/// was followed to an earlier frame before is looked for where it would be by now at the same
/// speed, which takes half of the levels. A flow that ends on another surface (depth jumps by more
/// than options.depth_apart) is not believed. Then each cell takes the median flow of its
/// neighborhood, so that no cell goes astray.
/// @param age frames from the source to the target
void follow_cells(MaskGrid& grid, const FlowFrame& source, const FlowFrame& target, std::size_t age,
                  const PropagationOptions& options);

/// A mask moved with its cells, and the depth it is expected at there.
struct MovedMask {
  SmallMask small;
  cv::Mat1f depth;  ///< meters; of the source's pixels, 0 where unknown
};

/// Moves every pixel with its cell. The window leaves `margin` small pixels around, within the
/// image.
MovedMask move_mask(const SmallMask& mask, const MaskGrid& grid, const SmallFrame& source,
                    int margin);

/// Component-wise median flow of all cells, small pixels.
cv::Point2f common_flow(const MaskGrid& grid);

}  // namespace stillmap
