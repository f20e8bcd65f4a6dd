// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/rgbd_streams.hpp"

#include "stillmap/base/counted.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/image_header.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/geometry/depth_sensor.hpp"
#include "stillmap/recording/frame_tree.hpp"
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/name_text.hpp"
#include "stillmap/recording/realsense.hpp"
#include "stillmap/recording/stream_choice.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <set>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

// Number of messages of a topic that are tried before it counts as unreadable.
constexpr std::size_t kTried = 5;

bool is_depth_encoding(const std::string& encoding) {
  return encoding == "16UC1" || encoding == "mono16" || encoding == "32FC1";
}

// ---- image topics
// --------------------------------------------------------------------------------

// "rgb8; jpeg compressed bgr8" begins with the format of the pixels; "jpeg" names only the file.
std::string pixel_format(const std::string& format) {
  const auto end = format.find(';');
  if (end != std::string::npos) return format.substr(0, end);
  return is_depth_encoding(format) ? format : "bgr8";
}

int side_of(std::uint32_t pixels) { return static_cast<int>(std::min(pixels, 1U << 20)); }

void describe(const ImageMessage& image, ImageStream& stream) {
  stream.encoding = image.encoding;
  stream.frame = image.header.frame;
  stream.width = side_of(image.width);
  stream.height = side_of(image.height);
}

// Publishers name formats freely, so the content decides if possible: a PNG file with one 16-bit
// channel is depth.
void describe(const CompressedImageMessage& image, ImageStream& stream) {
  stream.encoding = pixel_format(image.format);
  stream.frame = image.header.frame;
  const bool is_file = is_png(image.data) || is_jpeg(image.data);
  const bool compressed_depth = !is_file && (contains_any(image.format, {"compressedDepth"}) ||
                                             stream.name.ends_with("/compressedDepth"));
  stream.storage = compressed_depth ? ImageStorage::kCompressedDepth : ImageStorage::kFile;
  if (compressed_depth && !is_depth_encoding(stream.encoding)) stream.encoding = "16UC1";
  const std::size_t parameters = compressed_depth ? kCompressedDepthParameters : 0;
  const auto header = encoded_header(image.data.subspan(std::min(parameters, image.data.size())));
  if (!header) return;
  stream.width = side_of(static_cast<std::uint32_t>(header->width));
  stream.height = side_of(static_cast<std::uint32_t>(header->height));
  if (is_file && header->channels == 1 && header->bits == 16 && !stream.is_depth())
    stream.encoding = "16UC1";
}

std::optional<ImageStream> stream_of(Recording& recording, std::uint32_t topic_index,
                                     std::vector<MessageEntry> images) {
  const Topic& topic = recording.topics()[topic_index];
  ImageStream stream;
  stream.topic = topic_index;
  stream.name = topic.name;
  stream.images = std::move(images);
  for (std::size_t i = 0; i < std::min(kTried, stream.images.size()); ++i) {
    const auto described = if_readable([&] {
      const ByteSpan bytes = recording.read(stream.images[i]);
      if (topic.type == "sensor_msgs/Image") {
        describe(decode_image(bytes, topic.encoding), stream);
      } else {
        describe(decode_compressed_image(bytes, topic.encoding), stream);
      }
      return true;
    });
    if (described) return stream;
  }
  return std::nullopt;
}

// ---- topics that the user names
// ----------------------------------------------------------------

std::vector<std::string> names_of(const std::vector<ImageStream>& streams) {
  std::vector<std::string> names;
  for (const ImageStream& stream : streams) names.push_back(stream.name);
  return names;
}

const ImageStream& named_stream(const Recording& recording, const std::vector<ImageStream>& streams,
                                const std::string& name) {
  for (const ImageStream& stream : streams) {
    if (stream.name == name || stream.name == "/" + name) return stream;
  }
  throw Error(fmt::format("contains no image topic '{}'", name), recording.path().string(),
              suggestion(name, names_of(streams)));
}

// Sets the two streams that the user named.
void take_named(const Recording& recording, const std::vector<ImageStream>& all,
                const std::string& topics, RgbdStreams& streams) {
  const auto comma = topics.find(',');
  if (comma == std::string::npos) {
    throw Error(fmt::format("'{}' names one topic", topics), "--topics",
                "name two: --topics COLOR,DEPTH, or --topics LEFT,RIGHT of a stereo pair");
  }
  const ImageStream& color = named_stream(recording, all, topics.substr(0, comma));
  const ImageStream& depth = named_stream(recording, all, topics.substr(comma + 1));
  if (color.name == depth.name)
    throw Error(fmt::format("'{}' names one topic twice", topics), "--topics",
                "name two: --topics COLOR,DEPTH, or --topics LEFT,RIGHT of a stereo pair");
  if (color.is_depth())
    throw Error(fmt::format("{} has depth images ({}), but the topic of the color images comes "
                            "first",
                            color.name, color.encoding),
                "--topics", fmt::format("--topics {},{}", depth.name, color.name));
  streams.color = color;
  streams.depth = depth;
}

