// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/rectifier.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/lens.hpp"

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Returns the mask of the ignored pixels of a camera, 8UC1, 255 or 0; empty if there are none.
cv::Mat ignored_pixels(const Camera& camera) {
  if (camera.ignore.empty()) return {};
  const auto fail = [&](const std::string& problem) {
    throw Error(problem, camera.ignore,
                fmt::format("give an 8-bit PNG of {} x {} pixels: white where the images show the "
                            "robot itself, black elsewhere",
                            camera.width, camera.height));
  };
  const ImageRead read = read_color_image(camera.ignore, {camera.width, camera.height});
  if (!read.problem.empty()) fail(read.problem);
  cv::Mat black;
  cv::inRange(read.image, cv::Scalar::all(0), cv::Scalar::all(0), black);
  const cv::Mat pixels = ~black;
  const int count = cv::countNonZero(pixels);
  if (count == 0) fail("is black everywhere, so that no pixel is ignored");
  if (count == camera.width * camera.height) fail("is black nowhere, so that no pixel is used");
  return pixels;
}

}  // namespace

Rectifier::Rectifier(const Camera& recorded)
    : Rectifier(recorded, {.model = LensDistortion::Model::kBrown,
                           .coefficients = recorded.distorted()
                                               ? std::vector<double>(recorded.distortion.begin(),
                                                                     recorded.distortion.end())
                                               : std::vector<double>()}) {}

Rectifier::Rectifier(const Camera& recorded, const LensDistortion& lens) : camera_(recorded) {
  camera_.distortion.setZero();
  camera_.disparity_bias = {};
  camera_.ignore.clear();
  if (!lens.coefficients.empty()) {
    const auto [x, y] = rectification_maps(camera_, lens);
    cv::convertMaps(x, y, whole_map_, fraction_map_, CV_16SC2, /*nninterpolation=*/false);
    cv::Mat unused;
    cv::convertMaps(x, y, nearest_map_, unused, CV_16SC2, /*nninterpolation=*/true);
  }
  if (const cv::Mat pixels = ignored_pixels(recorded); !pixels.empty())
    ignore(recorded.ignore, nearest(pixels));
}

Rectifier::Rectifier(const StereoRig& rig) : camera_(rig.camera) {
  camera_.ignore.clear();
  if (const cv::Mat pixels = ignored_pixels(rig.camera); !pixels.empty())
    ignore(rig.camera.ignore, rectified(rig, 0, pixels) > 0);
}

void Rectifier::ignore(const std::string& file, const cv::Mat& pixels) {
  ignored_ = pixels;
  const double share = cv::countNonZero(pixels) / static_cast<double>(pixels.total());
  constexpr double kMost = 0.5;  // A robot seldom hides more of the view of its own camera.
  const std::string text = fmt::format("ignored: {:.1f} % of the image, by {}", 100 * share, file);
  if (share > kMost)
    findings_ = {make_finding("source", text, "invert it: the robot itself must be white in it")};
  else
    ignored_note_ = text;
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
