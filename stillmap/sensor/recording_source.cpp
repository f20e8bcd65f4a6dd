// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/recording_source.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/association.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/first_depth.hpp"
#include "stillmap/sensor/increasing.hpp"
#include "stillmap/sensor/lens.hpp"
#include "stillmap/sensor/recorded_image.hpp"
#include "stillmap/sensor/rectified_frame.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr const char* kCameraFix =
    "give the camera of the color images with --camera NAME or FILE, or record its camera_info";
constexpr const char* kImageFix =
    "record 8-bit color images and depth in 16 bits or floats; if the sizes differ, give the "
    "camera "
    "of the color images with --camera";
constexpr const char* kFloatDepth = "32FC1";

std::vector<double> stamps_of(const auto& images) {
  std::vector<double> stamps;
  for (const auto& image : images) stamps.push_back(image.timestamp);
  return stamps;
}

StereoRig rig_of(const Recording& recording, const RgbdStreams& streams) {
  StereoRig rig = calibrated_rig({*streams.color.camera, Pose()},
                                 {*streams.depth.camera, *streams.T_left_right}, streams.fps,
                                 recording.path().string());
  rig.camera.name = recording.path().stem().string();
  return rig;
}

}  // namespace

Camera color_camera(const Recording& recording, const RgbdStreams& streams) {
  if (streams.T_left_right) return rig_of(recording, streams).camera;
  if (!streams.color.camera) {
    if (!streams.color.camera_topic.empty()) throw not_calibrated(recording, streams.color);
    throw Error(fmt::format("contains no camera for the color images of {}", streams.color.name),
                recording.path().string(), kCameraFix);
  }
  const RecordedCamera& color = *streams.color.camera;
  Camera camera = pinhole_of(color);
  camera.name = recording.path().stem().string();
  const auto& coefficients = color.lens.coefficients;
  if (color.lens.model == LensDistortion::Model::kBrown && coefficients.size() <= 5)
    std::copy(coefficients.begin(), coefficients.end(), camera.distortion.begin());
  camera.depth_factor = streams.depth_factor;
  camera.fps = streams.fps;
  if (!streams.sensor.empty()) camera.depth_sensor = find_depth_sensor(streams.sensor);
  if (camera.depth_sensor.baseline > 0) camera.baseline = camera.depth_sensor.baseline;
  check_camera(camera, recording.path().string() + ", topic " + streams.color.camera_topic);
  return camera;
}

RecordingSource::RecordingSource(const std::filesystem::path& path,
                                 const std::optional<Camera>& camera, const std::string& topics,
                                 const FrameRange& range)
    : recording_(path), streams_(find_rgbd_streams(recording_, topics)) {
  check_range(range);
  given_ = camera.has_value();
  choose_cameras(camera);
  pair_images();
  keep_range(range, path.string(), frames_, skipped_);
  require_one_usable_frame();
}

void RecordingSource::choose_cameras(const std::optional<Camera>& camera) {
  if (streams_.T_left_right) return choose_pair(camera);
  if (camera) {
    check_camera(*camera, "camera '" + camera->name + "'");
    recorded_ = *camera;
    rectifier_.emplace(recorded_);
  } else {
    recorded_ = color_camera(recording_, streams_);
    rectifier_.emplace(recorded_, streams_.color.camera->lens);
  }
  const auto& T_color_depth = streams_.T_color_depth;
  if (T_color_depth) registration_.emplace(*streams_.depth.camera, *T_color_depth, this->camera());
}

void RecordingSource::choose_pair(const std::optional<Camera>& camera) {
  if (camera) {
    throw Error("a recorded stereo pair has the cameras of the recording",
                recording_.path().string(), "leave --camera out");
  }
  rig_ = rig_of(recording_, streams_);
  recorded_ = rig_->camera;
  rectifier_.emplace(recorded_);
  matcher_.emplace(recorded_);
}

std::vector<RecordingSource::Image> RecordingSource::increasing_images(const ImageStream& stream) {
  std::vector<Image> images;
  for (const MessageEntry& message : stream.images)
    images.push_back({seconds_of(message.stamp), message});
  keep_increasing(images, skipped_, stream.name);
  return images;
}

