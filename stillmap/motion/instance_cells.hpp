// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/cell_grid.hpp"
#include "stillmap/segment/instance.hpp"

#include <memory>
#include <vector>

namespace stillmap {

/// Returns the cells of an object's own surface, 255 in a grid-sized 8UC1. A small network's mask
/// is coarse (its prototypes have cells of 8 pixels and more at the usual input sizes), and a box
/// is coarser, but the depth image has sharp edges. With a mask, the object consists of the
/// surfaces connected in depth with the inside of the mask, up to two cells beyond it, except for
/// surfaces that mostly continue beyond the mask, which are background. With a box, it is the
/// surface connected with the center of the box at its median depth, within the box. Cells of the
/// mask without depth belong to the object too.
cv::Mat1b instance_cells(const Instance& instance, const CellGrid& grid);

/// Returns the cells whose center is in the mask of an instance, or in its box if it has none, 255
/// in a grid-sized 8UC1.
cv::Mat1b cells_in_mask(const Instance& instance, const CellGrid& grid);

/// The cells of each instance of a frame, in the order of the instances.
using InstanceCells = std::vector<cv::Mat1b>;
using InstanceCellsPtr = std::shared_ptr<const InstanceCells>;

/// Returns the cells of all instances; null if `segmented` is.
InstanceCellsPtr instance_cells(const SegmentedFramePtr& segmented, const CellGrid& grid);

}  // namespace stillmap
