// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// Selection of the pixels of a keyframe that become points. The defaults are from clouds of 25 to
/// 30 keyframes of two sequences of 640 x 480 pixels with walking people, one rendered with exact
/// poses, one recorded with a Kinect. The figures are those of the rendered sequence, with surface
/// counted in 5 cm voxels of the unmasked cloud at stride 2.
/// - Stride 1 takes four times as long without more surface; stride 3 loses 6 % of it.
/// - Depths are used up to a standard deviation of 2.6 voxels of 1 cm, that of a Kinect v1 at 4 m.
/// - A jump of 1 % also drops 4 % of the surface (the Kinect's depth steps are 7 cm at 5 m, and on
/// a
///   slanted surface z changes by tan(slant) / f per pixel); above 2 % no more surface is gained.
/// - Masks that are 6 pixels too small leave 0.64 % ghosts after a dilation by 4 pixels, 0.13 %
/// after
///   6, 0.06 % after 10; with exact masks 6 loses 0.3 % and 10 0.9 % more of the surface than 4.
struct BackProjectionOptions {
  int stride = 2;               ///< Distance of the used pixels in both directions [pixels].
  double max_sigma = 0.025824;  ///< Standard deviation of a depth up to which it is used [m].
  double max_depth = 0;         ///< Largest depth used [m]; 0: `max_sigma` decides.
  /// Limit of at_jump() relative to the depth, at least kJumpNoise; infinite to use depth edges.
  double max_jump = 0.02;
  int mask_dilation = 6;  ///< Dilation of the excluded mask on every side [pixels].
};

/// Returns whether a pixel lies at a depth discontinuity: the depth of one of its eight neighbors
/// differs by more than `limit` [m] from the depth of the pixel, and also from the depth that a
/// plane through the pixel and the opposite neighbor has there.
bool at_jump(const cv::Mat1f& depth, int u, int v, float limit);

/// Least limit of at_jump() for measured depths, which noise does not exceed [standard deviations
/// of one depth].
inline constexpr float kJumpNoise = 9;

/// Returns a mask dilated by this many pixels on every side.
cv::Mat1b dilated(const cv::Mat1b& mask, int radius);

/// The camera-frame points of a keyframe on the lattice of their pixels.
struct PointGrid {
  cv::Mat3f points;  ///< ceil(height / stride) x ceil(width / stride); x, y, z [m], z = 0 for none.
  int stride = 1;    ///< Entry (row, col) belongs to pixel (u, v) = (col, row) * stride.
};

/// Back-projects the depth image, equation 2 of SLAM3-YOLOv8: x = (u - cx) z / fx, y = (v - cy) z /
/// fy. Left out are pixels without a depth, pixels nearer than the sensor's range or with a
/// standard deviation of depth above `max_sigma`, pixels within `mask_dilation` of an excluded
/// pixel, and pixels at a depth discontinuity (at_jump()), as these mix foreground and background.
/// @param excluded moving pixels (not zero), height x width; empty for none
/// Throws Error if the sizes of frame, mask and camera differ or an option is out of range.
PointGrid back_project(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& excluded,
                       const BackProjectionOptions& options = {});

}  // namespace stillmap
