// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/frame_check.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr double kFlat = 0.001;         // range of the depths of a constant image [m]
constexpr std::size_t kLevels = 65535;  // of 16-bit depth; 65535 means "too far"

template <typename T>
cv::Mat_<T> every_16th(const cv::Mat& image) {
  constexpr double kScale = 1.0 / 16;
  cv::Mat_<T> coarse;
  if (!image.empty()) cv::resize(image, coarse, {}, kScale, kScale, cv::INTER_NEAREST);
  return coarse;
}

bool equal(const cv::Mat& a, const cv::Mat& b) {
  return !a.empty() && a.size() == b.size() && cv::norm(a, b, cv::NORM_INF) == 0;
}

/// Returns the share of the pixels with depth in both images whose depth differs by more than a
/// tenth [0..1].
double depth_change(const cv::Mat1f& a, const cv::Mat1f& b) {
  constexpr float kTenth = 0.1F;
  int both = 0, changed = 0;
  for (int y = 0; y < a.rows; ++y) {
    for (int x = 0; x < a.cols; ++x) {
      const float z = a(y, x), other = b(y, x);
      if (!(z > 0 && other > 0)) continue;
      ++both;
      if (std::abs(z - other) > kTenth * std::min(z, other)) ++changed;
    }
  }
  return both > 0 ? static_cast<double>(changed) / both : 0;
}

/// Returns the mean difference of two gray images of the same mean brightness.
double gray_change(const cv::Mat1b& a, const cv::Mat1b& b) {
  const cv::Scalar offset = cv::mean(a) - cv::mean(b);
  cv::Mat1f difference;
  cv::subtract(a, b, difference, cv::noArray(), CV_32F);
  return cv::norm(difference - offset, cv::NORM_L1) / static_cast<double>(a.total());
}

/// Returns whether the depth is from a depth camera. Depth from a stereo pair is computed from the
/// images, so its edges always match the left images in position and time.
bool has_depth_camera(const Camera& camera) {
  return camera.depth_sensor.principle != DepthPrinciple::kStereo;
}

}  // namespace

std::string unit_of_timestamps(double interval) {
  if (interval > 1e6) return "nanoseconds";
  if (interval > 1e3) return "microseconds";
  if (interval > 5) return "milliseconds";
  return "";
}

std::optional<Finding> depth_factor_finding(double of_steps, double factor) {
  constexpr double kSame = 0.1;  // relative; a calibrated factor differs by a few percent
  if (std::abs(factor / of_steps - 1) <= kSame) return std::nullopt;
  return make_finding(
      "depth-factor",
      fmt::format("the steps between the raw depths are those of a Kinect v1 or Xtion with a depth "
                  "factor of {:g}, and {:g} is used: all distances would be {:.3g} times the true "
                  "ones",
                  of_steps, factor, of_steps / factor),
      fmt::format("set the depth factor to {:g} (or name another sensor, as 'sensor: "
                  "realsense_d435i' in the camera file)",
                  of_steps),
      {{"given", factor}, {"of_steps", of_steps}});
}

bool is_long_gap(std::size_t frames, std::size_t all) {
  constexpr std::size_t kFewest = 15;
  return frames >= kFewest && 10 * frames >= all;
}

bool are_many_unusable(std::size_t unusable, std::size_t all) { return 5 * unusable > all; }

bool are_many_unusable(const std::vector<SkippedFrame>& skipped, double begin, std::size_t all) {
  const auto count = [&](auto&& holds) {
    return static_cast<std::size_t>(std::count_if(skipped.begin(), skipped.end(), holds));
  };
  const auto is_lost = [](const SkippedFrame& s) { return s.frame_lost && !s.late; };
  const std::size_t lost = count(is_lost),
                    before = count([&](const SkippedFrame&s) {
                      return is_lost(s) && s.timestamp != 0 && s.timestamp < begin;
                    });
  return are_many_unusable(is_long_gap(before, all) ? lost : lost - before, all);
}

FrameCheck::FrameCheck(const Camera& camera)
    : camera_(camera), seen_(kLevels), registration_(camera.depth_sensor) {}

