// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/track/tracker.hpp"

#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

/// The images with which papers on SLAM in dynamic scenes explain their methods. All are 8UC3 BGR,
/// with a line of text below.
namespace stillmap {

/// Returns the color of a class (B G R), the same in all images: a bright one that depends on the
/// name alone.
cv::Scalar class_color(const std::string& class_name);

/// Draws the box of every instance with class and confidence, and its mask, in the color of its
/// class.
cv::Mat draw_objects(const Frame& frame);

/// Draws the optical flow of the keypoints as arrows on the gray image: red for those labeled as
/// moving, green for all others. Short arrows are enlarged, by a factor that the text names.
/// @param flow  flow of each keypoint of the frame since the previous one
cv::Mat draw_flow(const Frame& frame, const KeypointFlow& flow);

/// Draws all keypoints (left, those labeled as moving in red) and the remaining ones (right).
cv::Mat draw_kept_keypoints(const Frame& frame);

/// Draws the depth image as it is (left) and without the pixels of movers (right), whose outlines
/// are white. Near is bright; pixels without depth are black.
/// @param movers  not zero on movers, height x width; empty for none
cv::Mat draw_blanked_depth(const RgbdFrame& frame, const cv::Mat1b& movers);

/// Draws a map of landmarks with removed points in red (left), and without them (right), seen from
/// behind and above the cameras; points in the world [m].
/// @param removed_kind  name of the removed points for the caption, in the plural
cv::Mat draw_sparse_map(std::span<const Eigen::Vector3f> landmarks,
                        std::span<const Eigen::Vector3f> removed, const std::string& removed_kind,
                        const Trajectory& cameras);

}  // namespace stillmap
