// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/site_plan.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stillmap {

cv::Mat3b read_plan_image(const std::filesystem::path& file) {
  const auto [header, problem] = read_image_header(file);
  const std::string reason = problem.empty() ? color_problem(header) : problem;
  if (!reason.empty()) throw Error(reason, file.string(), "give a PNG, JPEG or TIFF image");
  const ImageRead read = read_color_image(file, header.size);
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
    const cv::Point at(static_cast<int>(std::floor(p.x() / plan.scale)),
                       plan.rows - 1 - static_cast<int>(std::floor(p.y() / plan.scale)));
    cv::circle(image, at, radius, color, cv::FILLED);
  }
}

}  // namespace stillmap
