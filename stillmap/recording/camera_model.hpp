// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/pose.hpp"
#include "stillmap/recording/messages.hpp"

#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Distortion of a lens.
struct LensDistortion {
  enum class Model {
    kBrown,         ///< k1 k2 p1 p2 [k3 [k4 k5 k6 ...]], in OpenCV's order.
    kInverseBrown,  ///< The same polynomial maps distorted to ideal coordinates (librealsense).
    kFisheye        ///< Equidistant, k1 k2 k3 k4 (Kannala and Brandt, PAMI 2006).
  };
  Model model = Model::kBrown;
  std::vector<double> coefficients;  ///< Empty without distortion.

  bool operator==(const LensDistortion&) const = default;
};

/// Returns the model of this name, as ROS, librealsense, OpenCV, Kalibr, ORB-SLAM, stella_vslam and
/// nerfstudio write it, whatever its case and its separators: "plumb_bob", "KannalaBrandt8"; that
/// of pinhole cameras is Brown's, as is the empty name. None for other names.
std::optional<LensDistortion::Model> lens_model(const std::string& name);

/// Returns a lens.
/// @param model         name for lens_model()
/// @param coefficients  in OpenCV's order; zeros at the end do not count
/// Throws Error (naming `where`) for an unknown model with coefficients, and for more coefficients
/// than the model has.
LensDistortion lens_of(const std::string& model, std::vector<double> coefficients,
                       const std::string& where = "");

/// A camera as a recording describes it.
struct RecordedCamera {
  int width = 0, height = 0;              ///< Image size [pixels].
  double fx = 0, fy = 0, cx = 0, cy = 0;  ///< [pixels]
  LensDistortion lens;

  bool operator==(const RecordedCamera&) const = default;
};

/// Returns the camera of the full images of a message; none if the camera was not calibrated (focal
/// length 0).
/// @param rectified  whether the images of the topic are rectified: then P is used, not K. P is
/// also
///                   used if K is 0, as some programs publish rectified images
/// Throws Error for an unknown distortion model with coefficients, and for numbers that are not
/// finite or sizes beyond 16384 pixels.
std::optional<RecordedCamera> camera_of(const CameraInfoMessage& info, bool rectified);

/// A camera adapted to the size of the images.
struct SizedCamera {
  RecordedCamera camera;
  std::string how;  ///< "binned by 2 x 2", "scaled from 1280 x 720"; empty if unchanged.
};

/// Adapts a camera to images of this size. If it is not the size of the full image, region of
/// interest and binning of the message are applied (REP 104). If they do not lead to this size, the
/// camera is scaled if the aspect ratio is the same, otherwise returned unchanged.
/// @param full           result of camera_of()
/// @param width, height  [pixels]; 0 if unknown: region of interest and binning are applied
SizedCamera sized(const RecordedCamera& full, const CameraInfoMessage& info, int width, int height);

/// Returns the pose [m] of a camera of a stereo pair in the frame of the rectified left camera: at
/// -P[3] / P[0] along x and, if its images are not rectified, turned by the inverse of R. Returns
/// none if P or R is not filled in.
std::optional<Pose> pose_in_pair(const CameraInfoMessage& info, bool rectified);

}  // namespace stillmap
