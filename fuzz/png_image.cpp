// SPDX-License-Identifier: Apache-2.0
// PNG files of color, depth and masks. Their checksums are corrected, since no varied input would
// pass them.
#include "stillmap/sensor/image_file.hpp"

#include <libdeflate.h>

#include "fuzz/fuzz_target.hpp"
#include <opencv2/imgcodecs.hpp>

namespace {

using Bytes = std::vector<std::uint8_t>;

std::uint32_t number_at(const Bytes& bytes, std::size_t at) {
  std::uint32_t number = 0;
  for (std::size_t i = 0; i < 4; ++i) number = number << 8 | bytes[at + i];
  return number;
}

/// Returns the file with the CRC-32 of each chunk: its length (4 bytes), name (4), data, checksum
/// (4).
Bytes with_checksums(Bytes png) {
  constexpr std::size_t kSignature = 8;  // bytes
  for (std::size_t at = kSignature; png.size() - at >= 12;) {
    const std::uint32_t length = number_at(png, at);
    if (length > png.size() - at - 12) break;
    const std::uint32_t crc = libdeflate_crc32(0, &png[at + 4], length + 4);
    for (std::size_t i = 0; i < 4; ++i)
      png[at + 8 + length + i] = static_cast<std::uint8_t>(crc >> (24 - 8 * i));
    at += 12 + length;
  }
  return png;
}

std::string png_of(const cv::Mat& image) {
  Bytes png;
  cv::imencode(".png", image, png);
  return {png.begin(), png.end()};
}

cv::Mat pattern(int type) {
  cv::Mat image(6, 8, type);
  for (std::size_t i = 0; i < image.total() * image.elemSize(); ++i)
    image.data[i] = static_cast<std::uint8_t>(i * i);
  return image;
}

}  // namespace

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  std::vector<std::string> files;
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3})
    files.push_back(png_of(pattern(type)));
  return files;
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  constexpr int kLargestArea = 1 << 16;  // Larger images would only take time [pixels].
  if (size < 8) return 0;
  const Bytes png = with_checksums(Bytes(data, data + size));
  const auto [header, problem] = decode_image_header(png);
  if (!problem.empty()) return 0;
  const cv::Size size_read =
      static_cast<std::int64_t>(header.size.width) * header.size.height <= kLargestArea
          ? header.size
          : cv::Size(8, 6);
  const ImageRead color = decode_color_image(png, size_read);
  const ImageRead depth = decode_depth_image(png, size_read);
  if (color.problem.empty() != !color.image.empty()) std::abort();
  if (!color.image.empty() && (color.image.size() != size_read || color.image.type() != CV_8UC3))
    std::abort();
  if (!depth.image.empty() && (depth.image.size() != size_read || depth.image.type() != CV_16UC1))
    std::abort();
  ++fuzz::accepted;
  return 0;
}