void FrameCheck::add(const RgbdFrame& frame) {
  constexpr std::size_t kExamined = 40, kDense = 20, kInterval = 30, kFirstInterval = 3;  // frames
  if (frames_ > 0) intervals_.push_back(frame.timestamp - last_);
  last_ = frame.timestamp;
  const Coarse coarse{every_16th<float>(frame.depth), every_16th<std::uint8_t>(frame.gray)};
  if (cv::countNonZero(coarse.depth) > 0 || cv::countNonZero(frame.depth) > 0) {
    if (frames_ >= next_examined_ && examined_ < kExamined) {
      examine(frame);
      next_examined_ = frames_ + (examined_ < kDense ? kFirstInterval : kInterval);
    }
    ++with_depth_;
    gap_ = {};
  } else {
    gap_.add(frame.timestamp, longest_);
  }
  compare_with_last(frame.timestamp, coarse);
  compare_with_last_two(coarse);
  last_but_one_ = last_coarse_;
  last_coarse_ = coarse;
  ++frames_;
}

std::map<std::string, double> FrameCheck::evidence_of(const Gap& gap) {
  return {{"frames", static_cast<double>(gap.frames)}, {"begin_s", gap.begin}};
}

void FrameCheck::Gap::add(double time, Gap& longest) {
  if (frames++ == 0) begin = time;
  if (frames > longest.frames) longest = *this;
}

/// Finds color images that repeat, and depth images that repeat while the color changes, as of a
/// sensor that hangs.
void FrameCheck::compare_with_last(double time, const Coarse& coarse) {
  const bool color_repeats = equal(coarse.gray, last_coarse_.gray);
  const bool has_color = !coarse.gray.empty() && !last_coarse_.gray.empty();
  if (color_repeats) {
    ++repeats_;
    if (!repeats_last_) ++repeated_;
    stopped_.add(time, longest_stopped_);
  } else {
    stopped_ = {};
  }
  repeats_last_ = color_repeats;
  const bool depth_repeats =
      equal(coarse.depth, last_coarse_.depth) && cv::countNonZero(coarse.depth) > 0;
  if (depth_repeats && has_color && !color_repeats)
    frozen_.add(time, longest_frozen_);
  else
    frozen_ = {};
}

/// Counts the frames whose depth and gray image resemble those of the last frame but one and not
/// those of the last, as if two cameras took them in turn. A camera that moves does the opposite.
void FrameCheck::compare_with_last_two(const Coarse& coarse) {
  constexpr double kDepthChange = 0.2, kGrayChange = 10;  // between two views; share, gray levels
  const auto same_size = [](const cv::Mat& a, const cv::Mat& b, const cv::Mat& c) {
    return !a.empty() && a.size() == b.size() && a.size() == c.size();
  };
  if (!same_size(coarse.depth, last_coarse_.depth, last_but_one_.depth) ||
      !same_size(coarse.gray, last_coarse_.gray, last_but_one_.gray))
    return;
  const double depth = depth_change(coarse.depth, last_coarse_.depth),
               gray = gray_change(coarse.gray, last_coarse_.gray);
  if (depth > kDepthChange && gray > kGrayChange &&
      2 * depth_change(coarse.depth, last_but_one_.depth) < depth &&
      gray_change(coarse.gray, last_but_one_.gray) < gray)
    ++alternating_;
}

/// Adds the steps between the depths of a frame, and the places of its edges.
void FrameCheck::examine(const RgbdFrame& frame) {
  ++examined_;
  if (has_depth_camera(camera_) && frame.gray.size() == frame.depth.size())
    registration_.add(frame.timestamp, frame.gray, frame.depth);
  const cv::Mat1f depth = frame.depth;
  double nearest = 0, farthest = 0;
  cv::minMaxLoc(depth, &nearest, &farthest, nullptr, nullptr, depth > 0);
  if (farthest - nearest <= kFlat) ++flat_;
  if (frame.depth_interpolated) return;
  byte_order_.add(depth * camera_.depth_factor);
  for (const float z : depth) {
    const double raw = z > 0 ? std::round(z * camera_.depth_factor) : 0;
    if (raw > 0 && raw < static_cast<double>(kLevels)) seen_[static_cast<std::size_t>(raw)] = true;
  }
}

std::optional<Finding> FrameCheck::time_finding() const {
  if (intervals_.empty()) return std::nullopt;
  std::vector<double> intervals = intervals_;
  const double median = upper_median(intervals);
  const std::string unit = unit_of_timestamps(median);
  if (unit.empty()) return std::nullopt;
  return make_finding("timestamp-unit",
                      fmt::format("frames are {:g} s apart: the timestamps seem to be in {}, so "
                                  "that all speeds are wrong",
                                  median, unit),
                      "write them in seconds", {{"interval_s", median}});
}

