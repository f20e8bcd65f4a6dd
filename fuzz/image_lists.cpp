// SPDX-License-Identifier: Apache-2.0
// rgb.txt, depth.txt and a file of associations, separated by zero bytes.
#include "stillmap/sensor/sequence.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  using namespace std::string_literals;
  const std::string color = "# color\n1.000000 rgb/0.png\n1.033333 rgb/1.png\n1.066667 rgb/2.png\n";
  const std::string depth = "1.005 depth/0.png\r\n1.04,depth/1.png\n1.07\tdepth/2.png\n";
  return {color + "\0"s + depth,
          color + "\0"s + depth + "\0"s + "1.0 rgb/0.png 1.005 depth/0.png\n",
          "\0\0"s + "1 ./depth/1.png 1 ./rgb/1.png\n2 ./depth/2.png 2 ./rgb/2.png\n"};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const std::string_view input = fuzz::text_of(data, size);
  const auto first = std::min(input.find('\0'), size);
  const auto second = std::min(input.find('\0', first + 1), size);
  SequencePaths paths;
  paths.color_list = fuzz::file_with(input.substr(0, first), "rgb.txt");
  paths.depth_list =
      fuzz::file_with(first < size ? input.substr(first + 1, second - first - 1) : "", "depth.txt");
  fuzz::parse([&] { list_frames(paths); });
  if (second < size) {
    paths.associations = fuzz::file_with(input.substr(second + 1), "associations.txt");
    fuzz::parse([&] { list_frames(paths); });
  }
  return 0;
}