// ---- cameras
// -------------------------------------------------------------------------------------

std::string parent_of(const std::string& topic) {
  const auto slash = topic.rfind('/');
  return slash == std::string::npos ? "" : topic.substr(0, slash);
}

// The topic of the image without the suffix of its compression.
std::string base_of(const ImageStream& stream) {
  return stream.storage == ImageStorage::kPixels ? stream.name : parent_of(stream.name);
}

// A rectified image is called image_rect, image_rect_color or image_rect_raw. RealSense calls the
// depth image image_rect_raw, which has no distortion either.
bool is_rectified(const std::string& base) {
  return contains_any(base.substr(base.rfind('/') + 1), {"rect"});
}

std::optional<CameraInfoMessage> first_camera_info(Recording& recording, std::uint32_t topic) {
  const auto entries = recording.messages_of(topic);
  for (std::size_t i = 0; i < std::min(kTried, entries.size()); ++i) {
    const auto info = if_readable([&] {
      return decode_camera_info(recording.read(entries[i]), recording.topics()[topic].encoding);
    });
    if (info) return info;
  }
  return std::nullopt;
}

// Returns the camera_info topic in the namespace of the image; otherwise one of the same frame and
// size or aspect ratio.
std::optional<std::uint32_t> camera_topic(Recording& recording, const ImageStream& stream) {
  const std::string base = base_of(stream), parent = parent_of(base);
  for (const std::string& name :
       {parent + "/camera_info", base + "/camera_info", parent_of(parent) + "/info/camera_info"}) {
    const auto topic = recording.find_topic(name);
    if (topic && recording.topics()[*topic].type == "sensor_msgs/CameraInfo") return topic;
  }
  std::optional<std::uint32_t> of_same_ratio;
  for (std::uint32_t i = 0; i < recording.topics().size(); ++i) {
    if (recording.topics()[i].type != "sensor_msgs/CameraInfo") continue;
    const auto info = first_camera_info(recording, i);
    if (!info || stream.frame.empty() || info->header.frame != stream.frame) continue;
    const std::int64_t width = info->width, height = info->height;
    if (stream.width == 0 || (width == stream.width && height == stream.height)) return i;
    if (width * stream.height == height * stream.width && !of_same_ratio) of_same_ratio = i;
  }
  return of_same_ratio;
}

void add_camera(Recording& recording, ImageStream& stream) {
  const auto topic = camera_topic(recording, stream);
  if (!topic) return;
  auto info = first_camera_info(recording, *topic);
  if (!info) return;
  const std::string& name = recording.topics()[*topic].name;
  if (realsense_inverts_distortion(recording, stream.name))
    info->distortion_model = "Inverse Brown Conrady";
  const bool without_size = info->width == 0 || info->height == 0;
  if (without_size) {
    info->width = static_cast<std::uint32_t>(stream.width);
    info->height = static_cast<std::uint32_t>(stream.height);
  }
  const bool rectified = is_rectified(base_of(stream));
  std::optional<RecordedCamera> full;
  try {
    full = camera_of(*info, rectified);
  } catch (const Error& error) {
    throw Error(error.problem(), recording.path().string() + ", topic " + name, error.fix());
  }
  stream.camera_topic = name;
  if (!full) return;
  const SizedCamera sized_camera = sized(*full, *info, stream.width, stream.height);
  stream.camera = sized_camera.camera;
  std::vector<std::string> changes;
  if (!rectified && info->intrinsics[0] == 0)
    changes.emplace_back("K is 0, so P is used, as for rectified images");
  if (without_size) changes.emplace_back("its size is 0, so that of the images is used");
  if (!sized_camera.how.empty()) changes.push_back(sized_camera.how);
  if (!changes.empty())
    stream.camera_note = fmt::format("camera of {}: {}", name, fmt::join(changes, "; "));
  if (stream.width == 0) {
    stream.width = stream.camera->width;
    stream.height = stream.camera->height;
  }
}

// ---- times
// ---------------------------------------------------------------------------------------

void use_log_times_if_unstamped(ImageStream& stream) {
  const bool unstamped = std::all_of(stream.images.begin(), stream.images.end(),
                                     [](const MessageEntry& entry) { return entry.stamp == 0; });
  if (!unstamped) return;
  for (MessageEntry& entry : stream.images) entry.stamp = entry.log_time;
}

