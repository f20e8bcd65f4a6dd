// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/camera_model.hpp"

#include <array>
#include <string>

#include <opencv2/core.hpp>

namespace stillmap {

/// One camera of a calibrated pair.
struct StereoCamera {
  RecordedCamera recorded;
  Pose T_rig_camera;  ///< Pose in a frame that both cameras share [m].
};

/// A rectified pair of cameras: a point has the same row in both images, and its column in the left
/// image is larger by its disparity, fx * baseline / depth.
struct StereoRig {
  /// Ideal pinhole camera of the left images; its baseline is that of the pair, its depth sensor
  /// stereo_sensor(), and its shutter global.
  Camera camera;
  /// Where the recorded images have to be sampled, left and right, as cv::convertMaps makes it;
  /// empty: the recorded images are rectified.
  struct Map {
    cv::Mat whole, fraction;
  };
  std::array<Map, 2> maps;
  cv::Mat outside;  ///< 8UC1, not 0 where a left pixel lies outside the recorded image; or empty.

  bool rectifies() const { return !maps[0].whole.empty(); }
};

/// Returns the rig of images that are rectified.
/// @param left      camera of the left images; its sensor, baseline and distortion are not used
/// @param baseline  distance of the right camera along the rows [m]
/// Throws Error naming `where` if the values are impossible.
StereoRig rectified_rig(const Camera& left, double baseline, const std::string& where);

/// Returns the rig that rectifies the images of two calibrated cameras of equal image size: both
/// are turned until their rows are parallel to the baseline (Fusiello, Trucco and Verri, "A compact
/// algorithm for rectification of stereo pairs", Machine Vision and Applications 2000). Images of
/// cameras that are rectified already are not changed.
/// @param fps  [Hz]
/// Throws Error naming `where` if the sizes differ, or if the second camera is not right of the
/// first.
StereoRig calibrated_rig(const StereoCamera& left, const StereoCamera& right, double fps,
                         const std::string& where);

/// Returns the rig for the user: "1226 x 370, f 707.1, baseline 0.537 m, rectified, depth from
/// 2.69 m".
std::string description(const StereoRig& rig);

/// Returns an image as the rig's left (side 0) or right camera (side 1) would have recorded it.
cv::Mat rectified(const StereoRig& rig, std::size_t side, const cv::Mat& recorded);

}  // namespace stillmap
