// SPDX-License-Identifier: Apache-2.0
// MCAP files.
#include "fuzz/recording_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const auto little = recorded_messages(test::Kind::kLittleCdr);
  const auto big = recorded_messages(test::Kind::kBigCdr);
  return {test::mcap_of(little, "cdr", "", 0, true), test::mcap_of(big, "cdr", "", 2, true),
          test::mcap_of(little, "cdr", "lz4", 2, true),
          test::mcap_of(big, "cdr", "zstd", 2, false)};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  stillmap::fuzz::parse_recording(stillmap::fuzz::text_of(data, size));
  return 0;
}
