// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/motion_labels.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  LabelFile file;
  file.add({.index = 0, .timestamp = 1, .keypoints = {}});
  file.add({.index = 1,
            .timestamp = 1.1,
            .keypoints = {{.u = 3, .v = 4, .depth = 1}, {.u = 5, .v = 6, .weight = 0}}});
  return {file.bytes()};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] { read_labels(file); });
  return 0;
}
