// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/imu_stream.hpp"

#include "stillmap/recording/frame_tree.hpp"
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/messages.hpp"
#include "stillmap/recording/realsense.hpp"

#include <algorithm>
#include <tuple>

namespace stillmap {
namespace {

Eigen::Vector3d vector_of(const std::array<double, 3>& v) { return {v[0], v[1], v[2]}; }

std::optional<ImuMessage> read_message(Recording& recording, const MessageEntry& entry) {
  return if_readable(
      [&] { return decode_imu(recording.read(entry), recording.topics()[entry.topic].encoding); });
}

/// Returns the coordinate frame of the first message that can be read; none if there is none.
std::optional<std::string> frame_of(Recording& recording, std::uint32_t topic) {
  for (const MessageEntry& entry : recording.messages_of(topic))
    if (const auto message = read_message(recording, entry)) return message->header.frame;
  return std::nullopt;
}

std::vector<ImuSample> samples_of(Recording& recording, std::uint32_t topic) {
  std::vector<MessageEntry> entries = recording.messages_of(topic);
  use_realsense_timestamps(recording, recording.topics()[topic].name, entries);
  std::vector<ImuSample> samples;
  for (const MessageEntry& entry : entries) {
    const auto message = read_message(recording, entry);
    if (!message) continue;
    const ImuSample sample{seconds_of(entry.stamp), vector_of(message->angular_velocity),
                           vector_of(message->linear_acceleration)};
    const bool increases = samples.empty() || sample.timestamp > samples.back().timestamp;
    if (increases && sample.angular_velocity.allFinite() && sample.acceleration.allFinite())
      samples.push_back(sample);
  }
  return samples;
}

/// Returns whether the topic is that of an accelerometer alone, as RealSense cameras publish it.
bool is_accelerometer(const std::string& topic) {
  return topic.find("accel") != std::string::npos || topic.find("Accel") != std::string::npos;
}

std::size_t common_length(const std::string& a, const std::string& b) {
  const auto end = std::mismatch(a.begin(), a.end(), b.begin(), b.end()).first;
  // Whole names only: "/camera/" of "/camera/color/image" and "/camera/imu".
  const auto slash = a.rfind('/', static_cast<std::size_t>(end - a.begin()));
  return slash == std::string::npos ? 0 : slash;
}

/// Returns the accelerometer's topic that has most of its name in common with the gyroscope's.
std::optional<std::uint32_t> accelerometer_of(const Recording& recording, std::uint32_t gyroscope) {
  const auto& topics = recording.topics();
  std::optional<std::uint32_t> best;
  const auto common = [&](std::uint32_t i) {
    return common_length(topics[i].name, topics[gyroscope].name);
  };
  for (std::uint32_t i = 0; i < topics.size(); ++i) {
    if (topics[i].type != "sensor_msgs/Imu" || !is_accelerometer(topics[i].name)) continue;
    if (!best || common(i) > common(*best)) best = i;
  }
  return best;
}

/// Sets the accelerations to those of other samples at the same times.
void interpolate_accelerations(const std::vector<ImuSample>& of, std::vector<ImuSample>& samples) {
  if (of.empty()) return;
  for (ImuSample& sample : samples) {
    const auto after =
        std::lower_bound(of.begin(), of.end(), sample.timestamp,
                         [](const ImuSample& s, double time) { return s.timestamp < time; });
    if (after == of.begin() || after == of.end()) {
      sample.acceleration = (after == of.end() ? of.back() : of.front()).acceleration;
      continue;
    }
    const ImuSample &a = *(after - 1), &b = *after;
    const double share = (sample.timestamp - a.timestamp) / (b.timestamp - a.timestamp);
    sample.acceleration = (1 - share) * a.acceleration + share * b.acceleration;
  }
}

std::optional<Pose> pose_in_color(Recording& recording, FrameTree& frames,
                                  const RgbdStreams& streams, const ImuStream& imu) {
  if (auto pose = realsense_extrinsics(recording, streams.color.name, imu.topic)) return pose;
  if (imu.frame.empty() || streams.color.frame.empty()) return std::nullopt;
  if (imu.frame == streams.color.frame) return Pose();
  return frames.find(streams.color.frame, imu.frame);
}

}  // namespace

std::optional<ImuStream> find_imu_stream(Recording& recording, const RgbdStreams& streams) {
  FrameTree frames(recording);
  std::optional<ImuStream> best;
  std::uint32_t best_topic = 0;
  const auto rank = [&](const ImuStream& imu, std::uint32_t topic) {
    return std::tuple(common_length(imu.topic, streams.color.name), imu.T_color_imu.has_value(),
                      recording.topics()[topic].messages);
  };
  for (std::uint32_t i = 0; i < recording.topics().size(); ++i) {
    const Topic& topic = recording.topics()[i];
    if (topic.type != "sensor_msgs/Imu" || is_accelerometer(topic.name)) continue;
    const auto frame = frame_of(recording, i);
    if (!frame) continue;
    ImuStream imu{.topic = topic.name, .frame = *frame};
    imu.T_color_imu = pose_in_color(recording, frames, streams, imu);
    if (best && rank(imu, i) <= rank(*best, best_topic)) continue;
    best = std::move(imu), best_topic = i;
  }
  if (!best) return std::nullopt;
  best->samples = samples_of(recording, best_topic);
  if (best->samples.empty()) return std::nullopt;
  const bool without_accelerations =
      std::all_of(best->samples.begin(), best->samples.end(),
                  [](const ImuSample& sample) { return sample.acceleration.isZero(0); });
  if (const auto other = accelerometer_of(recording, best_topic); other && without_accelerations) {
    best->accelerometer = recording.topics()[*other].name;
    interpolate_accelerations(samples_of(recording, *other), best->samples);
  }
  return best;
}

}  // namespace stillmap
