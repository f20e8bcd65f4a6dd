// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/frame_maker.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/rectified_frame.hpp"
#include "stillmap/sensor/require_image.hpp"

#include <cmath>
#include <cstdint>
#include <limits>
#include <memory>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr const char* kWhere = "make_frame";
constexpr const char* kColorImage = "color image";
constexpr const char* kDepthImage = "depth image";

/// Median depth above which the unit of an image must be wrong [m]. No sensor of
/// depth_sensor_names() measures beyond 20 m; the median of an image in millimeters is several
/// hundred.
constexpr double kMostPlausibleMedian = 100;
/// Interval of the rows and columns whose pixels enter the median [pixels].
constexpr int kMedianStride = 8;

/// Returns the median of the known readings, in the unit of the image; 0 if there are none.
template <typename T>
double median_reading(const cv::Mat& depth) {
  std::vector<double> known;
  for (int y = 0; y < depth.rows; y += kMedianStride) {
    for (int x = 0; x < depth.cols; x += kMedianStride) {
      const T reading = depth.at<T>(y, x);
      if (reading > 0 && reading < std::numeric_limits<T>::max())
        known.push_back(static_cast<double>(reading));
    }
  }
  return known.empty() ? 0 : upper_median(known);
}

/// Throws Error if the median depth of an image shows that its unit is wrong.
void require_plausible(double median_meters, const std::string& fix) {
  if (median_meters <= kMostPlausibleMedian) return;
  throw Error(fmt::format("the median of the {} is {:.0f} m: depth in meters is expected",
                          kDepthImage, median_meters),
              kWhere, fix);
}

/// Returns a copy as 8-bit BGR.
cv::Mat bgr_of(const cv::Mat& color) {
  cv::Mat bgr;
  switch (color.type()) {
    case CV_8UC3:
      return color.clone();
    case CV_8UC1:
      cv::cvtColor(color, bgr, cv::COLOR_GRAY2BGR);
      return bgr;
    case CV_8UC4:
      cv::cvtColor(color, bgr, cv::COLOR_BGRA2BGR);
      return bgr;
    default:
      refuse_type(color, kColorImage, kWhere,
                  "give an 8-bit image: BGR (CV_8UC3) or gray (CV_8UC1)");
  }
}

}  // namespace

FrameMaker::FrameMaker(const Camera& recorded)
    : rectifier_(recorded), disparity_bias_(recorded.disparity_bias) {
  check_camera(recorded, "camera '" + recorded.name + "'");
}

RgbdFramePtr FrameMaker::make(const cv::Mat& color, const cv::Mat& depth, double timestamp,
                              std::size_t index) const {
  require_size(color, camera(), kColorImage, kWhere);
  require_size(depth, camera(), kDepthImage, kWhere);
  if (!std::isfinite(timestamp)) throw Error("the timestamp is not finite", kWhere, "give seconds");
  const cv::Mat bgr = bgr_of(color);
  cv::Mat meters = meters_of(rectifier_.nearest(depth));
  correct_disparity(disparity_bias_, camera(), meters);
  auto frame = rectified_frame(rectifier_, bgr, meters, timestamp, 0);
  frame->index = index;
  return frame;
}

RgbdFramePtr FrameMaker::make_of_pair(const cv::Mat& left, const cv::Mat& right, double timestamp,
                                      std::size_t index) {
  if (camera().depth_sensor.name != "stereo") {
    throw Error(fmt::format("the depth sensor of camera '{}' is {}, not a stereo pair",
                            camera().name, camera().depth_sensor.name),
                kWhere, "give the camera the sensor \"stereo\" and the baseline of the pair");
  }
  if (rectifier_.active()) {
    throw Error(
        fmt::format("camera '{}' is distorted, but the pair must be rectified", camera().name),
        kWhere, "push rectified images, with the camera of these");
  }
  require_size(left, camera(), "left image", kWhere);
  require_size(right, camera(), "right image", kWhere);
  const auto gray_of = [](const cv::Mat& image) {
    cv::Mat gray;
    cv::cvtColor(bgr_of(image), gray, cv::COLOR_BGR2GRAY);
    return gray;
  };
  const cv::Mat gray_left = gray_of(left), gray_right = gray_of(right);
  if (!matcher_) matcher_.emplace(camera());
  matcher_->check_order(gray_left, gray_right);
  return make(left, matcher_->depth(gray_left, gray_right), timestamp, index);
}

/// Returns a copy, since the caller may change its image later.
cv::Mat FrameMaker::meters_of(const cv::Mat& depth) const {
  const DepthSensor& sensor = camera().depth_sensor;
  if (depth.type() == CV_16UC1) {
    require_plausible(median_reading<std::uint16_t>(depth) / camera().depth_factor,
                      fmt::format("camera.depth_factor is {}: set it to the raw units per meter, "
                                  "1000 for millimeters",
                                  camera().depth_factor));
    return depth_in_meters(depth, camera().depth_factor, sensor);
  }
  if (depth.type() != CV_32FC1) {
    refuse_type(depth, kDepthImage, kWhere,
                "give 16-bit (CV_16UC1) or 32-bit float in meters (CV_32FC1)");
  }
  require_plausible(median_reading<float>(depth),
                    "divide millimeters by 1000, or give the camera's 16-bit image");
  return depth_in_meters(depth, 1, sensor);
}

}  // namespace stillmap
