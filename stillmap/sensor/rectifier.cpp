// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/rectifier.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/lens.hpp"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {

Rectifier::Rectifier(const Camera& recorded)
    : Rectifier(recorded, {.model = LensDistortion::Model::kBrown,
                           .coefficients = recorded.distorted()
                                               ? std::vector<double>(recorded.distortion.begin(),
                                                                     recorded.distortion.end())
                                               : std::vector<double>()}) {}

Rectifier::Rectifier(const Camera& recorded, const LensDistortion& lens) : camera_(recorded) {
  camera_.distortion.setZero();
  camera_.disparity_bias = {};
  if (lens.coefficients.empty()) return;
  const auto [x, y] = rectification_maps(camera_, lens);
  cv::convertMaps(x, y, whole_map_, fraction_map_, CV_16SC2, /*nninterpolation=*/false);
  cv::Mat unused;
  cv::convertMaps(x, y, nearest_map_, unused, CV_16SC2, /*nninterpolation=*/true);
}

cv::Mat Rectifier::image(const cv::Mat& recorded) const {
  check(recorded);
  if (!active()) return recorded;
  cv::Mat rectified;
  cv::remap(recorded, rectified, whole_map_, fraction_map_, cv::INTER_LINEAR, cv::BORDER_REPLICATE);
  return rectified;
}

cv::Mat Rectifier::nearest(const cv::Mat& recorded) const {
  check(recorded);
  if (!active()) return recorded;
  cv::Mat rectified;
  cv::remap(recorded, rectified, nearest_map_, cv::noArray(), cv::INTER_NEAREST,
            cv::BORDER_CONSTANT, cv::Scalar::all(0));
  return rectified;
}

void Rectifier::check(const cv::Mat& recorded) const {
  if (recorded.cols == camera_.width && recorded.rows == camera_.height) return;
  throw Error(fmt::format("an image of {} x {} pixels cannot be rectified for a camera of {} x {}",
                          recorded.cols, recorded.rows, camera_.width, camera_.height),
              "camera '" + camera_.name + "'", "give images of the camera's size");
}

}  // namespace stillmap
