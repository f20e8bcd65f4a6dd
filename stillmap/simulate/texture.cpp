// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/texture.hpp"

#include <algorithm>
#include <bit>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace stillmap::simulate {
namespace {

int log2_of_at_least(int size) { return std::bit_width(static_cast<unsigned>(size) - 1); }

Texture::Level pack(const cv::Mat& bgr) {
  Texture::Level level{log2_of_at_least(bgr.cols), log2_of_at_least(bgr.rows), {}};
  level.texels.reserve(bgr.total());
  for (int y = 0; y < bgr.rows; ++y) {
    for (int x = 0; x < bgr.cols; ++x) {
      const auto& c = bgr.at<cv::Vec3b>(y, x);
      level.texels.push_back(static_cast<std::uint32_t>(c[0] | c[1] << 8 | c[2] << 16));
    }
  }
  return level;
}

}  // namespace

Texture::Texture(const cv::Mat& bgr) {
  if (bgr.empty() || bgr.type() != CV_8UC3)
    throw std::invalid_argument("a texture needs a color image of three bytes per pixel");
  const cv::Size size(1 << log2_of_at_least(bgr.cols), 1 << log2_of_at_least(bgr.rows));
  cv::Mat level = bgr;
  if (level.size() != size) cv::resize(bgr, level, size, 0, 0, cv::INTER_CUBIC);
  levels_.push_back(pack(level));
  while (level.cols > 1 || level.rows > 1) {
    cv::Mat half;
    cv::resize(level, half, {std::max(1, level.cols / 2), std::max(1, level.rows / 2)}, 0, 0,
               cv::INTER_AREA);
    level = half;
    levels_.push_back(pack(level));
  }
}

}  // namespace stillmap::simulate
