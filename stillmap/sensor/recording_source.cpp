// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/recording_source.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/geometry/association.hpp"
#include "stillmap/recording/imu_stream.hpp"
#include "stillmap/recording/odometry_stream.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/first_depth.hpp"
#include "stillmap/sensor/frame_check.hpp"
#include "stillmap/sensor/increasing.hpp"
#include "stillmap/sensor/lens.hpp"
#include "stillmap/sensor/printable.hpp"
#include "stillmap/sensor/recorded_image.hpp"
#include "stillmap/sensor/rectified_frame.hpp"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr const char* kCameraFix =
    "give the camera of the color images with --camera NAME or FILE, or record its camera_info";
constexpr const char* kImageFix =
    "record 8-bit color images and depth in 16 bits or floats; if the sizes differ, give the "
    "camera of the color images with --camera";
constexpr const char* kFloatDepth = "32FC1";
constexpr double kMillimeters = 1000, kTenthsOfMillimeters = 10000;  // depth factors [1/m]

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

// Returns whether the baseline in P of the right camera has the wrong sign, as some drivers publish
// it.
bool has_negative_baseline(const RgbdStreams& streams) {
  return streams.pose_by_projections && streams.T_left_right->translation().x() < 0;
}

RgbdStreams with_turned_baseline(RgbdStreams streams) {
  const Pose& T = *streams.T_left_right;
  streams.T_left_right = Pose(T.rotation(), -T.translation());
  return streams;
}

cv::Mat gray(const cv::Mat& color) {
  cv::Mat gray;
  cv::cvtColor(color, gray, cv::COLOR_BGR2GRAY);
  return gray;
}

/// Returns the IMU of a recording with its pose; none if that is not known.
/// @param sensor  name of the depth sensor, or empty
std::optional<Imu> imu_of(const ImuStream& stream, const std::string& sensor) {
  const std::string prefix = "realsense_";
  const std::string name = sensor.starts_with(prefix) ? sensor.substr(prefix.size()) : sensor;
  const auto& known = imu_names();
  const bool is_known = std::find(known.begin(), known.end(), name) != known.end();
  if (!is_known && !stream.T_color_imu) return std::nullopt;
  Imu imu = is_known ? find_imu(name) : Imu();
  if (stream.T_color_imu) imu.T_camera_imu = *stream.T_color_imu;
  return imu;
}

// Range of images: index of the first one, and of the one after the last.
using Stretch = std::pair<std::size_t, std::size_t>;

// Returns the longest stretch in which the stamps do not jump back: by a second, or to the first
// half of the stretch, as at the end of a short loop. Images of one camera are less out of order.
Stretch longest_stretch(const std::vector<MessageEntry>& images) {
  constexpr std::int64_t kJump = 1'000'000'000;  // [ns]
  const auto jumps_back = [&](std::size_t begin, std::size_t at) {
    const std::int64_t first = images[begin].stamp, last = images[at - 1].stamp;
    return images[at].stamp < std::max(last - kJump, first + (last - first) / 2);
  };
  Stretch longest(0, 0);
  std::size_t begin = 0;
  for (std::size_t end = 1; end <= images.size(); ++end) {
    if (end < images.size() && !jumps_back(begin, end)) continue;
    if (end - begin > longest.second - longest.first) longest = {begin, end};
    begin = end;
  }
  return longest;
}

std::vector<MessageEntry> part_of(const std::vector<MessageEntry>& images, Stretch stretch) {
  const auto at = [&](std::size_t i) { return images.begin() + static_cast<std::ptrdiff_t>(i); };
  return {at(stretch.first), at(stretch.second)};
}

/// Returns whether the driver of ROS publishes this depth: it converts to millimeters
/// (realsense-ros, fix_depth_scale()).
bool is_of_realsense_ros(const std::string& topic) {
  return topic.find("/aligned_depth_to_color/image_raw") != std::string::npos ||
         topic.find("/depth/image_rect_raw") != std::string::npos;
}

}  // namespace

