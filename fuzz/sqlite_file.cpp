// SPDX-License-Identifier: Apache-2.0
// SQLite files of rosbag2.
#include "fuzz/recording_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const test::TestFolder folder;
  return {content_of(folder.write_sqlite("whole.db3", recorded_messages(test::Kind::kLittleCdr)))};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  stillmap::fuzz::parse_recording(stillmap::fuzz::text_of(data, size));
  return 0;
}
