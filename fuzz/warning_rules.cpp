// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/json_text.hpp"
#include "stillmap/warn/rules.hpp"

#include "fuzz/fuzz_target.hpp"
#include <nlohmann/json.hpp>

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  return {
      "up: [0, -2, 0]\nzones:\n  - name: gate\n    polygon: [[0, 1, 0], [1, 1, 0], [1, 1, 1]]\n"
      "    height: [0.5, 2]\n    classes: [person]\npoints:\n  - {name: hook, offset: [0, .5, 6]}\n"
      "distances:\n  - {to: hook, nearer: 3, within: 2, level: true}\n"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] { json_text(zones_message(read_warning_rules(file))); });
  return 0;
}
