// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Use of pixels that back_project() leaves out as too uncertain, where no nearer view exists.
struct FarOptions {
  /// Standard deviation of a depth up to which it is used [m]; 0 for no far surfaces at all. The
  /// default is that of a Kinect v1 at 5 m.
  double max_sigma = 0.041404;
};

/// Returns depths of far surfaces on the lattice of `placed` [m], 0 for none: of pixels without a
/// point, outside the dilated mask, and so far away that the noise alone causes steps as large as
/// BackProjectionOptions::max_jump. Each is the mean of the surrounding pixels of its surface, as
/// in a bilateral filter of two boxes (Tomasi, Manduchi, ICCV 1998); pixels with too few of them
/// are left out, as they may be at a depth jump. Throws Error if an option is out of range.
cv::Mat1f far_depths(const DepthSensor& sensor, const cv::Mat1f& depth, const cv::Mat1b& excluded,
                     const PointGrid& placed, const BackProjectionOptions& back_projection,
                     const FarOptions& options = {});

}  // namespace stillmap