/// Returns whether images are stored in an order that no camera and no loop gives: stamps that jump
/// back in more than a fifth of the images, and no stamp twice.
bool is_shuffled(const std::vector<MessageEntry>& images) {
  std::size_t jumps = 0;
  std::set<std::int64_t> stamps;
  for (std::size_t i = 0; i < images.size(); ++i) {
    stamps.insert(images[i].stamp);
    if (i > 0 && images[i].stamp < images[i - 1].stamp) ++jumps;
  }
  return 5 * jumps > images.size() && stamps.size() == images.size();
}

/// Sorts images by their stamps if they are stored in another order.
void sort_if_shuffled(ImageStream& stream, std::vector<Finding>& findings) {
  if (!is_shuffled(stream.images)) return;
  std::ranges::sort(stream.images, {}, &MessageEntry::stamp);
  findings.push_back(make_finding(
      "source",
      fmt::format("{} is stored in another order than by its stamps; it is sorted by them",
                  stream.name)));
}

// Returns the rate by the median interval, as one of the usual rates if it is within 5 % of one.
double rate_of(const ImageStream& stream) {
  std::vector<double> intervals;
  for (std::size_t i = 1; i < stream.images.size(); ++i)
    intervals.push_back(seconds_of(stream.images[i].stamp - stream.images[i - 1].stamp));
  if (intervals.empty()) return 30;
  const double rate = 1 / std::clamp(upper_median(intervals), 1e-3, 1e3);
  for (const double usual : {5.0, 6.0, 10.0, 15.0, 20.0, 25.0, 30.0, 60.0, 90.0}) {
    if (std::abs(rate / usual - 1) < 0.05) return usual;
  }
  return rate;
}

// ---- registration
// --------------------------------------------------------------------------------

std::string how_registered(const ImageStream& color, const ImageStream& depth) {
  if (contains_any(lower(depth.name), {"aligned", "registered", "to_color", "to_rgb"}))
    return "its name says that it is registered to the color images";
  const bool same_size = depth.width == 0 || color.width == 0 ||
                         (depth.width == color.width && depth.height == color.height);
  if (!color.frame.empty() && depth.frame == color.frame && same_size)
    return "registered to the color images: it has their frame and size";
  return "";
}

// Sets the pose of the depth camera, or finds that the images are registered.
void add_registration(Recording& recording, FrameTree& frames, RgbdStreams& streams) {
  const ImageStream &color = streams.color, &depth = streams.depth;
  const std::string place =
      fmt::format("depth: {}, {}, ", depth.name, counted(depth.images.size(), "image"));
  streams.T_color_depth = realsense_extrinsics(recording, color.name, depth.name);
  if (!streams.T_color_depth) {
    const std::string registered = how_registered(color, depth);
    if (!registered.empty()) {
      streams.notes.push_back(place + registered);
      return;
    }
    streams.T_color_depth = color.frame == depth.frame && !color.frame.empty()
                                ? Pose()
                                : frames.find(color.frame, depth.frame);
  }
  if (streams.T_color_depth && depth.camera) {
    streams.notes.push_back(fmt::format(
        "{}{} x {}, will be registered to the color images ({:.1f} mm and {:.2f} degrees away)",
        place, depth.width, depth.height, 1000 * streams.T_color_depth->translation().norm(),
        streams.T_color_depth->angle() * 180 / M_PI));
    return;
  }
  const bool same_size = depth.width == color.width && depth.height == color.height;
  if (!same_size) {
    throw Error(fmt::format("the depth images ({}, frame '{}') are not registered to the color "
                            "images (frame '{}'), and {} is not recorded",
                            depth.name, depth.frame, color.frame,
                            depth.camera ? "the transform between them" : "their camera"),
                recording.path().string(),
                "record /tf_static and the camera_info of both cameras, or registered depth");
  }
  streams.T_color_depth.reset();
  streams.notes.push_back(place +
                          "assumed to be registered to the color images: no transform is recorded");
}

// ---- stereo
// ---------------------------------------------------------------------------------------

std::optional<Pose> recorded_pose_in_pair(Recording& recording, const ImageStream& stream) {
  const auto topic = recording.find_topic(stream.camera_topic);
  const auto info = topic ? first_camera_info(recording, *topic) : std::nullopt;
  return info ? pose_in_pair(*info, is_rectified(base_of(stream))) : std::nullopt;
}

// Returns the pose of the right camera by P and R of both cameras; none if they are not calibrated
// as a pair.
std::optional<Pose> pose_by_projections(Recording& recording, const ImageStream& left,
                                        const ImageStream& right) {
  const auto T_pair_left = recorded_pose_in_pair(recording, left);
  const auto T_pair_right = recorded_pose_in_pair(recording, right);
  if (!T_pair_left || !T_pair_right) return std::nullopt;
  if (T_pair_left->translation() == T_pair_right->translation()) return std::nullopt;
  return T_pair_left->inverse() * *T_pair_right;
}

