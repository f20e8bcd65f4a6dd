// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_image.hpp"

#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// Largest ratios of the sizes of a mask and its frame. Networks give masks of a quarter of the
// image's size.
constexpr int kMostReduced = 8, kMostEnlarged = 4;
constexpr int kOther = 128;  // Value of a moving object that is no person.

bool has_shape_of(const cv::Size& mask, const cv::Size& frame) {
  const auto other_width = std::int64_t{mask.width} * frame.height / std::max(mask.height, 1);
  return std::abs(other_width - frame.width) <= 1 && mask.width <= kMostReduced * frame.width &&
         frame.width <= kMostEnlarged * mask.width;
}

bool are_equal(const cv::Mat& a, const cv::Mat& b) { return cv::norm(a, b, cv::NORM_INF) == 0; }

/// Returns the pixels of the only color beside black, with the value kOther; an empty image if
/// there is no black or more than one other color.
cv::Mat one_color_of(const std::vector<cv::Mat>& channels) {
  cv::Mat colored = cv::Mat::zeros(channels.front().size(), CV_8U);
  for (const cv::Mat& channel : channels) colored |= channel > 0;
  if (cv::countNonZero(colored == 0) == 0) return {};
  for (const cv::Mat& channel : channels) {
    double low = 0, high = 0;
    cv::minMaxLoc(channel, &low, &high, nullptr, nullptr, colored);
    if (low < high) return {};
  }
  return colored & kOther;
}

/// Returns the gray channel, or the pixels of the only color beside black; an empty image if there
/// are more colors or alpha is not opaque.
cv::Mat gray_of(const cv::Mat& image) {
  std::vector<cv::Mat> channels;
  cv::split(image, channels);
  if (channels.size() == 2 || channels.size() == 4) {
    const double opaque = image.depth() == CV_16U ? 0xffff : 0xff;
    if (cv::countNonZero(channels.back() != opaque) > 0) return {};
    channels.pop_back();
  }
  for (const cv::Mat& channel : channels) {
    if (!are_equal(channel, channels.front())) return one_color_of(channels);
  }
  return channels.front();
}

/// Converts 16-bit to 8-bit values. Returns an empty image if they are neither below 256 nor 8-bit
/// values scaled by 257.
cv::Mat1b eight_bits_of(const cv::Mat& image) {
  constexpr int kStretched = 0x101;
  cv::Mat small, stretched;
  image.convertTo(small, CV_8U);
  small.convertTo(stretched, CV_16U);
  if (are_equal(image, stretched)) return small;
  image.convertTo(small, CV_8U, 1.0 / kStretched);
  small.convertTo(stretched, CV_16U, kStretched);
  return are_equal(image, stretched) ? cv::Mat1b(small) : cv::Mat1b();
}

MaskRead mask_of(const cv::Mat& image) {
  if (image.empty() || (image.depth() != CV_8U && image.depth() != CV_16U))
    return {{}, "cannot be decoded: it is damaged"};
  const cv::Mat gray = gray_of(image);
  if (gray.empty()) return {{}, "has colors (palette or channels), so its values are no classes"};
  if (gray.depth() == CV_8U) return {gray, ""};
  const cv::Mat1b mask = eight_bits_of(gray);
  if (!mask.empty()) return {mask, ""};
  return {{}, "has 16-bit values above 255, so its values are no classes"};
}

}  // namespace

MaskRead read_mask(const std::filesystem::path& file, cv::Size frame) {
  // The header is read first: an image of another size may be larger than the memory.
  const auto [header, problem] = read_image_header(file);
  if (!problem.empty()) return {{}, problem};
  if (!has_shape_of(header.size, frame)) {
    return {{},
            fmt::format("is {} x {} pixels where the frame has {} x {}", header.size.width,
                        header.size.height, frame.width, frame.height)};
  }
  const ImageRead stored = read_stored_image(file);
  if (!stored.problem.empty()) return {{}, stored.problem};
  MaskRead read = mask_of(stored.image);
  if (!read.mask.empty() && read.mask.size() != frame)
    cv::resize(read.mask, read.mask, frame, 0, 0, cv::INTER_NEAREST);
  return read;
}

}  // namespace stillmap
