// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Which pixels of a keyframe become points. Defaults from clouds of 25 to 30 keyframes of two 640
/// x 480 sequences with walking people, one rendered with exact poses, one recorded with a Kinect.
/// "Surface" is counted in 5 cm voxels of the unmasked cloud at stride 2; the figures are the
/// rendered sequence's.
/// - stride 1 takes four times as long and shows no more surface; stride 3 loses 6 % of it;
/// - depths are used up to a standard deviation of 2.6 voxels of 1 cm, which a Kinect v1 reaches at
///   4 m;
/// - a jump of 1 % also drops 4 % of the surface (the Kinect's depth steps are 7 cm at 5 m, ibid.,
/// and on a
///   slanted surface z changes by tan(slant) / f per pixel); beyond 2 % no more surface is gained;
/// - masks that are 6 pixels too small leave 0.64 % ghosts after a dilation by 4, 0.13 % after 6,
/// 0.06 %
///   after 10; with exact masks 6 costs 0.3 %, 10 costs 0.9 % of the surface more than 4.
struct BackProjectionOptions {
  int stride = 2;               ///< every n-th pixel in both directions [pixels]
  double max_sigma = 0.025824;  ///< Standard deviation of a depth up to which it is used [m].
  double max_jump = 0.02;       ///< largest relative depth step to any of the eight neighbors
  int mask_dilation = 6;        ///< the excluded mask is grown by this much on every side [pixels]
};

/// A mask grown by a square of this many pixels on every side.
cv::Mat1b dilated(const cv::Mat1b& mask, int radius);

/// The camera-frame points of a keyframe on the lattice of the pixels they came from.
struct PointGrid {
  cv::Mat3f points;  ///< ceil(height / stride) x ceil(width / stride); x, y, z [m]; z = 0 where
                     ///< there is none
  int stride = 1;    ///< entry (row, col) belongs to pixel (u, v) = (col, row) * stride
};

/// Back-projects the depth image, equation 2 of SLAM3-YOLOv8: x = (u - cx) z / fx, y = (v - cy) z /
/// fy. Left out are pixels without a depth, pixels nearer than the sensor measures or whose
/// depth it measures with a standard deviation above `max_sigma`, pixels within `mask_dilation` of
/// a pixel that is not zero in `excluded`, and pixels at a depth jump: z differs from the valid
/// depth of a neighbor in the 3 x 3 window by more than max_jump * z. Such pixels mix foreground
/// and background.
/// @param excluded moving pixels, height x width, any value but zero; empty for none
/// Throws Error if the sizes of frame, mask and camera differ or an option is out of range.
PointGrid back_project(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& excluded,
                       const BackProjectionOptions& options = {});

}  // namespace stillmap
