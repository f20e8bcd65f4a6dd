// SPDX-License-Identifier: Apache-2.0
// Files of options, and the assignments of --set.
#include "stillmap/options.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  return {options_yaml(Options()),
          "preset: static\nfeatures:\n  keypoints: 500\nmotion: {cues: [residual, semantic]}\n",
          "features.keypoints=500", "motion.cues=[residual, semantic]",
          R"(network.model="a \"b\".onnx")"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const std::string_view input = fuzz::text_of(data, size);
  const auto file = fuzz::file_with(input, "options.yaml");
  fuzz::parse([&] {
    // Options that were read are written such that they are read again.
    const std::string written = options_yaml(read_options({}, file));
    const Options again = read_options({}, fuzz::file_with(written, "again.yaml"));
    if (options_yaml(again) != written) std::abort();
  });
  fuzz::parse([&] {
    Options options;
    set_option(std::string(input), options);
  });
  return 0;
}
