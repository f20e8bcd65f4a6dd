// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/tum_folder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr float kSaturated = 65535;  // Raw value for "too far", which is not a distance.

void check_options(const TumFolderOptions& options) {
  const auto expect = [](bool holds, const char* key, const char* fix) {
    if (!holds) throw Error("is out of range", key, fix);
  };
  expect(options.first >= 0, "first", "give the number of frames to leave out: 0 or more");
  expect(options.count >= 0, "count", "give the number of frames to use, 0 for all");
  expect(options.stride >= 1, "stride", "give 1 for every frame, 2 for every second ...");
}

std::string describe(const fs::path& file, const std::string& problem) {
  return fmt::format("{}/{} {}", file.parent_path().filename().string(), file.filename().string(),
                     problem);
}

// Returns why this pair is unusable, judged by the headers; empty if no problem is found.
std::string header_problem(const FrameFiles& files, cv::Size size) {
  if (files.depth.empty()) return describe(files.color, "has no depth image");
  for (const bool is_depth : {false, true}) {
    const fs::path& file = is_depth ? files.depth : files.color;
    auto [header, problem] = read_image_header(file);
    if (problem.empty()) problem = is_depth ? depth_problem(header) : color_problem(header);
    if (problem.empty()) problem = size_problem(header, size);
    if (!problem.empty()) return describe(file, problem);
  }
  return "";
}

}  // namespace

TumFolder::TumFolder(const SequencePaths& paths, const Camera& camera,
                     const TumFolderOptions& options)
    : options_(options),
      rectifier_(camera),
      disparity_bias_(camera.disparity_bias),
      list_(list_frames(paths)) {
  check_options(options);
  check_camera(camera, "camera '" + camera.name + "'");
  choose_range();
  require_one_usable_frame();
}

void TumFolder::choose_range() {
  auto& frames = list_.frames;
  const auto total = frames.size();
  const auto first = static_cast<std::size_t>(options_.first);
  if (first >= total) {
    throw Error(
        fmt::format("the sequence has {} frames, and the first one wanted is {}", total, first),
        frames.front().color.parent_path().string(), "start earlier");
  }
  const auto wanted = options_.count > 0 ? static_cast<std::size_t>(options_.count) : total;
  const auto end = first + std::min(wanted, total - first);
  std::vector<FrameFiles> chosen;
  for (auto i = first; i < end; i += static_cast<std::size_t>(options_.stride)) {
    chosen.push_back(std::move(frames[i]));
  }
  frames = std::move(chosen);
  if (end - first == total) return;
  // Skipped lines outside the selected range are not reported.
  std::erase_if(list_.skipped, [&](const SkippedFrame& skipped) {
    return skipped.timestamp < frames.front().timestamp ||
           skipped.timestamp > frames.back().timestamp;
  });
}

void TumFolder::require_one_usable_frame() const {
  const cv::Size size(camera().width, camera().height);
  std::string first_problem;
  for (const FrameFiles& files : list_.frames) {
    const std::string problem = header_problem(files, size);
    if (problem.empty()) return;
    if (first_problem.empty()) first_problem = problem;
  }
  throw Error(
      fmt::format("none of the {} frames can be used; the first: {}", list_.frames.size(),
                  first_problem),
      list_.frames.front().color.parent_path().parent_path().string(),
      "give the camera that recorded the sequence (--camera), with its image size; color must be "
      "8-bit PNG or JPEG, depth 16-bit PNG of the same size");
}

RgbdFramePtr TumFolder::next() {
  while (position_ < list_.frames.size()) {
    if (RgbdFramePtr frame = load(list_.frames[position_++])) return frame;
  }
  return nullptr;
}

RgbdFramePtr TumFolder::load(const FrameFiles& files) {
  trace_frame(next_index_);
  const TraceScope scope("read frame");
  const cv::Size size(camera().width, camera().height);
  const ImageRead color = read_color_image(files.color, size);
  if (!color.problem.empty()) {
    list_.skipped.push_back({files.timestamp, describe(files.color, color.problem)});
    return nullptr;
  }
  auto frame = std::make_shared<RgbdFrame>();
  frame->index = next_index_++;
  frame->timestamp = files.timestamp;
  frame->color = rectifier_.image(color.image);
  traced("gray", [&] { cv::cvtColor(frame->color, frame->gray, cv::COLOR_BGR2GRAY); });
  frame->depth = load_depth(files);
  if (!frame->depth.empty()) {
    frame->depth_delay = files.depth_timestamp - files.timestamp;
  } else {
    frame->depth = cv::Mat::zeros(size, CV_32FC1);
  }
  return frame;
}

/// Returns the depth image of a frame, 32FC1 [m]; an empty one if it has none that can be used.
cv::Mat TumFolder::load_depth(const FrameFiles& files) {
  if (files.depth.empty()) return {};
  const ImageRead raw = read_depth_image(files.depth, {camera().width, camera().height});
  if (!raw.problem.empty()) {
    list_.skipped.push_back({.timestamp = files.timestamp,
                             .reason = describe(files.depth, raw.problem),
                             .frame_lost = false});
    return {};
  }
  cv::Mat depth =
      depth_in_meters(rectifier_.nearest(raw.image), camera().depth_factor, camera().depth_sensor);
  correct_disparity(disparity_bias_, camera(), depth);
  return depth;
}

cv::Mat depth_in_meters(const cv::Mat& raw, double depth_factor, const DepthSensor& sensor) {
  const TraceScope scope("depth in meters");
  cv::Mat meters(raw.size(), CV_32FC1);
  const auto factor = static_cast<float>(depth_factor);
  const auto nearest = static_cast<float>(sensor.min_depth);
  const auto farthest = static_cast<float>(sensor.max_depth);
  for (int y = 0; y < raw.rows; ++y) {
    const auto* from = raw.ptr<std::uint16_t>(y);
    auto* to = meters.ptr<float>(y);
    for (int x = 0; x < raw.cols; ++x) {
      const auto value = static_cast<float>(from[x]);
      const float z = value / factor;
      to[x] = ((value != kSaturated) & (z >= nearest) & (z <= farthest)) ? z : 0.0F;
    }
  }
  return meters;
}

void correct_disparity(const DisparityBias& bias, const Camera& camera, cv::Mat& depth) {
  if (bias == DisparityBias{}) return;
  const TraceScope scope("disparity correction");
  const DepthSensor& sensor = camera.depth_sensor;
  for (int y = 0; y < depth.rows; ++y) {
    auto* row = depth.ptr<float>(y);
    for (int x = 0; x < depth.cols; ++x) {
      if (row[x] <= 0) continue;
      const double z = 1 / (1 / row[x] - bias.offset - bias.bow * camera.squared_radius(x, y));
      row[x] = z >= sensor.min_depth && z <= sensor.max_depth ? static_cast<float>(z) : 0.0F;
    }
  }
}

}  // namespace stillmap
