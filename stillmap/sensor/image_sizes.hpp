// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/sequence.hpp"

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Sizes of the images of a folder [pixels].
struct ImageSizes {
  cv::Size color, depth;
  bool operator==(const ImageSizes&) const = default;

  /// Returns whether the color images are larger than the depth images and have the same aspect
  /// ratio, within a pixel. Phones record such images.
  bool color_is_larger() const;
};

/// Returns the most frequent sizes in a sample of the frames, from the headers of their images;
/// none if no image pair of the sample can be read.
std::optional<ImageSizes> image_sizes(const std::vector<FrameFiles>& frames);

/// Returns the size of the color images: that of the camera, or a larger one if the camera has the
/// size of the depth images.
cv::Size color_size(const std::vector<FrameFiles>& frames, const Camera& camera);

/// Returns the camera of images scaled to another size of the same aspect ratio. Pixel (0, 0) is
/// the center of the upper left pixel.
Camera scaled_to(const Camera& camera, cv::Size size);

}  // namespace stillmap
