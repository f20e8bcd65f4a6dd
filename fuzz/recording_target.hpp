// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/rgbd_streams.hpp"
#include "stillmap/recording/test_recording.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

/// Returns messages of most types that are read, of two cameras with a transform between them.
inline std::vector<test::TestMessage> recorded_messages(test::Kind kind) {
  const std::string separator = kind == test::Kind::kRos1 ? "/" : "/msg/";
  const test::TestCamera color{.kind = kind, .frame = "color"},
      depth{.kind = kind, .frame = "depth"};
  return {{"/color", "sensor_msgs" + separator + "Image",
           color.image(1, 7, 4, 3, "rgb8", 3, std::string(36, 'c')), 1},
          {"/depth", "sensor_msgs" + separator + "CompressedImage",
           depth.compressed_image(1, 9, "16UC1; compressedDepth png", std::string(20, 'd')), 2},
          {"/color_info", "sensor_msgs" + separator + "CameraInfo",
           color.info(4, 3, 5, "plumb_bob", {0.1, 0, 0, 0, 0}), 3},
          {"/depth_info", "sensor_msgs" + separator + "CameraInfo",
           depth.info(4, 3, 5, "plumb_bob", {}), 4},
          {"/tf_static", "tf2_msgs" + separator + "TFMessage",
           color.transform("color", "depth", {0.1, 0, 0, 0, 0, 0, 1}), 5}};
}

/// Reads everything that a file contains.
inline void parse_recording(std::string_view bytes) {
  const auto file = file_with(bytes, "recording");
  parse([&] {
    Recording recording(file);
    for (const MessageEntry& entry : recording.messages())
      if_readable([&] { return recording.read(entry).size(); });
    parse([&] { find_rgbd_streams(recording); });
  });
}

}  // namespace stillmap::fuzz
