// SPDX-License-Identifier: Apache-2.0
// ROS 1 bags.
#include "fuzz/recording_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const auto messages = recorded_messages(test::Kind::kRos1);
  return {test::bag_of(messages, "none", 50, true), test::bag_of(messages, "bz2", 2, false),
          test::bag_of(messages, "lz4", 2, true)};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  stillmap::fuzz::parse_recording(stillmap::fuzz::text_of(data, size));
  return 0;
}
