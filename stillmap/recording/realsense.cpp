// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/realsense.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/geometry/depth_sensor.hpp"
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/messages.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <unordered_map>

namespace stillmap {
namespace {

// Returns "/device_0/sensor_1/Color_0" of a topic of images or IMU samples of librealsense; empty
// for other topics.
std::string stream_of(const std::string& topic) {
  const auto end = std::min(topic.find("/image/data"), topic.find("/imu/data"));
  return topic.starts_with("/device_") && end != std::string::npos ? topic.substr(0, end) : "";
}

// Returns the text of a message of type String, KeyValue or Float32.
std::string text_of(Recording& recording, const MessageEntry& entry) {
  const Topic& topic = recording.topics()[entry.topic];
  const auto text = if_readable([&]() -> std::string {
    const ByteSpan bytes = recording.read(entry);
    if (topic.type == "std_msgs/String") return decode_text(bytes, topic.encoding);
    if (topic.type == "diagnostic_msgs/KeyValue") return decode_key_value(bytes, topic.encoding);
    if (topic.type == "std_msgs/Float32")
      return fmt::format("{}", decode_float(bytes, topic.encoding));
    return "";
  });
  return text.value_or("");
}

std::string first_text(Recording& recording, const std::string& name) {
  const auto topic = recording.find_topic(name);
  if (!topic) return "";
  const auto entries = recording.messages_of(*topic);
  return entries.empty() ? "" : text_of(recording, entries.front());
}

// Returns a number such as 1000.5 of "...;timestamp=1000.5;..."; none if there is none.
std::optional<double> number_in(const std::string& text, const std::string& key) {
  const auto at = (";" + text).find(";" + key + "=");
  if (at == std::string::npos) return std::nullopt;
  const auto number = leading_number(std::string_view(text).substr(at + key.size() + 1));
  if (!number || !std::isfinite(number->value)) return std::nullopt;
  return number->value;
}

// Returns T_stream_reference of a ROS 1 bag: the transform maps from the reference to the stream.
std::optional<Pose> transform_to(Recording& recording, const std::string& stream, int reference) {
  const auto topic = recording.find_topic(fmt::format("{}/tf/{}", stream, reference));
  if (!topic || recording.topics()[*topic].type != "geometry_msgs/Transform") return std::nullopt;
  for (const MessageEntry& entry : recording.messages_of(*topic)) {
    const auto transform = if_readable([&] {
      return decode_transform(recording.read(entry), recording.topics()[*topic].encoding);
    });
    if (transform) return transform;
  }
  return std::nullopt;
}

}  // namespace

std::optional<Pose> realsense_extrinsics(Recording& recording, const std::string& color,
                                         const std::string& other) {
  const std::string color_stream = stream_of(color), other_stream = stream_of(other);
  if (color_stream.empty() || other_stream.empty()) return std::nullopt;
  constexpr int kReferences = 8;  // Number of groups of streams with common extrinsics.
  for (int reference = 0; reference < kReferences; ++reference) {
    const auto T_color_reference = transform_to(recording, color_stream, reference);
    const auto T_other_reference = transform_to(recording, other_stream, reference);
    if (T_color_reference && T_other_reference)
      return *T_color_reference * T_other_reference->inverse();
  }
  return std::nullopt;
}

std::optional<double> realsense_depth_unit(Recording& recording, const std::string& depth) {
  const std::string stream = stream_of(depth);
  if (stream.empty()) return std::nullopt;
  const std::string sensor = stream.substr(0, stream.rfind('/'));
  const std::string text = first_text(recording, sensor + "/option/Depth_Units/value");
  const auto unit = number_in("unit=" + text, "unit");
  constexpr double kSmallest = 1e-6, kLargest = 1;  // [m]
  if (!unit || *unit < kSmallest || *unit > kLargest) return std::nullopt;
  return std::round(*unit / kSmallest) * kSmallest;  // The number is a rounded float.
}

bool realsense_inverts_distortion(Recording& recording, const std::string& image) {
  const std::string stream = stream_of(image);
  if (stream.empty()) return false;
  return first_text(recording, stream + "/camera_info").find("model=Inverse Brown Conrady") !=
         std::string::npos;
}

void use_realsense_timestamps(Recording& recording, const std::string& topic,
                              std::vector<MessageEntry>& entries) {
  const std::string stream = stream_of(topic);
  if (stream.empty()) return;
  const char* kind = topic.find("/imu/data") != std::string::npos ? "imu" : "image";
  const auto texts = recording.find_topic(fmt::format("{}/{}/metadata", stream, kind));
  if (!texts || recording.topics()[*texts].type != "std_msgs/String") return;
  std::unordered_map<std::int64_t, std::int64_t> stamps;  // by time of recording [ns]
  for (const MessageEntry& entry : recording.messages_of(*texts)) {
    constexpr double kNanoseconds = 1e6;  // of a millisecond
    constexpr double kLargest = 9e12;     // [ms]
    const auto milliseconds = number_in(text_of(recording, entry), "timestamp");
    if (milliseconds && *milliseconds >= 0 && *milliseconds < kLargest)
      stamps[entry.log_time] = std::llround(*milliseconds * kNanoseconds);
  }
  for (const MessageEntry& entry : entries) {
    if (!stamps.contains(entry.log_time)) return;  // All keep their stamps.
  }
  for (MessageEntry& entry : entries) entry.stamp = stamps.at(entry.log_time);
}

std::string realsense_sensor(Recording& recording) {
  const auto topic = recording.find_topic("/device_0/info");
  if (!topic) return "";
  std::string texts;
  for (const MessageEntry& entry : recording.messages_of(*topic))
    texts += text_of(recording, entry) + '\n';
  return realsense_sensor_named(texts);
}

}  // namespace stillmap
