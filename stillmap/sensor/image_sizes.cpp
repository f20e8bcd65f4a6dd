// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/image_sizes.hpp"

#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>

namespace stillmap {

bool ImageSizes::color_is_larger() const {
  if (color.width <= depth.width || color.height <= depth.height || depth.empty()) return false;
  const double scale = static_cast<double>(depth.height) / color.height;
  return std::abs(color.width * scale - depth.width) < 1;
}

std::optional<ImageSizes> image_sizes(const std::vector<FrameFiles>& frames) {
  constexpr std::size_t kMost = 9;  // frames
  std::vector<ImageSizes> found;
  const std::size_t count = std::min(kMost, frames.size());
  for (std::size_t i = 0; i < count; ++i) {
    const FrameFiles& files = frames[i * frames.size() / count];
    if (files.depth.empty()) continue;
    const HeaderRead color = read_image_header(files.color), depth = read_image_header(files.depth);
    if (color.problem.empty() && depth.problem.empty())
      found.push_back({color.header.size, depth.header.size});
  }
  if (found.empty()) return std::nullopt;
  const auto votes = [&](const ImageSizes& sizes) {
    return std::count(found.begin(), found.end(), sizes);
  };
  return *std::max_element(found.begin(), found.end(),
                           [&](const auto& a, const auto& b) { return votes(a) < votes(b); });
}

cv::Size color_size(const std::vector<FrameFiles>& frames, const Camera& camera) {
  const cv::Size size(camera.width, camera.height);
  const auto sizes = image_sizes(frames);
  return sizes && sizes->depth == size && sizes->color_is_larger() ? sizes->color : size;
}

Camera scaled_to(const Camera& camera, cv::Size size) {
  const double x = static_cast<double>(size.width) / camera.width,
               y = static_cast<double>(size.height) / camera.height;
  Camera scaled = camera;
  scaled.width = size.width;
  scaled.height = size.height;
  scaled.fx *= x;
  scaled.fy *= y;
  scaled.cx = (camera.cx + 0.5) * x - 0.5;
  scaled.cy = (camera.cy + 0.5) * y - 0.5;
  return scaled;
}

}  // namespace stillmap
