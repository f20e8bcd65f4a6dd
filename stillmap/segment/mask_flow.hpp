// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/small_frame.hpp"

#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Depth difference beyond which a pixel belongs to another object [m]; tuned on people at 1 to 4
/// m, against true masks.
inline constexpr double kDepthApart = 0.3;

/// One square of a mask's grid and its flow.
struct MaskCell {
  cv::Rect area;          ///< Area within the mask [small pixels]; empty where the mask is.
  cv::Point2f center;     ///< Centroid of its masked pixels in the frame [small pixels].
  cv::Point2f flow;       ///< Flow to the target frame [small pixels].
  bool measured = false;  ///< Whether the flow was measured in this cell and accepted.
};

/// The cells of one mask, row by row.
struct MaskGrid {
  int rows = 0, columns = 0;
  std::size_t age = 0;  ///< Number of frames that the flows span; 0: no flow is known yet.
  std::vector<MaskCell> cells;
  MaskCell& at(int row, int column) {
    return cells[static_cast<std::size_t>(row * columns + column)];
  }
  const MaskCell& at(int row, int column) const {
    return cells[static_cast<std::size_t>(row * columns + column)];
  }
};

/// A frame prepared for optical flow; gradients are computed for source frames only.
struct FlowFrame {
  enum class Role { kSource, kTarget };
  SmallFrame small;
  std::vector<cv::Mat> pyramid;
  FlowFrame(const RgbdFrame& frame, Role role);
};

/// Divides a mask of a frame reduced by the factor `shrink` into cells.
MaskGrid cut_into_cells(const SmallMask& mask, int shrink);

/// Measures the flow of each cell by pyramidal Lucas-Kanade (Bouguet 2001) at its center. A grid
/// with earlier flow starts from a constant-velocity prediction, which halves the number of levels.
/// A flow that ends on another surface (depth differs by more than kDepthApart) is
/// rejected. Then each cell takes the median flow of its neighborhood, which removes outliers.
/// @param age  number of frames from the source to the target
void follow_cells(MaskGrid& grid, const FlowFrame& source, const FlowFrame& target,
                  std::size_t age);

/// A moved mask and the depth expected in it.
struct MovedMask {
  SmallMask small;
  cv::Mat1f depth;  ///< Depth of the source pixels [m]; 0: unknown.
};

/// Moves every pixel with its cell. The window keeps a margin of `margin` small pixels within the
/// image.
MovedMask move_mask(const SmallMask& mask, const MaskGrid& grid, const SmallFrame& source,
                    int margin);

/// Returns the component-wise median flow of all cells [small pixels].
cv::Point2f common_flow(const MaskGrid& grid);

}  // namespace stillmap
