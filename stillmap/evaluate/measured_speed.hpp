// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/stamped_images.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/trajectory.hpp"
#include "stillmap/sensor/frame_source.hpp"

#include <cstddef>
#include <filesystem>
#include <functional>

#include <opencv2/core.hpp>

namespace stillmap {

struct SpeedOptions {
  double lapse = 0.2;         ///< between the two pictures that are compared [s]
  double second_lapse = 0.3;  ///< and between two others; the higher speed counts, so that what
                              ///< swings back to its place meanwhile does not pass for still
  int window = 25;            ///< side of the square over which displacements are averaged [pixels]
  int outline_margin = 4;     ///< displacements this near to a mask's outline are not used [pixels]
  double max_speed = 4;       ///< faster ones are slips of the flow [m/s]
  double min_support = 0.1;   ///< share of a window that must have displacements
};

/// A picture with its true mask and pose.
struct PosedPicture {
  RgbdFramePtr image;
  cv::Mat mask;  ///< 8UC1: not zero on what can move
  Pose T_world_camera;
};

/// How fast what a mask covers moves through the world, by what can be seen: optical flow (DIS;
/// Kroeger et al., ECCV 2016) from one picture to the other tells where each pixel went, depth and
/// true poses how far that is in the world. The displacement vectors are averaged over a window of
/// the same mask, so that their noise (some millimeters each) does not pass for motion. 32FC1 m/s;
/// 0 outside the mask. Where the mask is too thin for a displacement, that of the whole piece of
/// mask counts; where there is none at all (the thing has left the picture): max_speed. Independent
/// of everything that the systems judged by it estimate.
cv::Mat measure_speed(const PosedPicture& from, const PosedPicture& to, const Camera& camera,
                      const SpeedOptions& options = {});

/// Measures the speeds in all frames of a sequence that have a mask and a true pose, each against
/// the pictures one lapse and the other later (toward the end: earlier), and writes them as PNGs
/// named by stamps, in units of kSpeedUnit: what MotionTruthFolder reads. The folder comes into
/// being when all are written.
/// @param done called after each frame; may be empty
/// @return images written. Throws Error where there is none to write, or a file cannot be written.
std::size_t write_speeds(FrameSource& source, const StampedImages& masks, const Trajectory& truth,
                         const std::filesystem::path& folder, const SpeedOptions& options = {},
                         const std::function<void()>& done = {});

}  // namespace stillmap
