// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/run_images.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/jpeg_image.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kWidth = 640;          // maximum width of an image [pixels]
constexpr int kJpegQuality = 80;     // [percent]
constexpr double kFarthest = 0.5;    // maximum difference from the requested time [s]
constexpr double kReadBefore = 0.1;  // a recorded file is read from this long before it [s]
constexpr double kSameTime = 1e-4;   // the page rounds times [s]

/// Returns why a recording cannot have images; empty if it can.
std::string problem_of(const std::string& recording) {
  if (recording.empty()) return "No images: the run does not tell which recording it is of.";
  if (names_live_camera(recording)) return "No images: the run was one of a live camera.";
  if (!std::filesystem::exists(recording))
    return fmt::format("No images: the recording {} is not there any more.", recording);
  return "";
}

bool is_near(double image, double wanted) { return std::abs(image - wanted) <= kFarthest; }

/// Returns the image as a JPEG file.
std::string jpeg_of(cv::Mat image) {
  if (image.cols > kWidth) {
    const double scale = static_cast<double>(kWidth) / image.cols;
    cv::resize(image, image, {}, scale, scale, cv::INTER_AREA);
  }
  const std::vector<unsigned char> jpeg = encode_jpeg(image, kJpegQuality);
  return {jpeg.begin(), jpeg.end()};
}

}  // namespace

RunImages::RunImages(std::string recording)
    : recording_(std::move(recording)), problem_(problem_of(recording_)) {
  if (!problem_.empty() || !names_image_folder(recording_)) return;
  try {
    files_ = list_frames(find_sequence(recording_)).frames;
  } catch (const Error& e) {
    problem_ = fmt::format("No images: the recording cannot be read: {}.", e.problem());
  }
}

ViewedImage RunImages::at(double timestamp) {
  if (!problem_.empty()) return {.jpeg = {}, .problem = problem_};
  try {
    const cv::Mat image = files_.empty() ? in_file(timestamp) : in_folder(timestamp);
    if (image.empty()) return {.jpeg = {}, .problem = "No image of this time."};
    return {.jpeg = jpeg_of(image), .problem = {}};
  } catch (const Error& e) {
    return {.jpeg = {}, .problem = fmt::format("No image: {}.", e.problem())};
  }
}

cv::Mat RunImages::in_folder(double timestamp) const {
  const auto distance = [&](const FrameFiles& f) { return std::abs(f.timestamp - timestamp); };
  const auto nearest =
      std::min_element(files_.begin(), files_.end(),
                       [&](const auto& a, const auto& b) { return distance(a) < distance(b); });
  if (!is_near(nearest->timestamp, timestamp)) return {};
  const HeaderRead header = read_image_header(nearest->color);
  if (!header.problem.empty()) return {};
  return read_color_image(nearest->color, header.header.size).image;
}

cv::Mat RunImages::in_file(double timestamp) {
  const std::unique_lock lock(mutex_);
  const RgbdFramePtr& oldest = before_ ? before_ : after_;
  const bool goes_back = oldest && timestamp < oldest->timestamp - kSameTime;
  if (!source_ || goes_back) {
    source_ = make_source(recording_);
    before_ = after_ = nullptr;
  }
  if (!after_ || after_->timestamp < timestamp) source_->skip_before(timestamp - kReadBefore);
  while (!after_ || after_->timestamp < timestamp - kSameTime) {
    RgbdFramePtr next = source_->next();
    if (!next) break;
    before_ = std::exchange(after_, std::move(next));
  }
  RgbdFramePtr nearest = after_;
  if (before_ && timestamp - before_->timestamp < after_->timestamp - timestamp) nearest = before_;
  return nearest && is_near(nearest->timestamp, timestamp) ? nearest->color : cv::Mat();
}

}  // namespace stillmap