Camera color_camera(const Recording& recording, const RgbdStreams& streams) {
  if (streams.T_left_right && has_negative_baseline(streams))
    return rig_of(recording, with_turned_baseline(streams)).camera;
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
                                 const FrameRange& range, const std::string& ignore)
    : recording_(path), streams_(find_rgbd_streams(recording_, topics)) {
  check_range(range);
  given_ = camera.has_value();
  keep_longest_stretch();
  pair_images();
  median_raw_depth_ = median_raw_depth();
  use_unit_of_d405();
  choose_cameras(camera, ignore);
  keep_range(range, path.string(), frames_, skipped_);
  require_one_usable_frame();
  require_depth_in_view();
}

void RecordingSource::choose_cameras(const std::optional<Camera>& camera,
                                     const std::string& ignore) {
  if (streams_.T_left_right) return choose_pair(camera, ignore);
  if (camera) check_camera(*camera, "camera '" + camera->name + "'");
  recorded_ = camera ? *camera : color_camera(recording_, streams_);
  if (!ignore.empty()) recorded_.ignore = ignore;
  find_imu_samples();
  find_odometry();
  if (camera) {
    rectifier_.emplace(recorded_);
  } else {
    rectifier_.emplace(recorded_, streams_.color.camera->lens);
  }
  const auto& T_color_depth = streams_.T_color_depth;
  if (T_color_depth) registration_.emplace(*streams_.depth.camera, *T_color_depth, this->camera());
}

/// Takes the samples of the recorded IMU if its pose is known: by the camera file, by the
/// recording, or as the driver of a known camera publishes it.
void RecordingSource::find_imu_samples() {
  auto stream = find_imu_stream(recording_, streams_);
  if (!stream) return;
  const std::string topic =
      fmt::format("IMU: {}{}", stream->topic,
                  stream->accelerometer.empty() ? "" : " and " + stream->accelerometer);
  if (!recorded_.imu) recorded_.imu = imu_of(*stream, streams_.sensor);
  if (!recorded_.imu) {
    imu_note_ = fmt::format(
        "{}; it is not used, since no transform from frame {} to frame {} is recorded: give "
        "T_camera_imu in a camera file",
        topic, printable(streams_.color.frame), printable(stream->frame));
    return;
  }
  imu_note_ = topic;
  motion_samples_.imu = std::move(stream->samples);
}

/// Takes the samples of the recorded odometry if its pose is known by the camera file or by the
/// recording.
void RecordingSource::find_odometry() {
  auto stream = find_odometry_stream(recording_, streams_);
  if (!stream) return;
  if (!recorded_.wheels && stream->T_color_base)
    recorded_.wheels = Wheels{.T_camera_base = *stream->T_color_base};
  odometry_note_ = "odometry: " + printable(stream->topic);
  if (recorded_.wheels) {
    motion_samples_.odometry = std::move(stream->samples);
  } else {
    odometry_note_ += fmt::format(
        "; it is not used, since no transform from frame {} to frame {} is recorded: give "
        "T_camera_base in a camera file",
        printable(streams_.color.frame), printable(stream->frame));
  }
}

void RecordingSource::choose_pair(const std::optional<Camera>& camera, const std::string& ignore) {
  if (camera) {
    throw Error("a recorded stereo pair has the cameras of the recording",
                recording_.path().string(), "leave --camera out");
  }
  turn_baseline_if_images_tell();
  rig_ = rig_of(recording_, streams_);
  rig_->camera.ignore = ignore;
  recorded_ = rig_->camera;
  rectifier_.emplace(*rig_);
  matcher_.emplace(recorded_);
}

