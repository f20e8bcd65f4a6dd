// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/geometry/camera.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

namespace stillmap {

/// Returns the ideal pinhole camera of images reduced to half their width and height, for slow
/// computers. Pixel (u, v) covers pixels 2u, 2u + 1 and 2v, 2v + 1 of the full image, so its center
/// is at (2u + 0.5, 2v + 0.5). An odd last row or column is dropped. Throws Error if the images are
/// too small: less than 128 x 96 pixels.
Camera halved(const Camera& camera);

/// Returns the halved frame. Color and gray: mean of four pixels. Depth: mean of those of the four
/// readings within 3 % of the nearest, hence of one surface; 0 without a reading.
RgbdFrame halved(const RgbdFrame& frame);

}  // namespace stillmap
