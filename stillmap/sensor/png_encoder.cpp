// SPDX-License-Identifier: Apache-2.0
// Follows the PNG specification (W3C, 2nd edition, 2003); numbers are its sections.
#include "stillmap/sensor/png_encoder.hpp"

#include "stillmap/base/deflate.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <array>
#include <cstdint>
#include <stdexcept>
#include <string_view>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

void append_number(std::uint32_t number, std::string& to) {  // 7.1: high byte first
  for (int shift = 24; shift >= 0; shift -= 8) to += static_cast<char>(number >> shift & 0xffU);
}

/// Length, name, data, checksum of name and data (5.3).
void append_chunk(const char* name, std::string_view data, std::string& to) {
  append_number(static_cast<std::uint32_t>(data.size()), to);
  const std::size_t at = to.size();
  to.append(name).append(data);
  append_number(crc32(std::string_view(to).substr(at)), to);
}

std::string header_of(const cv::Mat& image) {  // 11.2.2
  constexpr char kGray = 0, kColor = 2, kColorWithAlpha = 6;
  std::string header;
  append_number(static_cast<std::uint32_t>(image.cols), header);
  append_number(static_cast<std::uint32_t>(image.rows), header);
  header += static_cast<char>(8 * image.elemSize1());
  header += image.channels() == 1 ? kGray : image.channels() == 3 ? kColor : kColorWithAlpha;
  return header.append(3, '\0');  // deflate, the five filters, no interlacing
}

/// Red first, high bytes first.
cv::Mat in_png_order(const cv::Mat& image) {
  cv::Mat ordered;
  if (image.channels() == 1) ordered = image;
  if (image.channels() == 3) cv::cvtColor(image, ordered, cv::COLOR_BGR2RGB);
  if (image.channels() == 4) cv::cvtColor(image, ordered, cv::COLOR_BGRA2RGBA);
  if (image.elemSize1() == 1) return ordered;
  cv::Mat swapped(ordered.size(), ordered.type());
  const std::size_t numbers = static_cast<std::size_t>(ordered.cols) * ordered.channels();
  for (int y = 0; y < ordered.rows; ++y) {
    const auto* from = ordered.ptr<std::uint16_t>(y);
    auto* to = swapped.ptr<std::uint16_t>(y);
    for (std::size_t i = 0; i < numbers; ++i)
      to[i] = static_cast<std::uint16_t>(from[i] << 8 | from[i] >> 8);
  }
  return swapped;
}

/// Each row after the number of its filter: the differences from the pixel to the left (9.2), which
/// is quick, and good for smooth depth and for drawings.
std::string filtered(const cv::Mat& ordered) {
  constexpr char kSub = 1;
  const std::size_t pixel = ordered.elemSize(), bytes = ordered.cols * pixel;
  std::string rows(static_cast<std::size_t>(ordered.rows) * (bytes + 1), kSub);
  for (int y = 0; y < ordered.rows; ++y) {
    const unsigned char* row = ordered.ptr(y);
    char* to = rows.data() + static_cast<std::size_t>(y) * (bytes + 1) + 1;
    std::copy_n(row, pixel, to);
    for (std::size_t i = pixel; i < bytes; ++i) to[i] = static_cast<char>(row[i] - row[i - pixel]);
  }
  return rows;
}

}  // namespace

std::string encode_png(const cv::Mat& image) {
  const TraceScope scope("encode PNG");
  constexpr std::array kTypes{CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3};
  if (image.empty() || std::ranges::find(kTypes, image.type()) == kTypes.end())
    throw std::invalid_argument("no image of a PNG file");
  constexpr int kLevel = 2;  // 6 takes twice the time for files smaller by 3 %
  std::string png = "\x89PNG\r\n\x1a\n";
  append_chunk("IHDR", header_of(image), png);
  append_chunk("IDAT", zlib_stream(filtered(in_png_order(image)), kLevel), png);
  append_chunk("IEND", "", png);
  return png;
}

}  // namespace stillmap