/// Changes the sign of a negative baseline if the first images match that way only.
void RecordingSource::turn_baseline_if_images_tell() {
  constexpr std::size_t kTried = 5;  // frames
  if (!has_negative_baseline(streams_)) return;
  RgbdStreams turned = with_turned_baseline(streams_);
  const StereoRig rig = rig_of(recording_, turned);
  StereoMatcher matcher(rig.camera);
  const cv::Size size(streams_.color.camera->width, streams_.color.camera->height);
  for (std::size_t i = 0; i < std::min(kTried, frames_.size()); ++i) {
    if (!frames_[i].depth) continue;
    const ImageRead left = decoded(streams_.color, frames_[i].color, decode_recorded_color, size);
    const ImageRead right = decoded(streams_.depth, *frames_[i].depth, decode_recorded_color, size);
    if (!left.problem.empty() || !right.problem.empty()) continue;
    const MatchShares shares = matcher.match_shares(gray(rectified(rig, 0, left.image)),
                                                    gray(rectified(rig, 1, right.image)));
    if (!shares.tell_given()) continue;
    turned.findings.push_back(make_finding(
        "source",
        fmt::format("P of {} has the baseline of a camera to the left of {}; it is used with the "
                    "other sign, since {:.0f} % of the pixels match that way, and {:.0f} % "
                    "otherwise",
                    turned.depth.camera_topic, turned.color.name, 100 * shares.given,
                    100 * shares.exchanged)));
    streams_ = std::move(turned);
    return;
  }
}

/// Keeps the images of the longest stretch if the stamps of the color images jump back, as when the
/// playback of another recording in a loop was recorded. Single images out of order are handled by
/// increasing_images().
void RecordingSource::keep_longest_stretch() {
  std::vector<MessageEntry>& color = streams_.color.images;
  std::vector<double> stamps;
  for (const MessageEntry& image : color) stamps.push_back(seconds_of(image.stamp));
  const std::vector<bool> increasing = longest_increasing(stamps);
  const auto disordered = std::count(increasing.begin(), increasing.end(), false);
  const auto [begin, end] = longest_stretch(color);
  if (end - begin == color.size() ||
      !are_many_unusable(static_cast<std::size_t>(disordered), color.size()))
    return;
  streams_.findings.push_back(make_finding(
      "source",
      fmt::format("the stamps of {} jump back, as if a recording had been played in a loop while "
                  "it was recorded; its longest stretch is used, {} of {}",
                  streams_.color.name, end - begin, counted(color.size(), "image"))));
  // Depth images of the stretch were recorded between the color images before and after it.
  using Limits = std::numeric_limits<std::int64_t>;
  const std::int64_t first = begin > 0 ? color[begin - 1].log_time : Limits::min();
  const std::int64_t last = end < color.size() ? color[end].log_time : Limits::max();
  std::vector<MessageEntry> depth;
  std::copy_if(
      streams_.depth.images.begin(), streams_.depth.images.end(), std::back_inserter(depth),
      [&](const MessageEntry& image) { return image.log_time >= first && image.log_time <= last; });
  if (!depth.empty()) streams_.depth.images = part_of(depth, longest_stretch(depth));
  color = part_of(color, {begin, end});
}

std::vector<RecordingSource::Image> RecordingSource::increasing_images(const ImageStream& stream) {
  std::vector<Image> images;
  for (const MessageEntry& message : stream.images)
    images.push_back({seconds_of(message.stamp), message});
  std::vector<SkippedFrame> skipped;
  keep_increasing(images, skipped, stream.name);
  // Without its depth image a frame still has its color image.
  for (SkippedFrame& image : skipped) image.frame_lost = &stream == &streams_.color;
  skipped_.insert(skipped_.end(), skipped.begin(), skipped.end());
  return images;
}

