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

/// A frame with its true mask and pose.
struct PosedImage {
  RgbdFramePtr image;
  cv::Mat mask;         ///< Mask of the movable objects, 8UC1: not zero on them.
  Pose T_world_camera;  ///< True pose of the camera, translation in meters.
};

/// Returns the speed of the surfaces under the mask of `from` in the world, 32FC1 [m/s], 0 outside
/// the mask. Optical flow (DIS; Kroeger et al., ECCV 2016) finds each pixel in the other image;
/// depth and true poses give its displacement in the world. The displacements are averaged over a
/// window of the same mask, so that their noise (some millimeters each) does not look like motion.
/// Where the mask is too thin for displacements, the mean of the connected piece of the mask is
/// used; where the piece has none (the object has left the image), 4 m/s. The result is
/// independent of all quantities estimated by the evaluated systems.
cv::Mat measure_speed(const PosedImage& from, const PosedImage& to, const Camera& camera);

/// Measures the speeds in all frames of a sequence that have a mask and a true pose. Each frame is
/// compared with the frames 0.2 s and 0.3 s later (near the end: earlier), and the higher speed
/// counts. The speeds are written as PNGs named by timestamp, in units of kSpeedUnit, as
/// MotionTruthFolder reads them. The folder gets its name after all images are written.
/// @param done called after each frame; may be empty
/// @return number of images written. Throws Error if there is none, or a file cannot be written.
std::size_t write_speeds(FrameSource& source, const StampedImages& masks, const Trajectory& truth,
                         const std::filesystem::path& folder,
                         const std::function<void()>& done = {});

}  // namespace stillmap
