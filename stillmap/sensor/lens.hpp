// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/recording/camera_model.hpp"

#include <utility>

#include <opencv2/core.hpp>

namespace stillmap {

/// Returns for each pixel of an ideal pinhole camera the pixel of the recorded image that shows the
/// same direction: its x and y, 32FC1 [pixels]. The recorded image has the same size, focal lengths
/// and principal point.
std::pair<cv::Mat, cv::Mat> rectification_maps(const Camera& pinhole, const LensDistortion& lens);

/// Brown's model of a lens.
struct BrownFit {
  Eigen::Matrix<double, 5, 1> coefficients;  ///< k1 k2 p1 p2 k3
  /// Largest difference from the lens in the images of the pinhole camera [pixels].
  double error = 0;
};

/// Fits Brown's model to a lens over the images of a pinhole camera (least squares).
BrownFit fit_brown(const Camera& pinhole, const LensDistortion& lens);

/// Returns the camera with the image size and the intrinsics of a recorded one, without distortion.
Camera pinhole_of(const RecordedCamera& recorded);

/// Returns the direction (x, y) of each pixel of a recorded image, as 32FC2: the point (x, y, 1)
/// lies on its ray.
cv::Mat ray_directions(const RecordedCamera& camera);

}  // namespace stillmap
