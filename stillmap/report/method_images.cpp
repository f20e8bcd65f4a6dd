// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/method_images.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/report/cloud_image.hpp"
#include "stillmap/report/image_marks.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kStrip = 24;  // height of the line of text below an image [pixels]

/// Returns the image with a line of text below.
cv::Mat captioned(const cv::Mat& image, const std::string& caption) {
  cv::Mat result;
  cv::copyMakeBorder(image, result, 0, kStrip, 0, 0, cv::BORDER_CONSTANT, cv::Scalar(32, 28, 26));
  write_line(result, caption, {6, image.rows + kStrip - 8});
  return result;
}

/// Returns two images of equal size side by side with a line of text below each.
cv::Mat pair_of(const cv::Mat& left, const std::string& left_caption, const cv::Mat& right,
                const std::string& right_caption) {
  constexpr int kGap = 6;  // pixels
  cv::Mat result;
  const cv::Mat gap(left.rows + kStrip, kGap, CV_8UC3, cv::Scalar(255, 255, 255));
  cv::hconcat(
      std::vector<cv::Mat>{captioned(left, left_caption), gap, captioned(right, right_caption)},
      result);
  return result;
}

void fill_mask(cv::Mat& image, const Instance& instance, const cv::Scalar& color) {
  constexpr double kOpacity = 0.45;
  cv::Mat part = image(instance.box), mixed;
  cv::addWeighted(part, 1 - kOpacity, cv::Mat(part.size(), part.type(), color), kOpacity, 0, mixed);
  mixed.copyTo(part, instance.mask);
  std::vector<std::vector<cv::Point>> contours;
  cv::findContours(instance.mask.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE,
                   instance.box.tl());
  cv::drawContours(image, contours, -1, color, 1, cv::LINE_AA);
}

/// Writes the name of an instance on a plate in its color, at the upper left corner of its box.
void write_name(cv::Mat& image, const Instance& instance, const cv::Scalar& color) {
  constexpr double kScale = 0.42;
  const std::string name = fmt::format("{} {:.2f}", instance.class_name, instance.confidence);
  int below = 0;
  const cv::Size size = cv::getTextSize(name, cv::FONT_HERSHEY_SIMPLEX, kScale, 1, &below);
  const int top = std::max(0, instance.box.y - size.height - 6);
  const int left = std::max(0, std::min(instance.box.x, image.cols - size.width - 8));
  const cv::Rect plate(left, top, size.width + 8, size.height + 6);
  cv::rectangle(image, plate, color, cv::FILLED);
  cv::putText(image, name, {plate.x + 4, plate.br().y - 3}, cv::FONT_HERSHEY_SIMPLEX, kScale,
              cv::Scalar(0, 0, 0), 1, cv::LINE_AA);
}

bool is_moving(const Frame& frame, std::size_t keypoint) {
  return frame.evidence.weight[keypoint] <= 0;
}

std::ptrdiff_t moving_keypoints(const Frame& frame) {
  const auto& weights = frame.evidence.weight;
  return std::count_if(weights.begin(), weights.end(), [](float weight) { return weight <= 0; });
}

/// Returns the factor by which arrows are enlarged: the median one becomes about 12 pixels long.
int enlargement_of(const KeypointFlow& flow) {
  constexpr double kWanted = 12, kMost = 8;  // pixels, -
  std::vector<double> lengths;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] != 0) lengths.push_back(cv::norm(flow.flow(i)));
  }
  if (lengths.empty()) return 1;
  const double usual = std::max(1e-3, quantile(lengths, 0.5));
  return static_cast<int>(std::lround(std::clamp(kWanted / usual, 1.0, kMost)));
}

void draw_points(cv::Mat& image, const Frame& frame, bool with_moving) {
  for (std::size_t i = 0; i < frame.features->size(); ++i) {
    const Keypoint& k = frame.features->keypoints[i];
    const bool moving = is_moving(frame, i);
    if (moving && !with_moving) continue;
    cv::circle(image, cv::Point2f(k.u, k.v), 2, moving ? kMovingColor : kAgreeingColor, cv::FILLED,
               cv::LINE_AA);
  }
}

/// Returns depth as color, near bright, up to `farthest` [m]; black without depth.
cv::Mat colored_depth(const cv::Mat& depth, double farthest) {
  cv::Mat levels, colors;
  depth.convertTo(levels, CV_8UC1, -230 / farthest, 255);
  cv::applyColorMap(levels, colors, cv::COLORMAP_INFERNO);
  colors.setTo(cv::Scalar(0, 0, 0), depth <= 0);
  return colors;
}

/// Returns the depth below which nearly all depths are [m]; 1 without depth.
double farthest_of(const cv::Mat1f& depth) {
  std::vector<double> known;
  for (int row = 0; row < depth.rows; row += 4) {
    for (int column = 0; column < depth.cols; column += 4) {
      if (depth(row, column) > 0) known.push_back(depth(row, column));
    }
  }
  return known.empty() ? 1 : std::max(0.1, quantile(known, 0.98));
}

}  // namespace

