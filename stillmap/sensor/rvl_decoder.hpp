// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/byte_cursor.hpp"
#include "stillmap/sensor/image_file.hpp"

namespace stillmap {

/// Decodes a depth image in RVL (Wilson, "Fast Lossless Depth Image Compression", ISS 2017) to
/// 16UC1. A number is a sequence of nibbles with three bits each, the lowest bits first; the
/// highest bit of a nibble is set if another one follows. Eight nibbles make a word, the first in
/// its highest bits. The image is a sequence of runs: the number of zeros, the number of other
/// pixels, and for each of these its difference from the previous one, zigzag-coded (0, -1, 1, -2,
/// ...).
/// @param bytes  width and height, then the words, all of 32 bits and little-endian, as
///               compressed_depth_image_transport of ROS writes them
/// Returns the problem if the image has another size, or a run is longer than the image. Throws
/// Error if the words end before the image.
ImageRead decode_rvl(ByteSpan bytes, cv::Size wanted);

}  // namespace stillmap
