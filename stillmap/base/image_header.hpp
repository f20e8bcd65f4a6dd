// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <optional>
#include <span>

namespace stillmap {

/// Header of a PNG or JPEG image.
struct EncodedHeader {
  int width = 0, height = 0;  ///< Image size [pixels]; negative if the file declares 2^31 or more.
  int bits = 0;               ///< Bits per channel.
  int channels = 0;           ///< 1 gray, 2 gray with alpha, 3 color, 4 color with alpha.
};

/// Returns whether bytes begin with the signature of a PNG or JPEG file.
bool is_png(std::span<const std::uint8_t> bytes);
bool is_jpeg(std::span<const std::uint8_t> bytes);

/// Returns the header of a PNG or JPEG file without decoding the image; none for other formats and
/// for a damaged or incomplete header.
/// @param bytes  the file or its beginning
std::optional<EncodedHeader> encoded_header(std::span<const std::uint8_t> bytes);

}  // namespace stillmap