std::optional<Finding> FrameCheck::frozen_finding() const {
  if (2 * flat_ > examined_) {
    return make_finding("depth-constant", "the depth images have the same depth everywhere",
                        "check that depth was recorded");
  }
  if (!is_long_gap(longest_frozen_.frames, frames_)) return std::nullopt;
  return make_finding(
      "depth-frozen",
      fmt::format("{} frames in a row have the depth image of the one before, from {:.6f} s on, "
                  "while their color changes",
                  longest_frozen_.frames, longest_frozen_.begin),
      "check the recording of the depth", evidence_of(longest_frozen_));
}

std::optional<Finding> FrameCheck::repeats_finding() const {
  constexpr std::size_t kFewestOthers = 10;  // images; a camera at rest without noise has one
  if (is_long_gap(longest_stopped_.frames, frames_) && frames_ - repeats_ >= kFewestOthers) {
    return make_finding(
        "frozen-images",
        fmt::format("{} frames in a row have the color image of the one before, from {:.6f} s on, "
                    "as if the camera hung",
                    longest_stopped_.frames, longest_stopped_.begin),
        "leave them out, or record again", evidence_of(longest_stopped_));
  }
  constexpr std::size_t kFewest = 10;  // images; a camera at rest without noise repeats one
  if (repeated_ < kFewest || 3 * repeats_ < frames_) return std::nullopt;
  return make_finding(
      "repeated-images",
      fmt::format("{} of {} frames have the color image of the one before, as if the camera "
                  "stopped and jumped",
                  repeats_, frames_),
      "list each image once, with the time at which it was taken",
      {{"repeated", static_cast<double>(repeats_)}});
}

std::optional<Finding> FrameCheck::alternation_finding() const {
  constexpr std::size_t kFewest = 10;
  if (alternating_ < kFewest || 2 * alternating_ < frames_) return std::nullopt;
  return make_finding(
      "alternating-cameras",
      fmt::format("{} of {} frames resemble the frame before the last and not the last, as if two "
                  "cameras took them in turn",
                  alternating_, frames_),
      "record the cameras separately", {{"frames", static_cast<double>(alternating_)}});
}

std::optional<Finding> FrameCheck::depth_finding() const {
  const DepthSensor& sensor = camera_.depth_sensor;
  if (frames_ > 0 && with_depth_ == 0) {
    const bool stereo = !has_depth_camera(camera_);
    return make_finding(
        "no-depth",
        fmt::format("no frame has a depth between {:g} and {:g} m{}", sensor.min_depth,
                    sensor.max_depth,
                    stereo ? " from its pair of images" : ", the range of sensor " + sensor.name),
        stereo ? "check that left and right show the same moment, and the calibration of the "
                 "cameras"
               : fmt::format("check the depth factor ({:g} units per meter), and that depth in "
                             "floats is in meters",
                             camera_.depth_factor));
  }
  if (!is_long_gap(longest_.frames, frames_)) return std::nullopt;
  return make_finding(
      "depth-gap",
      fmt::format("{} frames in a row have no depth, from {:.6f} s on: the map does not grow "
                  "there",
                  longest_.frames, longest_.begin),
      "check the depth images", evidence_of(longest_));
}

std::optional<Finding> FrameCheck::steps_finding() const {
  const auto of_steps = depth_factor_of_steps(seen_, camera_.depth_sensor);
  return of_steps ? depth_factor_finding(*of_steps, camera_.depth_factor) : std::nullopt;
}

std::optional<Finding> FrameCheck::coarse_finding() const {
  constexpr double kCoarse = 0.015;  // [m]
  const double step = equal_step(seen_).value_or(0) / camera_.depth_factor;
  if (step < kCoarse) return std::nullopt;
  return make_finding("depth-coarse",
                      fmt::format("all depths are multiples of about {:.0f} mm, as if the depth "
                                  "images had been saved with 8 bits or held disparities",
                                  1000 * step),
                      "save depths with 16 bits, in steps of 1 mm or less", {{"step_m", step}});
}

std::vector<Finding> FrameCheck::findings() const {
  const auto frozen = frozen_finding();
  std::vector<Finding> findings;
  for (const auto& found : {depth_finding(), frozen, repeats_finding(), alternation_finding(),
                            time_finding(), frozen ? std::nullopt : registration_.finding(),
                            byte_order_.finding(), steps_finding(), coarse_finding()}) {
    if (found) findings.push_back(*found);
  }
  return findings;
}

}  // namespace stillmap
