// SPDX-License-Identifier: Apache-2.0
// floor.json.
#include "stillmap/report/planner_files.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  return {R"({"floor": {"up": [0, -1, 0], "height": -1.5}, "confidence": 0.9})",
          R"({"floor": {"up": [0, -0.6, -0.8], "height": 0}})"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] { read_floor(file); });
  return 0;
}
