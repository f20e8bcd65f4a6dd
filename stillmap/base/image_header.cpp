// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/image_header.hpp"

#include <algorithm>
#include <array>

namespace stillmap {
namespace {

using View = std::span<const std::uint8_t>;

constexpr std::array<std::uint8_t, 8> kPngSignature{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr std::array<std::uint8_t, 3> kJpegSignature{0xff, 0xd8, 0xff};

template <std::size_t N>
bool starts_with(View bytes, const std::array<std::uint8_t, N>& signature) {
  return bytes.size() >= N && std::equal(signature.begin(), signature.end(), bytes.begin());
}

int big_endian(View bytes) {
  std::uint32_t value = 0;
  for (const std::uint8_t byte : bytes) value = value << 8 | byte;
  return static_cast<int>(value);
}

// The header chunk comes first and has 13 bytes: width, height, bits, color type, three methods.
// PNG specification (W3C, 2nd edition, 2003), 11.2.2.
std::optional<EncodedHeader> png_header(View bytes) {
  constexpr std::array<std::uint8_t, 4> kName{'I', 'H', 'D', 'R'};
  if (bytes.size() < 33 || !starts_with(bytes.subspan(12), kName)) return std::nullopt;
  EncodedHeader header{big_endian(bytes.subspan(16, 4)), big_endian(bytes.subspan(20, 4)),
                       bytes[24], 0};
  switch (bytes[25]) {
    case 0:
      header.channels = 1;
      break;  // gray
    case 2:
      header.channels = 3;
      break;  // color
    case 3:   // an index into a palette of 8-bit colors
      header.channels = 3;
      header.bits = 8;
      break;
    case 4:
      header.channels = 2;
      break;  // gray with alpha
    case 6:
      header.channels = 4;
      break;  // color with alpha
    default:
      return std::nullopt;
  }
  return header;
}

// Parses the marker segments up to the frame header (SOF). ITU T.81, annex B.
std::optional<EncodedHeader> jpeg_header(View bytes) {
  for (std::size_t at = 2; at + 10 <= bytes.size();) {
    if (bytes[at] != 0xff) return std::nullopt;
    const std::uint8_t marker = bytes[at + 1];
    if (marker == 0xff) {  // fill byte
      ++at;
      continue;
    }
    const bool frame_header =
        marker >= 0xc0 && marker <= 0xcf && marker != 0xc4 && marker != 0xc8 && marker != 0xcc;
    if (frame_header) {
      return EncodedHeader{big_endian(bytes.subspan(at + 7, 2)),
                           big_endian(bytes.subspan(at + 5, 2)), bytes[at + 4], bytes[at + 9]};
    }
    at += 2 + static_cast<std::size_t>(big_endian(bytes.subspan(at + 2, 2)));
  }
  return std::nullopt;
}

}  // namespace

bool is_png(View bytes) { return starts_with(bytes, kPngSignature); }

bool is_jpeg(View bytes) { return starts_with(bytes, kJpegSignature); }

std::optional<EncodedHeader> encoded_header(View bytes) {
  if (is_png(bytes)) return png_header(bytes);
  if (is_jpeg(bytes)) return jpeg_header(bytes);
  return std::nullopt;
}

}  // namespace stillmap