void add_pair(Recording& recording, FrameTree& frames, RgbdStreams& streams) {
  const ImageStream &left = streams.color, &right = streams.depth;
  for (const ImageStream* stream : {&left, &right}) {
    if (stream->camera) continue;
    if (!stream->camera_topic.empty()) throw not_calibrated(recording, *stream);
    throw Error(fmt::format("contains no camera for the images of {}", stream->name),
                recording.path().string(), "record the camera_info of both cameras");
  }
  streams.T_left_right = realsense_extrinsics(recording, left.name, right.name);
  if (!streams.T_left_right) {
    streams.T_left_right = pose_by_projections(recording, left, right);
    streams.pose_by_projections = streams.T_left_right.has_value();
  }
  if (!streams.T_left_right && left.frame != right.frame)
    streams.T_left_right = frames.find(left.frame, right.frame);
  if (!streams.T_left_right) {
    throw Error(
        fmt::format("contains neither the baseline of {} and {} nor the transform between them",
                    left.name, right.name),
        recording.path().string(),
        "calibrate both cameras as a pair, so that P of the right camera_info contains the "
        "baseline, or record /tf_static");
  }
  streams.notes.push_back(
      fmt::format("right images: {}, {}", right.name, counted(right.images.size(), "image")));
}

// Guesses the sensor by what drivers call their topics.
std::string sensor_of(Recording& recording, const RgbdStreams& streams) {
  std::string realsense = realsense_sensor(recording);
  if (!realsense.empty()) return realsense;
  const std::string names = lower(streams.color.name + streams.depth.name + streams.depth.frame);
  if (contains_any(names, {"aligned_depth_to_color", "realsense", "d405", "d435", "d455", "d457",
                           "/device_0/"}))
    return realsense_sensor_named(names);
  if (contains_any(names, {"k4a", "azure", "depth_to_rgb"})) return "azure_kinect";
  return "";
}

}  // namespace

Error not_calibrated(const Recording& recording, const ImageStream& stream) {
  return Error(fmt::format("the camera of {} is not calibrated: K of {} is 0", stream.name,
                           stream.camera_topic),
               recording.path().string(),
               "give the camera of the color images with --camera NAME or FILE, or calibrate it "
               "before recording");
}

bool ImageStream::is_depth() const { return is_depth_encoding(encoding); }

std::vector<ImageStream> image_streams(Recording& recording) {
  std::vector<std::vector<MessageEntry>> by_topic(recording.topics().size());
  for (const MessageEntry& entry : recording.messages()) {
    const std::string& type = recording.topics()[entry.topic].type;
    if (type == "sensor_msgs/Image" || type == "sensor_msgs/CompressedImage")
      by_topic[entry.topic].push_back(entry);
  }
  std::vector<ImageStream> streams;
  for (std::uint32_t topic = 0; topic < by_topic.size(); ++topic) {
    if (by_topic[topic].empty()) continue;
    if (auto stream = stream_of(recording, topic, std::move(by_topic[topic])))
      streams.push_back(std::move(*stream));
  }
  return streams;
}

RgbdStreams find_rgbd_streams(Recording& recording, const std::string& topics) {
  RgbdStreams streams;
  FrameTree frames(recording);
  const std::vector<ImageStream> all = image_streams(recording);
  if (topics.empty()) {
    std::tie(streams.color, streams.depth, streams.notes) = best_streams(recording, all, frames);
  } else {
    take_named(recording, all, topics, streams);
  }
  for (ImageStream* stream : {&streams.color, &streams.depth}) {
    add_camera(recording, *stream);
    use_log_times_if_unstamped(*stream);
    use_realsense_timestamps(recording, stream->name, stream->images);
    sort_if_shuffled(*stream, streams.findings);
  }
  streams.fps = rate_of(streams.color);
  if (const auto unit = realsense_depth_unit(recording, streams.depth.name)) {
    streams.depth_factor = 1 / *unit;
    streams.unit_is_recorded = true;
  }
  streams.sensor = sensor_of(recording, streams);
  streams.notes.push_back(fmt::format("color: {}, {}, {} x {} {}, {:.3g} Hz", streams.color.name,
                                      counted(streams.color.images.size(), "image"),
                                      streams.color.width, streams.color.height,
                                      streams.color.encoding, streams.fps));
  if (streams.depth.is_depth()) {
    add_registration(recording, frames, streams);
  } else {
    add_pair(recording, frames, streams);
  }
  return streams;
}

}  // namespace stillmap
