// SPDX-License-Identifier: Apache-2.0
// The header of ONNX networks, and the class names in it.
#include "stillmap/segment/onnx_info.hpp"
#include "stillmap/segment/test_onnx.hpp"

#include "fuzz/fuzz_target.hpp"

namespace stillmap::fuzz {

std::vector<std::string> seeds() {
  const std::string names = R"({0: 'person', 1: "driver's cab", 7: 'a\'b'})";
  return {
      test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, -1, 8}, {{"names", names}, {"stride", "8"}}),
      test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8},
                       {{"rfdetr_inference", R"({"class_id_to_name":{"1":"person"}})"}}),
      test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8}, {}, 10, 7)};
}

}  // namespace stillmap::fuzz

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace stillmap;
  const std::string_view input = fuzz::text_of(data, size);
  parse_class_names(input);
  fuzz::parse([&] { class_names_in(parse_onnx(input, "input").metadata); });
  return 0;
}
