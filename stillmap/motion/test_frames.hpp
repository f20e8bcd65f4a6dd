// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/keypoint_flow.hpp"
#include "stillmap/motion/motion_cue.hpp"

#include <string>
#include <utility>
#include <vector>

#include <opencv2/imgproc.hpp>

namespace stillmap::test {

/// Returns a camera of 320 x 240 pixels with the field of view of a Kinect.
inline Camera small_camera() {
  return {.name = "test",
          .width = 320,
          .height = 240,
          .fx = 262.5,
          .fy = 262.5,
          .cx = 159.5,
          .cy = 119.5};
}

/// Returns blurred noise suited to optical flow, the same for the same seed.
inline cv::Mat1b texture(cv::Size size, std::uint64_t seed) {
  cv::Mat1b noise(size);
  cv::RNG rng(seed);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {9, 9}, 2);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  return noise;
}

/// Returns `size` pixels of a texture moved by (dx, dy) pixels.
inline cv::Mat1b moved_texture(cv::Size size, std::uint64_t seed, double dx, double dy) {
  constexpr int kMargin = 40;
  const cv::Mat1b world = texture({size.width + 2 * kMargin, size.height + 2 * kMargin}, seed);
  const cv::Mat shift = (cv::Mat_<double>(2, 3) << 1, 0, dx - kMargin, 0, 1, dy - kMargin);
  cv::Mat1b view;
  cv::warpAffine(world, view, shift, size, cv::INTER_CUBIC);
  return view;
}

inline FeaturesPtr keypoints_at(const std::vector<cv::Point2f>& points) {
  auto features = std::make_shared<Features>();
  for (const cv::Point2f& p : points) features->keypoints.push_back({.u = p.x, .v = p.y});
  return features;
}

/// Returns points every `step` pixels, at least `margin` pixels inside the area.
inline std::vector<cv::Point2f> lattice(const cv::Rect& area, int step, int margin = 0) {
  std::vector<cv::Point2f> points;
  for (int y = area.y + margin; y < area.br().y - margin; y += step) {
    for (int x = area.x + margin; x < area.br().x - margin; x += step) {
      points.emplace_back(static_cast<float>(x), static_cast<float>(y));
    }
  }
  return points;
}

inline RgbdFramePtr image_of(std::size_t index, const cv::Mat1b& gray) {
  auto image = std::make_shared<RgbdFrame>();
  image->index = index;
  image->gray = gray;
  return image;
}

inline Instance box_of(const std::string& name, const cv::Rect& box) {
  Instance instance;
  instance.class_name = name;
  instance.box = box;
  return instance;
}

inline SegmentedFramePtr segmented(std::vector<Instance> instances) {
  auto frame = std::make_shared<SegmentedFrame>();
  frame->instances = std::move(instances);
  return frame;
}

inline FramePtr frame_of(RgbdFramePtr image, FeaturesPtr features) {
  auto frame = std::make_shared<Frame>();
  frame->image = std::move(image);
  frame->features = std::move(features);
  return frame;
}

/// Returns the input of a cue that uses images, keypoints and instances.
inline MotionInput input_of(RgbdFramePtr image, FeaturesPtr features,
                            SegmentedFramePtr instances = nullptr, FramePtr previous = nullptr) {
  return {.image = std::move(image),
          .features = std::move(features),
          .cells = nullptr,
          .instances = std::move(instances),
          .instance_cells = nullptr,
          .previous = std::move(previous),
          .ego_motion = {}};
}

/// Returns the optical flow of given point pairs.
inline KeypointFlow flow_between(const std::vector<cv::Point2f>& before,
                                 const std::vector<cv::Point2f>& now) {
  return {before, now, std::vector<std::uint8_t>(now.size(), 1)};
}

/// Returns evidence with log-odds of 0.
inline MotionEvidence no_evidence(std::size_t keypoints) {
  MotionEvidence evidence;
  evidence.static_log_odds.assign(keypoints, 0.0F);
  return evidence;
}

}  // namespace stillmap::test
