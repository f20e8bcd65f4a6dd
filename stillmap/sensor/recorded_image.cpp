// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/recorded_image.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/printable.hpp"
#include "stillmap/sensor/rvl_decoder.hpp"

#include <cmath>
#include <cstring>
#include <limits>
#include <optional>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kCopy = -1;  // Instead of a code of cv::cvtColor: the pixels are BGR.

/// How the pixels of an encoding are stored, and converted to BGR.
struct ColorFormat {
  int type;
  int conversion;
};

// Encodings of ROS (sensor_msgs/image_encodings.h) with 8 bits per channel. A Bayer pattern is
// called by its first two pixels in ROS, and by the second and third of the second row in OpenCV.
std::optional<ColorFormat> color_format(const std::string& encoding) {
  struct Named {
    const char* name;
    ColorFormat format;
  };
  static constexpr Named kFormats[] = {{"bgr8", {CV_8UC3, kCopy}},
                                       {"8UC3", {CV_8UC3, kCopy}},
                                       {"rgb8", {CV_8UC3, cv::COLOR_RGB2BGR}},
                                       {"rgba8", {CV_8UC4, cv::COLOR_RGBA2BGR}},
                                       {"bgra8", {CV_8UC4, cv::COLOR_BGRA2BGR}},
                                       {"mono8", {CV_8UC1, cv::COLOR_GRAY2BGR}},
                                       {"8UC1", {CV_8UC1, cv::COLOR_GRAY2BGR}},
                                       {"yuv422", {CV_8UC2, cv::COLOR_YUV2BGR_UYVY}},
                                       {"uyvy", {CV_8UC2, cv::COLOR_YUV2BGR_UYVY}},
                                       {"yuv422_yuy2", {CV_8UC2, cv::COLOR_YUV2BGR_YUY2}},
                                       {"yuyv", {CV_8UC2, cv::COLOR_YUV2BGR_YUY2}},
                                       {"bayer_rggb8", {CV_8UC1, cv::COLOR_BayerBG2BGR}},
                                       {"bayer_bggr8", {CV_8UC1, cv::COLOR_BayerRG2BGR}},
                                       {"bayer_gbrg8", {CV_8UC1, cv::COLOR_BayerGR2BGR}},
                                       {"bayer_grbg8", {CV_8UC1, cv::COLOR_BayerGB2BGR}}};
  for (const auto& [name, format] : kFormats) {
    if (encoding == name) return format;
  }
  return std::nullopt;
}

std::string size_problem_of(std::uint32_t width, std::uint32_t height, cv::Size wanted) {
  if (width == static_cast<std::uint32_t>(wanted.width) &&
      height == static_cast<std::uint32_t>(wanted.height))
    return "";
  return fmt::format("is {} x {} pixels where the camera has {} x {}", width, height, wanted.width,
                     wanted.height);
}

// Returns the pixels of a message as a view of its bytes, or the problem.
ImageRead pixels_of(const ImageMessage& image, int type, cv::Size wanted) {
  if (const auto problem = size_problem_of(image.width, image.height, wanted); !problem.empty())
    return {{}, problem};
  if (image.step < image.width * CV_ELEM_SIZE(type))
    return {{},
            fmt::format("has rows of {} bytes, too few for {} pixels", image.step, image.width)};
  if (image.step % CV_ELEM_SIZE1(type) != 0)
    return {{}, fmt::format("has rows of {} bytes, which are no whole numbers", image.step)};
  return {cv::Mat(wanted, type, const_cast<std::uint8_t*>(image.data.data()), image.step), ""};
}

ImageRead color_pixels(const ImageMessage& image, cv::Size wanted) {
  const auto format = color_format(image.encoding);
  if (!format)
    return {{},
            fmt::format("has the pixel format '{}', which is not read", printable(image.encoding))};
  ImageRead read = pixels_of(image, format->type, wanted);
  if (!read.problem.empty()) return read;
  cv::Mat bgr;
  if (format->conversion == kCopy) {
    bgr = read.image.clone();
  } else {
    try {
      cv::cvtColor(read.image, bgr, format->conversion);
    } catch (const cv::Exception&) {  // such as an odd width of YUV images
      return {{},
              fmt::format("has the pixel format '{}', in which no image is {} pixels wide",
                          image.encoding, image.width)};
    }
  }
  return {bgr, ""};
}

void swap_bytes(cv::Mat& image) {
  const std::size_t size = image.elemSize();
  for (int y = 0; y < image.rows; ++y) {
    for (int x = 0; x < image.cols; ++x) std::reverse(image.ptr(y, x), image.ptr(y, x) + size);
  }
}

ImageRead depth_pixels(const ImageMessage& image, cv::Size wanted) {
  const bool meters = image.encoding == "32FC1";
  if (!meters && image.encoding != "16UC1" && image.encoding != "mono16")
    return {
        {},
        fmt::format("has the pixel format '{}', which is not depth", printable(image.encoding))};
  ImageRead read = pixels_of(image, meters ? CV_32FC1 : CV_16UC1, wanted);
  if (!read.problem.empty()) return read;
  read.image = read.image.clone();
  if (image.big_endian) swap_bytes(read.image);
  return read;
}

// Depth of compressed_depth_image_transport: parameters (format, a, b), then a PNG file or RVL
// code. The pixels of a 32FC1 image are quantized inverse depths: depth = a / (value - b), 0:
// unknown.
ImageRead compressed_depth(const ImageStream& stream, const CompressedImageMessage& message,
                           cv::Size wanted) {
  if (message.data.size() < kCompressedDepthParameters) return {{}, "is truncated"};
  const ByteSpan code = message.data.subspan(kCompressedDepthParameters);
  const bool rvl = message.format.find("rvl") != std::string::npos;
  ImageRead read = rvl ? decode_rvl(code, wanted) : decode_depth_image(code, wanted);
  if (!read.problem.empty() || stream.encoding != "32FC1" || read.image.type() != CV_16UC1)
    return read;
  float a = 0, b = 0;
  std::memcpy(&a, message.data.data() + 4, sizeof a);
  std::memcpy(&b, message.data.data() + 8, sizeof b);
  cv::Mat1f meters(wanted);
  for (int y = 0; y < wanted.height; ++y) {
    for (int x = 0; x < wanted.width; ++x) {
      const auto value = read.image.at<std::uint16_t>(y, x);
      meters(y, x) = value == 0 ? 0.0F : a / (static_cast<float>(value) - b);
    }
  }
  return {meters, ""};
}

}  // namespace

ImageRead decode_recorded_color(const ImageStream& stream, const std::string& encoding,
                                ByteSpan message, cv::Size wanted) {
  try {
    if (stream.storage == ImageStorage::kPixels)
      return color_pixels(decode_image(message, encoding), wanted);
    return decode_color_image(decode_compressed_image(message, encoding).data, wanted);
  } catch (const Error& error) {
    return {{}, "is damaged: " + error.problem()};
  }
}

ImageRead decode_recorded_depth(const ImageStream& stream, const std::string& encoding,
                                ByteSpan message, cv::Size wanted) {
  try {
    if (stream.storage == ImageStorage::kPixels)
      return depth_pixels(decode_image(message, encoding), wanted);
    const CompressedImageMessage image = decode_compressed_image(message, encoding);
    if (stream.storage == ImageStorage::kCompressedDepth)
      return compressed_depth(stream, image, wanted);
    return decode_depth_image(image.data, wanted);
  } catch (const Error& error) {
    return {{}, "is damaged: " + error.problem()};
  }
}

}  // namespace stillmap
