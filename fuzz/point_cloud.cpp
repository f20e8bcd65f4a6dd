// SPDX-License-Identifier: Apache-2.0
// PLY files of point clouds.
#include "stillmap/dense/cloud.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  Cloud cloud;
  cloud.add({1, 2, 3}, {4, 5, 6});
  cloud.add({-1, 0, 1e9F}, {255, 0, 0});
  const auto file = file_with("", "cloud.ply");
  write_ply(file, cloud);
  return {content_of(file),
          "ply\nformat binary_little_endian 1.0\ncomment x\nelement vertex 1\nproperty double x\n"
          "property float y\nproperty float z\nproperty uchar diffuse_red\nelement face 0\n"
          "property list uchar int vertex_indices\nend_header\n" +
              std::string(17, '\0')};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const auto file = fuzz::file_with(fuzz::text_of(data, size));
  fuzz::parse([&] { read_ply(file); });
  return 0;
}
