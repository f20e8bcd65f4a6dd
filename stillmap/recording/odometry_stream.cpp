// SPDX-License-Identifier: Apache-2.0
#include "stillmap/recording/odometry_stream.hpp"

#include "stillmap/recording/frame_tree.hpp"
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/messages.hpp"

#include <tuple>

namespace stillmap {
namespace {

OdometryStream read_stream(Recording& recording, std::uint32_t topic) {
  OdometryStream stream{.topic = recording.topics()[topic].name};
  for (const MessageEntry& entry : recording.messages_of(topic)) {
    const auto message = if_readable([&] {
      return decode_odometry(recording.read(entry), recording.topics()[entry.topic].encoding);
    });
    if (!message) continue;
    if (stream.frame.empty()) stream.frame = message->child;
    const double time = seconds_of(entry.stamp);
    if (stream.samples.empty() || time > stream.samples.back().timestamp)
      stream.samples.push_back({time, message->T_odom_base});
  }
  return stream;
}

}  // namespace

std::optional<OdometryStream> find_odometry_stream(Recording& recording,
                                                   const RgbdStreams& streams) {
  FrameTree frames(recording);
  std::optional<OdometryStream> best;
  const auto rank = [](const OdometryStream& stream) {
    return std::tuple(stream.T_color_base.has_value(), stream.samples.size());
  };
  for (std::uint32_t i = 0; i < recording.topics().size(); ++i) {
    if (recording.topics()[i].type != "nav_msgs/Odometry") continue;
    OdometryStream stream = read_stream(recording, i);
    if (stream.samples.empty()) continue;
    if (!streams.color.frame.empty() && !stream.frame.empty())
      stream.T_color_base = frames.find(streams.color.frame, stream.frame);
    if (!best || rank(stream) > rank(*best)) best = std::move(stream);
  }
  return best;
}

}  // namespace stillmap