cv::Scalar class_color(const std::string& class_name) {
  std::uint32_t hash = 2166136261;  // FNV-1a (Fowler, Noll and Vo)
  for (const char c : class_name) hash = (hash ^ static_cast<unsigned char>(c)) * 16777619;
  const cv::Mat3b hue(1, 1, cv::Vec3b(static_cast<std::uint8_t>(hash % 180), 190, 255));
  cv::Mat3b color;
  cv::cvtColor(hue, color, cv::COLOR_HSV2BGR);
  return cv::Scalar(color(0, 0));
}

cv::Mat draw_objects(const Frame& frame) {
  cv::Mat image = frame.image->color.clone();
  if (!frame.instances) return captioned(image, "no network and no masks");
  const SegmentedFrame& segmented = *frame.instances;
  for (const Instance& instance : segmented.instances) {
    const cv::Scalar color = class_color(instance.class_name);
    if (!instance.mask.empty()) fill_mask(image, instance, color);
    cv::rectangle(image, instance.box, color, 2, cv::LINE_AA);
  }
  for (const Instance& instance : segmented.instances)
    write_name(image, instance, class_color(instance.class_name));
  const std::string when =
      segmented.age() == 0 ? "in this frame" : counted(segmented.age(), "frame") + " before";
  return captioned(image, fmt::format("frame {}: {}, detected {}", frame.index(),
                                      counted(segmented.instances.size(), "object"), when));
}

cv::Mat draw_flow(const Frame& frame, const KeypointFlow& flow) {
  cv::Mat image = grayed(frame.image->color);
  const auto factor = static_cast<float>(enlargement_of(flow));
  std::size_t found = 0;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] == 0) continue;
    ++found;
    const cv::Scalar& color = is_moving(frame, i) ? kMovingColor : kAgreeingColor;
    const cv::Point2f tail = flow.now[i] - factor * flow.flow(i);
    cv::line(image, tail, flow.now[i], color, 1, cv::LINE_AA);
    cv::circle(image, flow.now[i], 2, color, cv::FILLED, cv::LINE_AA);
  }
  const std::string scale = factor > 1 ? fmt::format(", {} times enlarged", factor) : "";
  return captioned(image, fmt::format("frame {}: flow of {} keypoints{}; red: moving",
                                      frame.index(), found, scale));
}

cv::Mat draw_kept_keypoints(const Frame& frame) {
  cv::Mat all = grayed(frame.image->color), kept = all.clone();
  draw_points(all, frame, true);
  draw_points(kept, frame, false);
  const auto count = static_cast<std::ptrdiff_t>(frame.features->size());
  const std::ptrdiff_t moving = moving_keypoints(frame);
  return pair_of(
      all, fmt::format("frame {}: {} keypoints, red: {} moving", frame.index(), count, moving),
      kept, fmt::format("{} keypoints kept", count - moving));
}

cv::Mat draw_blanked_depth(const RgbdFrame& frame, const cv::Mat1b& movers) {
  const double farthest = farthest_of(frame.depth);
  cv::Mat blanked = frame.depth.clone();
  if (!movers.empty()) blanked.setTo(0, movers);
  cv::Mat right = colored_depth(blanked, farthest);
  if (!movers.empty()) {
    std::vector<std::vector<cv::Point>> contours;
    cv::findContours(movers.clone(), contours, cv::RETR_EXTERNAL, cv::CHAIN_APPROX_NONE);
    cv::drawContours(right, contours, -1, cv::Scalar(255, 255, 255), 1, cv::LINE_AA);
  }
  return pair_of(colored_depth(frame.depth, farthest),
                 fmt::format("frame {}: depth up to {:.1f} m", frame.index, farthest), right,
                 movers.empty() ? "no movers" : "without movers (outlined)");
}

cv::Mat draw_sparse_map(std::span<const Eigen::Vector3f> landmarks,
                        std::span<const Eigen::Vector3f> removed, const std::string& removed_kind,
                        const Trajectory& cameras) {
  constexpr std::array<std::uint8_t, 3> kLandmark{150, 205, 240};
  const CloudImageOptions options{.width = 1000, .height = 750, .splat = 0.02};
  std::vector<Eigen::Vector3f> points(landmarks.begin(), landmarks.end());
  const std::vector<std::array<std::uint8_t, 3>> colors(landmarks.size() + removed.size(),
                                                        kLandmark);
  const CloudSpan after{points, std::span(colors).first(landmarks.size()), {}};
  const CloudView view = choose_cloud_view(after, cameras, options);
  const cv::Mat right = draw_cloud(after, cameras, view, options);
  points.insert(points.end(), removed.begin(), removed.end());
  std::vector<std::uint8_t> marked(points.size(), 0);
  std::fill(marked.begin() + static_cast<std::ptrdiff_t>(landmarks.size()), marked.end(), 1);
  const cv::Mat left = draw_cloud({points, colors, marked}, cameras, view, options);
  return pair_of(
      left,
      fmt::format("{} landmarks, and {} {} (red)", landmarks.size(), removed.size(), removed_kind),
      right, "the map: landmarks alone");
}

}  // namespace stillmap
