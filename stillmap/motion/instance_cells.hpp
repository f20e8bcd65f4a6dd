// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/cell_grid.hpp"
#include "stillmap/segment/instance.hpp"

#include <memory>
#include <vector>

namespace stillmap {

/// The cells of a thing's own surface, 255 in a grid-sized 8UC1. A small network's mask is coarse
/// (its prototypes have cells of 8 pixels and more at the usual input sizes), a box is coarser
/// still, but the depth image has sharp edges: the thing is what hangs together in depth
/// with the inside of the mask, up to two cells beyond it, but for pieces of surface that mostly go
/// on beyond the mask, the background's; or with the middle of a box at its median depth, within
/// the box. Cells of the mask without depth belong to it too.
cv::Mat1b instance_cells(const Instance& instance, const CellGrid& grid);

/// The cells of each instance of a frame, in their order.
using InstanceCells = std::vector<cv::Mat1b>;
using InstanceCellsPtr = std::shared_ptr<const InstanceCells>;

/// Null where `segmented` is.
InstanceCellsPtr instance_cells(const SegmentedFramePtr& segmented, const CellGrid& grid);

}  // namespace stillmap
