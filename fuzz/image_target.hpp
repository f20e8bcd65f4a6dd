// SPDX-License-Identifier: Apache-2.0
// What the targets of image formats without checksums have in common.
#pragma once
#include "stillmap/sensor/image_file.hpp"

#include <cstdlib>
#include <span>

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

/// Decodes an image of the size that its header says, which must be a whole image or a problem.
/// @param decode  decode_color_image() or decode_depth_image()
template <typename Decode>
void parse_image(std::span<const unsigned char> bytes, Decode&& decode) {
  constexpr std::int64_t kLargestArea = 1 << 16;  // Larger images would only take time [pixels].
  const auto [header, problem] = decode_image_header(bytes);
  if (!problem.empty() || std::int64_t{header.size.width} * header.size.height > kLargestArea)
    return;
  const ImageRead read = decode(bytes, header.size);
  if (read.problem.empty() != !read.image.empty()) std::abort();
  if (!read.image.empty() && read.image.size() != header.size) std::abort();
  accepted += read.problem.empty() ? 1 : 0;
}

/// As above for depth images, which have one channel.
inline void parse_depth_image(std::span<const unsigned char> bytes) {
  parse_image(bytes, [](const auto& content, cv::Size wanted) {
    ImageRead read = decode_depth_image(content, wanted);
    if (!read.image.empty() && read.image.channels() != 1) std::abort();
    return read;
  });
}

}  // namespace stillmap::fuzz
