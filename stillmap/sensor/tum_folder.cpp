// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/tum_folder.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/first_depth.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/image_sizes.hpp"
#include "stillmap/sensor/rectified_frame.hpp"

#include <algorithm>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

std::string short_name(const fs::path& file) {
  return (file.parent_path().filename() / file.filename()).string();
}

std::string describe(const fs::path& file, const std::string& problem) {
  return short_name(file) + ' ' + problem;
}

// Returns why this pair is unusable, judged by the headers; empty if no problem is found.
std::string header_problem(const FrameFiles& files, const ImageSizes& sizes) {
  if (files.depth.empty()) return describe(files.color, "has no depth image");
  for (const bool is_depth : {false, true}) {
    const fs::path& file = is_depth ? files.depth : files.color;
    auto [header, problem] = read_image_header(file);
    if (problem.empty()) problem = is_depth ? depth_problem(header) : color_problem(header);
    if (problem.empty()) problem = size_problem(header, is_depth ? sizes.depth : sizes.color);
    if (!problem.empty()) return describe(file, problem);
  }
  return "";
}

}  // namespace

TumFolder::TumFolder(const SequencePaths& paths, const Camera& camera, const FrameRange& range)
    : paths_(paths),
      range_(range),
      rectifier_(camera),
      disparity_bias_(camera.disparity_bias),
      list_(list_range()),
      color_size_(color_size(list_.frames, camera)) {
  check_camera(camera, "camera '" + camera.name + "'");
  require_one_usable_frame();
  if (color_size_.width != camera.width) {
    add_note(
        fmt::format("color images of {} x {} pixels are scaled to the size of the depth images, "
                    "{} x {}",
                    color_size_.width, color_size_.height, camera.width, camera.height));
  }
}

FrameList TumFolder::list_range() {
  check_range(range_);
  FrameList list = list_frames(paths_);
  const auto wanted =
      static_cast<std::size_t>(range_.first) + static_cast<std::size_t>(range_.count);
  range_is_complete_ = range_.count > 0 && list.frames.size() >= wanted;
  keep_range(range_, paths_.folder.string(), list.frames, list.skipped);
  return list;
}

void TumFolder::refresh(bool growing) {
  paths_.growing = growing;
  FrameList list = list_range();
  const double last = position_ > 0 ? list_.frames[position_ - 1].timestamp
                                    : -std::numeric_limits<double>::infinity();
  const auto next = std::find_if(list.frames.begin(), list.frames.end(),
                                 [&](const FrameFiles& files) { return files.timestamp > last; });
  position_ = static_cast<std::size_t>(next - list.frames.begin());
  list.skipped.insert(list.skipped.end(), unusable_.begin(), unusable_.end());
  list_ = std::move(list);
}

void TumFolder::require_one_usable_frame() const {
  const ImageSizes sizes{color_size_, {camera().width, camera().height}};
  std::string first_problem;
  for (const FrameFiles& files : list_.frames) {
    const std::string problem = header_problem(files, sizes);
    if (problem.empty()) return require_possible_unit(files.depth);
    if (first_problem.empty()) first_problem = problem;
  }
  throw Error(
      fmt::format("none of the {} can be used; the first: {}",
                  counted(list_.frames.size(), "frame"), first_problem),
      list_.frames.front().color.parent_path().parent_path().string(),
      first_problem.ends_with("is missing")
          ? "copy the images to where the lists name them, or correct the names in the lists"
          : "color must be 8-bit PNG or JPEG, depth 16-bit PNG or TIFF, or 32-bit floats in TIFF, "
            "EXR or NPY, both of the size of the camera that recorded them (--camera)");
}

/// Throws Error if the depth factor is for floats in meters, as in ORB-SLAM's settings for ROS, but
/// the depth images have 16-bit integers.
void TumFolder::require_possible_unit(const fs::path& depth) const {
  constexpr double kFewest = 10;  // units per meter, with which 16 bits reach 6.5 km
  const double factor = camera().depth_factor;
  if (factor >= kFewest || read_image_header(depth).header.samples == Samples::kFloat) return;
  throw Error(
      fmt::format("the depth factor is {:g}, but {} has whole numbers of 16 bits, which would be "
                  "depths in steps of {:g} m",
                  factor, short_name(depth), 1 / factor),
      "camera '" + camera().name + "'",
      "set the depth factor (DepthMapFactor) to the units per meter of these images: 1000 for "
      "millimeters, 5000 in the TUM benchmark");
}

std::vector<std::string> TumFolder::notes() const {
  std::vector<std::string> notes = notes_;
  if (!rectifier_.ignored_note().empty()) notes.push_back(rectifier_.ignored_note());
  const std::string unpaired = without_depth_note(
      list_.frames, [](const FrameFiles& files) { return !files.depth.empty(); });
  if (!unpaired.empty()) notes.push_back(unpaired);
  return notes;
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
  ImageRead color = read_color_image(files.color, color_size_);
  if (!color.problem.empty()) {
    skip({files.timestamp, describe(files.color, color.problem)});
    return nullptr;
  }
  const cv::Size size(camera().width, camera().height);
  if (color_size_ != size) cv::resize(color.image, color.image, size, 0, 0, cv::INTER_AREA);
  auto frame = rectified_frame(rectifier_, color.image, load_depth(files), files.timestamp,
                               files.depth_timestamp - files.timestamp);
  frame->index = next_index_++;
  frame->name = files.color.stem().string();
  return frame;
}

void TumFolder::skip(const SkippedFrame& frame) {
  unusable_.push_back(frame);
  list_.skipped.push_back(frame);
}

/// Returns the depth image of a frame, 32FC1 [m]; an empty one if it has none that can be used.
cv::Mat TumFolder::load_depth(const FrameFiles& files) {
  if (files.depth.empty()) return {};
  const ImageRead raw = read_depth_image(files.depth, {camera().width, camera().height});
  if (!raw.problem.empty()) {
    skip({.timestamp = files.timestamp,
          .reason = describe(files.depth, raw.problem),
          .frame_lost = false});
    return {};
  }
  cv::Mat depth =
      depth_in_meters(rectifier_.nearest(raw.image), camera().depth_factor, camera().depth_sensor);
  correct_disparity(disparity_bias_, camera(), depth);
  return depth;
}

}  // namespace stillmap
