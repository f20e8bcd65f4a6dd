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

  /// Returns whether the color images are larger than the depth images and have their aspect ratio,
  /// within a pixel, as those of phones.
  bool color_is_larger() const;
};

/// Returns the sizes that most of some frames have, by the headers of their images; none if no
/// image pair of these frames can be read.
std::optional<ImageSizes> image_sizes(const std::vector<FrameFiles>& frames);

/// Returns the size of the color images that belong to a camera: its own, or a larger one if it is
/// that of the depth images.
cv::Size color_size(const std::vector<FrameFiles>& frames, const Camera& camera);

/// Returns the camera of images that are scaled to another size of the same aspect ratio. Pixel
/// (0, 0) is the center of the upper left pixel.
Camera scaled_to(const Camera& camera, cv::Size size);

}  // namespace stillmap