void RecordingSource::pair_images() {
  const auto color = increasing_images(streams_.color), depth = increasing_images(streams_.depth);
  const double tolerance = rig_ ? kMaxStereoDifference : kMaxPairDifference;
  const auto pairs = associate(stamps_of(color), stamps_of(depth), tolerance);
  if (pairs.empty()) {
    throw Error(fmt::format("no image of {0} has one of {2} within {4} s: {0} begins at {1:.3f} s, "
                            "{2} at {3:.3f} s",
                            streams_.color.name, color.front().timestamp, streams_.depth.name,
                            depth.front().timestamp, tolerance),
                recording_.path().string(), "record both with synchronized clocks");
  }
  for (const Image& image : color)
    frames_.push_back({image.timestamp, image.timestamp, image.message, std::nullopt});
  for (const auto& [i, j] : pairs) {
    frames_[i].depth_timestamp = depth[j].timestamp;
    frames_[i].depth = depth[j].message;
  }
  skip_before_first_depth(
      frames_, [](const Frame& frame) { return frame.depth.has_value(); },
      [this](const Frame&) { return streams_.color.name; }, skipped_);
  std::stable_sort(skipped_.begin(), skipped_.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
}

void RecordingSource::require_one_usable_frame() {
  std::string first_problem;
  for (const Frame& frame : frames_) {
    if (!frame.depth) continue;
    std::string problem = color_image(frame.color).problem;
    if (!problem.empty()) {
      problem = fmt::format("{} {}", streams_.color.name, problem);
    } else {
      problem = depth_image(*frame.depth).problem;
      if (problem.empty()) return;
      problem = fmt::format("{} {}", streams_.depth.name, problem);
    }
    if (first_problem.empty()) first_problem = problem;
  }
  throw Error(fmt::format("none of the {} frames can be used; the first: an image of {}",
                          frames_.size(), first_problem),
              recording_.path().string(), kImageFix);
}

std::vector<std::string> RecordingSource::notes() const {
  std::vector<std::string> notes = streams_.notes;
  const Camera& camera = this->camera();
  if (rig_) notes.push_back("stereo: " + description(*rig_));
  notes.push_back(fmt::format(
      "camera: {} x {}, fx {:.2f}, fy {:.2f}, cx {:.2f}, cy {:.2f}{}, "
      "sensor {}{}",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
      rectifier_->active() ? ", distorted (will be rectified)" : "", camera.depth_sensor.name,
      given_ || streams_.sensor.empty() ? "" : " (by the names of the topics)"));
  if (!rig_ && streams_.depth.encoding != kFloatDepth) notes.push_back(unit_note());
  const std::string unpaired =
      without_depth_note(frames_, [](const Frame& frame) { return frame.depth.has_value(); });
  if (!rig_ && !unpaired.empty()) notes.push_back(unpaired);
  for (const std::string& warning : recording_.warnings()) notes.push_back("warning: " + warning);
  return notes;
}

std::string RecordingSource::unit_note() const {
  const double factor = camera().depth_factor, recorded = streams_.depth_factor;
  constexpr double kMillimeters = 1000;  // per meter
  if (!given_ || factor == recorded)
    return fmt::format("unit of 16-bit depth: {:g} mm", kMillimeters / factor);
  return fmt::format(
      "warning: the given camera's unit of 16-bit depth is {:g} mm (depth_factor {:g}), and that "
      "of "
      "the recording {:g} mm; set depth_factor to {:g} if the distances are wrong by that ratio",
      kMillimeters / factor, factor, kMillimeters / recorded, recorded);
}

void RecordingSource::skip_before(double timestamp) {
  const std::size_t count = count_before(timestamp, frames_, position_);
  position_ += count;
  next_index_ += count;
}

RgbdFramePtr RecordingSource::next() {
  while (position_ < frames_.size()) {
    if (RgbdFramePtr frame = load(frames_[position_++])) return frame;
  }
  return nullptr;
}

RgbdFramePtr RecordingSource::load(const Frame& recorded) {
  trace_frame(next_index_);
  const TraceScope scope("read frame");
  const ImageRead color = color_image(recorded.color);
  if (!color.problem.empty()) {
    skipped_.push_back(
        {.timestamp = recorded.timestamp,
         .reason = fmt::format("{}: an image {}", streams_.color.name, color.problem)});
    return nullptr;
  }
  const cv::Mat image = rig_ ? rectified(*rig_, 0, color.image) : color.image;
  const double delay = rig_ ? 0 : recorded.depth_timestamp - recorded.timestamp;
  auto frame =
      rectified_frame(*rectifier_, image, load_depth(recorded, image), recorded.timestamp, delay);
  frame->index = next_index_++;
  return frame;
}

/// Returns the depth image of a frame, 32FC1 [m]; an empty one if it has none that can be used.
/// @param color  as recorded, or the rectified left image of a stereo pair
cv::Mat RecordingSource::load_depth(const Frame& recorded, const cv::Mat& color) {
  if (!recorded.depth) return {};
  const ImageRead depth = depth_image(*recorded.depth);
  if (depth.problem.empty())
    return rig_ ? depth_of_pair(*rig_, *matcher_, color, depth.image) : registered(depth.image);
  skipped_.push_back({.timestamp = recorded.timestamp,
                      .reason = fmt::format("{}: an image {}", streams_.depth.name, depth.problem),
                      .frame_lost = false});
  return {};
}

cv::Mat RecordingSource::registered(const cv::Mat& raw) const {
  const Camera& camera = this->camera();
  cv::Mat depth;
  if (registration_) {
    depth = (*registration_)(depth_in_meters(raw, camera.depth_factor, camera.depth_sensor));
  } else {
    depth = depth_in_meters(rectifier_->nearest(raw), camera.depth_factor, camera.depth_sensor);
  }
  correct_disparity(recorded_.disparity_bias, camera, depth);
  return depth;
}

ImageRead RecordingSource::decoded(const ImageStream& stream, const MessageEntry& message,
                                   Decoder decode, cv::Size size) {
  try {
    const ByteSpan bytes = traced("read message", [&] { return recording_.read(message); });
    return decode(stream, recording_.topics()[stream.topic].encoding, bytes, size);
  } catch (const Error& error) {
    return {{}, "cannot be read: " + error.problem()};
  }
}

ImageRead RecordingSource::color_image(const MessageEntry& message) {
  return decoded(streams_.color, message, decode_recorded_color, {camera().width, camera().height});
}

ImageRead RecordingSource::depth_image(const MessageEntry& message) {
  const cv::Size size = registration_
                            ? cv::Size(streams_.depth.camera->width, streams_.depth.camera->height)
                            : cv::Size(camera().width, camera().height);
  return decoded(streams_.depth, message, rig_ ? decode_recorded_color : decode_recorded_depth,
                 size);
}

}  // namespace stillmap