void RecordingSource::pair_images() {
  const auto color = increasing_images(streams_.color), depth = increasing_images(streams_.depth);
  const double tolerance = streams_.T_left_right ? kMaxStereoDifference : kMaxPairDifference;
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

/// Returns the median of the readings of some 16-bit depth images [raw units]; 0 for other images.
double RecordingSource::median_raw_depth() {
  constexpr std::size_t kImages = 8;
  constexpr std::size_t kStep = 7;  // every n-th reading is used
  std::vector<std::uint16_t> readings;
  for (std::size_t i = 0; i < kImages && streams_.depth.is_depth(); ++i) {
    const Frame& frame = frames_[i * frames_.size() / kImages];
    if (!frame.depth) continue;
    const ImageRead read = decoded(streams_.depth, *frame.depth, decode_recorded_depth,
                                   {streams_.depth.width, streams_.depth.height});
    if (!read.problem.empty() || read.image.type() != CV_16UC1) continue;
    std::size_t reading = 0;
    for (const std::uint16_t raw : cv::Mat1w(read.image))
      if (raw > 0 && raw < 65535 && reading++ % kStep == 0) readings.push_back(raw);
  }
  return readings.empty() ? 0 : upper_median(readings);
}

/// Sets the unit of 16-bit depth to 0.1 mm, the native unit of a D405, if the recording names this
/// camera, contains no unit, and the depths would be too large in millimeters. Depths above 1 m are
/// doubtful, since a D405 is made for up to half a meter (datasheet); they stay in millimeters if
/// they are from realsense-ros, which converts, and sigma is below 0.1 m. Other programs seldom
/// convert.
void RecordingSource::use_unit_of_d405() {
  constexpr double kFarthest = 1, kUselessSigma = 0.1;  // [m]
  const std::string& topic = streams_.depth.name;
  const DepthSensor& d405 = find_depth_sensor("realsense_d405");
  if (streams_.sensor != d405.name || streams_.unit_is_recorded) return;
  const double in_millimeters = median_raw_depth_ / kMillimeters;  // [m]
  const bool both_plausible = in_millimeters < d405.depth_at_sigma(kUselessSigma);
  if (in_millimeters < kFarthest || (both_plausible && is_of_realsense_ros(topic))) return;
  streams_.depth_factor = kTenthsOfMillimeters;
  const std::string text = fmt::format(
      "depth unit: 0.1 mm, as the topics name a RealSense D405; in millimeters the median depth of "
      "{} would be {:.2f} m",
      topic, in_millimeters);
  if (both_plausible) {
    streams_.findings.push_back(
        make_finding("source", text,
                     "if that is right, give a camera file with 'depth_factor: 1000' by --camera"));
  } else {
    streams_.notes.push_back(text);
  }
}

/// Returns the finding that the depths are beyond the range of the sensor; none otherwise.
std::optional<Finding> RecordingSource::far_depth() const {
  const Camera& camera = this->camera();
  const double median = median_raw_depth_ / camera.depth_factor;
  const bool known = camera.depth_factor >= kTenthsOfMillimeters;
  if (rig_ || known || median <= camera.depth_sensor.max_depth) return std::nullopt;
  return make_finding(
      "source",
      fmt::format("the median depth is {:.1f} m, farther than sensor {} measures ({:g} m)", median,
                  camera.depth_sensor.name, camera.depth_sensor.max_depth),
      fmt::format("if it should be {:.2f} m, the unit is 0.1 mm, as for a RealSense D405: give a "
                  "camera file with 'depth_factor: 10000' by --camera",
                  median_raw_depth_ / kTenthsOfMillimeters));
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
  throw Error(fmt::format("none of the {} can be used; the first: an image of {}",
                          counted(frames_.size(), "frame"), first_problem),
              recording_.path().string(), kImageFix);
}

/// Throws Error if no depth projects into the color images, as with a transform between body frames
/// instead of optical frames.
void RecordingSource::require_depth_in_view() {
  constexpr std::size_t kTried = 5;                // frames
  constexpr double kEnough = 0.05, kSeen = 0.005;  // shares of the depth and color pixels
  if (!registration_) return;
  std::size_t tried = 0;
  for (std::size_t i = 0; i < frames_.size() && tried < kTried; ++i) {
    if (!frames_[i].depth) continue;
    const ImageRead read = depth_image(*frames_[i].depth);
    if (!read.problem.empty()) continue;
    const cv::Mat meters =
        depth_in_meters(read.image, camera().depth_factor, camera().depth_sensor);
    const auto share = [](const cv::Mat& depth) {
      return cv::countNonZero(depth) / static_cast<double>(depth.total());
    };
    if (share(meters) < kEnough) continue;
    if (share((*registration_)(meters)) > kSeen) return;
    ++tried;
  }
  if (tried == 0) return;
  const Pose& T = *streams_.T_color_depth;
  throw Error(
      fmt::format("no depth of {} falls into the images of {}: by the recorded transform from "
                  "frame '{}' to '{}' the depth camera is {:.3f} m away and turned by {:.0f} "
                  "degrees",
                  streams_.depth.name, streams_.color.name, streams_.depth.frame,
                  streams_.color.frame, T.translation().norm(), T.angle() * 180 / M_PI),
      recording_.path().string(),
      "record the transform between the optical frames (z forward, x right, y down), whose "
      "rotation is missing here, or name the topics of one camera with --topics COLOR,DEPTH, or "
      "record depth that is registered to color");
}

std::vector<std::string> RecordingSource::notes() const {
  std::vector<std::string> notes = streams_.notes;
  const Camera& camera = this->camera();
  if (!given_ && !streams_.color.camera_note.empty()) notes.push_back(streams_.color.camera_note);
  if ((rig_ || registration_) && !streams_.depth.camera_note.empty())
    notes.push_back(streams_.depth.camera_note);
  if (rig_) notes.push_back("stereo: " + description(*rig_));
  notes.push_back(fmt::format(
      "camera: {} x {}, fx {:.2f}, fy {:.2f}, cx {:.2f}, cy {:.2f}{}, "
      "sensor {}{}",
      camera.width, camera.height, camera.fx, camera.fy, camera.cx, camera.cy,
      rectifier_->active() ? ", distorted (will be rectified)" : "", camera.depth_sensor.name,
      given_ || streams_.sensor.empty() ? "" : " (by the names of the topics)"));
  for (const std::string& note : {imu_note_, odometry_note_})
    if (!note.empty()) notes.push_back(note);
  if (!rectifier_->ignored_note().empty()) notes.push_back(rectifier_->ignored_note());
  if (uses_unit() && !contradicts_unit())
    notes.push_back(
        fmt::format("unit of 16-bit depth: {:g} mm", kMillimeters / camera.depth_factor));
  const std::string unpaired =
      without_depth_note(frames_, [](const Frame& frame) { return frame.depth.has_value(); });
  if (!rig_ && !unpaired.empty()) notes.push_back(unpaired);
  return notes;
}

std::vector<Finding> RecordingSource::findings() const {
  std::vector<Finding> findings = streams_.findings;
  append(rectifier_->findings(), findings);
  const double factor = camera().depth_factor, recorded = streams_.depth_factor;
  if (uses_unit() && contradicts_unit()) {
    findings.push_back(make_finding(
        "source",
        fmt::format("the given camera's unit of 16-bit depth is {:g} mm (depth_factor {:g}), and "
                    "that of the recording {:g} mm",
                    kMillimeters / factor, factor, kMillimeters / recorded),
        fmt::format("set depth_factor to {:g} if the distances are wrong by that ratio",
                    recorded)));
  }
  if (auto far = far_depth()) findings.push_back(*std::move(far));
  for (const std::string& warning : recording_.warnings())
    findings.push_back(make_finding("source", warning));
  return findings;
}

/// Returns whether depth is stored in a unit of the camera.
bool RecordingSource::uses_unit() const { return !rig_ && streams_.depth.encoding != kFloatDepth; }

/// Returns whether the given camera has another unit of depth than the recording.
bool RecordingSource::contradicts_unit() const {
  return given_ && camera().depth_factor != streams_.depth_factor;
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
  frame->depth_interpolated = registration_.has_value();
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
