// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Which pixels of a keyframe become points.
struct BackProjectionOptions {
  int stride = 2;          ///< every n-th pixel in both directions [pixels]
  double min_depth = 0.3;  ///< nearer depths are left out [m]
  double max_depth = 4.0;  ///< farther depths are left out [m]
  double max_jump = 0.02;  ///< largest relative depth step to any of the eight neighbours
  int mask_dilation = 4;   ///< the excluded mask is grown by this much on every side [pixels]
  STILLMAP_FIELDS(stride, min_depth, max_depth, max_jump, mask_dilation)
};

/// The camera-frame points of a keyframe on the lattice of the pixels they came from.
struct PointGrid {
  cv::Mat3f points;  ///< ceil(height / stride) x ceil(width / stride); x, y, z [m]; z = 0 where
                     ///< there is none
  int stride = 1;    ///< entry (row, col) belongs to pixel (u, v) = (col, row) * stride
};

/// Back-projects the depth image, equation 2 of SLAM3-YOLOv8: x = (u - cx) z / fx, y = (v - cy) z /
/// fy. Left out are pixels without a valid depth in [min_depth, max_depth], pixels within
/// `mask_dilation` of a pixel that is not zero in `excluded`, and pixels at a depth jump: z differs
/// from the valid depth of a neighbour in the 3 x 3 window by more than max_jump * z. Such pixels
/// mix foreground and background.
/// @param excluded moving pixels, height x width, any value but zero; empty for none
/// Throws Error if the sizes of frame, mask and camera differ or an option is out of range.
PointGrid back_project(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& excluded,
                       const BackProjectionOptions& options = {});

}  // namespace stillmap
