// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/frame_check.hpp"

#include "stillmap/base/statistics.hpp"

#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr double kFlat = 0.001;         // range of the depths of a constant image [m]
constexpr std::size_t kLevels = 65535;  // of 16-bit depth; 65535 means "too far"

bool has_depth(const cv::Mat1f& depth) {
  constexpr int kStep = 16;  // pixels
  for (int row = 0; row < depth.rows; row += kStep) {
    for (int col = 0; col < depth.cols; col += kStep) {
      if (depth(row, col) > 0) return true;
    }
  }
  return cv::countNonZero(depth) > 0;
}

}  // namespace

std::string unit_of_timestamps(double interval) {
  if (interval > 1e6) return "nanoseconds";
  if (interval > 1e3) return "microseconds";
  if (interval > 5) return "milliseconds";
  return "";
}

std::string depth_factor_problem(double of_steps, double factor) {
  constexpr double kSame = 0.1;  // relative; a calibrated factor differs by a few percent
  if (std::abs(factor / of_steps - 1) <= kSame) return "";
  return fmt::format(
      "the steps between the raw depths are those of a Kinect v1 or Xtion with a depth factor of "
      "{:g}, and the camera's is {:g}: all distances would be {:.3g} times the true ones (unless "
      "the "
      "sensor is another one: name it then, as 'sensor: realsense_d435i' in the camera file)",
      of_steps, factor, of_steps / factor);
}

FrameCheck::FrameCheck(const Camera& camera) : camera_(camera), seen_(kLevels) {}

void FrameCheck::add(const RgbdFrame& frame) {
  constexpr std::size_t kExamined = 40, kDense = 20, kInterval = 30, kFirstInterval = 3;  // frames
  if (frames_ > 0) intervals_.push_back(frame.timestamp - last_);
  last_ = frame.timestamp;
  const cv::Mat1f depth = frame.depth;
  if (has_depth(depth)) {
    if (frames_ >= next_examined_ && examined_ < kExamined) {
      examine(frame);
      next_examined_ = frames_ + (examined_ < kDense ? kFirstInterval : kInterval);
    }
    ++with_depth_;
    gap_ = {};
  } else {
    gap_.add(frame.timestamp, longest_);
  }
  compare_with_last(frame);
  ++frames_;
}

void FrameCheck::Gap::add(double time, Gap& longest) {
  if (frames++ == 0) begin = time;
  if (frames > longest.frames) longest = *this;
}

/// Finds depth images that repeat while the color changes, as of a sensor that hangs.
void FrameCheck::compare_with_last(const RgbdFrame& frame) {
  const auto coarse = [](const cv::Mat& image, auto& into) {
    constexpr double kShare = 1.0 / 16;
    if (!image.empty()) cv::resize(image, into, {}, kShare, kShare, cv::INTER_NEAREST);
  };
  const auto equal = [](const cv::Mat& a, const cv::Mat& b) {
    return !a.empty() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0;
  };
  cv::Mat1f depth;
  cv::Mat1b gray;
  coarse(frame.depth, depth);
  coarse(frame.gray, gray);
  const bool repeats = equal(depth, last_depth_) && cv::countNonZero(depth) > 0;
  const bool has_colors = !gray.empty() && !last_gray_.empty();
  if (repeats && has_colors && !equal(gray, last_gray_))
    frozen_.add(frame.timestamp, longest_frozen_);
  else
    frozen_ = {};
  last_depth_ = depth;
  last_gray_ = gray;
}

/// Adds the steps between the depths of a frame, and the places of its edges.
void FrameCheck::examine(const RgbdFrame& frame) {
  ++examined_;
  constexpr double kMillimeters = 1000;
  cv::Mat1w millimeters;
  frame.depth.convertTo(millimeters, CV_16U, kMillimeters);
  if (frame.gray.size() == frame.depth.size()) registration_.add(frame.gray, millimeters);
  const cv::Mat1f depth = frame.depth;
  double nearest = 0, farthest = 0;
  cv::minMaxLoc(depth, &nearest, &farthest, nullptr, nullptr, depth > 0);
  if (farthest - nearest <= kFlat) ++flat_;
  for (const float z : depth) {
    const double raw = z > 0 ? std::round(z * camera_.depth_factor) : 0;
    if (raw > 0 && raw < static_cast<double>(kLevels)) seen_[static_cast<std::size_t>(raw)] = true;
  }
}

std::string FrameCheck::time_problem() const {
  if (intervals_.empty()) return "";
  std::vector<double> intervals = intervals_;
  const double median = upper_median(intervals);
  const std::string unit = unit_of_timestamps(median);
  if (unit.empty()) return "";
  return fmt::format(
      "frames are {:g} s apart: the timestamps seem to be in {}, so that all speeds are wrong; "
      "write them in seconds",
      median, unit);
}

bool FrameCheck::is_long(const Gap& gap) const {
  constexpr std::size_t kFewest = 15;  // frames in a row: half a second of a usual camera
  return gap.frames >= kFewest && 10 * gap.frames >= frames_;
}

std::string FrameCheck::frozen_problem() const {
  if (2 * flat_ > examined_) {
    return "the depth images have the same depth everywhere; check that depth was recorded";
  }
  if (!is_long(longest_frozen_)) return "";
  return fmt::format(
      "{} frames in a row have the depth image of the one before, from {:.6f} s on, while their "
      "color changes; check the recording of the depth",
      longest_frozen_.frames, longest_frozen_.begin);
}

std::string FrameCheck::gap_problem() const {
  if (!is_long(longest_)) return "";
  return fmt::format(
      "{} frames in a row have no depth, from {:.6f} s on: their poses come from landmarks alone, "
      "and the map does not grow; check the depth images",
      longest_.frames, longest_.begin);
}

std::vector<std::string> FrameCheck::problems() const {
  std::vector<std::string> problems;
  if (frames_ > 0 && with_depth_ == 0) {
    problems.push_back(fmt::format(
        "no frame has a depth between {:g} and {:g} m, the range of sensor {}; check the depth "
        "factor ({:g} units per meter), and that depth in floats is in meters",
        camera_.depth_sensor.min_depth, camera_.depth_sensor.max_depth, camera_.depth_sensor.name,
        camera_.depth_factor));
  } else if (const std::string gap = gap_problem(); !gap.empty()) {
    problems.push_back(gap);
  }
  if (std::string frozen = frozen_problem(); !frozen.empty()) problems.push_back(std::move(frozen));
  if (const std::string time = time_problem(); !time.empty()) problems.push_back(time);
  if (std::string problem = registration_.problem(); !problem.empty())
    problems.push_back(std::move(problem));
  std::vector<std::uint16_t> levels;
  for (std::size_t raw = 1; raw < kLevels; ++raw) {
    if (seen_[raw]) levels.push_back(static_cast<std::uint16_t>(raw));
  }
  if (const auto of_steps = depth_factor_of_steps(levels, camera_.depth_sensor)) {
    const std::string text = depth_factor_problem(*of_steps, camera_.depth_factor);
    if (!text.empty())
      problems.push_back(fmt::format("{}; set the depth factor to {:g}", text, *of_steps));
  }
  return problems;
}

}  // namespace stillmap
