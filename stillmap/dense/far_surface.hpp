// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/dense/back_projection.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Standard deviation of a Kinect's depth z [m], the part that grows with z: 1.4e-3 z^2
/// (Khoshelham, Elberink, Sensors 2012).
inline float depth_sigma(float z) { return 1.4e-3F * z * z; }

/// Which pixels that back_project() leaves out are too uncertain to be placed as the others are,
/// but better than nothing where nobody came nearer.
struct FarOptions {
  double max_depth = 5.0;   ///< farther depths are left out; 0: no far surfaces at all [m]
  double deviations = 4.0;  ///< depths of one surface differ by at most so many standard deviations
  int window = 2;           ///< pixels around that a depth is averaged over
  double support = 0.4;     ///< share of those measured that must be of one surface with it
  int min_views = 1;        ///< voxels of far surfaces that fewer views show are dropped
  STILLMAP_FIELDS(max_depth, deviations, window, support, min_views)
};

/// Throws Error if an option is out of range.
void require_valid(const FarOptions& options);

/// Depths of far surfaces on the lattice of `placed` [m], 0 where there is none: of pixels that
/// have no point there, are not within its mask's dilation, and lie so far away that the noise
/// alone makes steps as large as BackProjectionOptions::max_jump. Each is the mean over the pixels
/// of the image around that are of one surface with it, as in a bilateral filter of two boxes
/// (Tomasi, Manduchi, ICCV 1998); where there are too few, it may be a depth jump, and is left out.
/// Throws Error if an option is out of range.
cv::Mat1f far_depths(const cv::Mat1f& depth, const cv::Mat1b& excluded, const PointGrid& placed,
                     const BackProjectionOptions& back_projection, const FarOptions& options = {});

}  // namespace stillmap
