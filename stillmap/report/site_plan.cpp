// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/site_plan.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stillmap {

cv::Mat3b read_plan_image(const std::filesystem::path& file) {
  const ImageRead read = read_color_image(file, read_image_header(file).header.size);
  if (!read.problem.empty())
    throw Error(read.problem, file.string(), "give a PNG, JPEG or TIFF image");
  return read.image;
}

void draw_on_plan(const std::vector<Surfel>& surfels, const SitePlan& plan, cv::Mat3b& image) {
  constexpr double kLowest = 0.3, kHighest = 2;  // [m]
  const cv::Scalar color(40, 40, 214);
  const int radius = std::max(1, static_cast<int>(std::lround(kFloorSurfel / 2 / plan.scale)));
  for (const Surfel& surfel : surfels) {
    const Eigen::Vector3d& p = surfel.point;
    if (p.z() < kLowest || p.z() > kHighest) continue;
    const Eigen::Vector2i at = plan.in_image(p).array().floor().matrix().cast<int>();
    cv::circle(image, {at.x(), at.y()}, radius, color, cv::FILLED);
  }
}

}  // namespace stillmap
