// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Which pixels that back_project() leaves out are too uncertain to be placed as the others are,
/// but better than nothing where nobody came nearer.
struct FarOptions {
  /// Standard deviation of a depth up to which it is used [m]; 0 for no far surfaces at all. The
  /// default is that of a Kinect v1 at 5 m.
  double max_sigma = 0.041404;
  double deviations = 3.5;  ///< depths of one surface differ by at most so many standard deviations
  int window = 2;           ///< pixels around that a depth is averaged over
  double support = 0.4;     ///< share of those measured that must be of one surface with it
  int min_views = 1;        ///< voxels of far surfaces that fewer views show are dropped
};

/// Depths of far surfaces on the lattice of `placed` [m], 0 where there is none: of pixels that
/// have no point there, are not within its mask's dilation, and lie so far away that the noise
/// alone makes steps as large as BackProjectionOptions::max_jump. Each is the mean over the pixels
/// of the image around that are of one surface with it, as in a bilateral filter of two boxes
/// (Tomasi, Manduchi, ICCV 1998); where there are too few, it may be a depth jump, and is left out.
/// Throws Error if an option is out of range.
cv::Mat1f far_depths(const DepthSensor& sensor, const cv::Mat1f& depth, const cv::Mat1b& excluded,
                     const PointGrid& placed, const BackProjectionOptions& back_projection,
                     const FarOptions& options = {});

}  // namespace stillmap
