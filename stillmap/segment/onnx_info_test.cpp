// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/onnx_info.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/segment/test_onnx.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

TEST(ParseOnnx, ReadsShapesAndMetadata) {
  const auto info = parse_onnx(test::tiny_model("Relu", {1, 3, -1, 640}, {1, 84, 8400},
                                                {{"stride", "32"}, {"task", "detect"}}),
                               "tiny");
  EXPECT_EQ(info.nodes, 1U);
  ASSERT_EQ(info.inputs.size(), 1U);
  EXPECT_THAT(info.inputs[0].shape, ElementsAre(1, 3, -1, 640));
  ASSERT_EQ(info.outputs.size(), 1U);
  EXPECT_EQ(info.outputs[0].name, "out");
  EXPECT_THAT(info.outputs[0].shape, ElementsAre(1, 84, 8400));
  EXPECT_EQ(info.metadata.at("stride"), "32");
  EXPECT_EQ(info.metadata.at("task"), "detect");
}

TEST(ParseOnnx, WeightsAreNotInputs) {
  const std::string graph = test::bytes(1, test::bytes(4, "Conv")) +
                            test::bytes(5, test::number(2, 1) + test::bytes(8, "w")) +
                            test::bytes(11, test::tensor_value("w", {8, 3, 3, 3})) +
                            test::bytes(11, test::tensor_value("images", {1, 3, 32, 32})) +
                            test::bytes(12, test::tensor_value("out", {1, 8, 30, 30}));
  const auto info = parse_onnx(test::bytes(7, graph), "tiny");
  ASSERT_EQ(info.inputs.size(), 1U);
  EXPECT_EQ(info.inputs[0].name, "images");
}

TEST(ParseOnnx, AnyOtherBytesAreAnError) {
  for (const std::string& bytes :
       {std::string(), std::string("not a network, but a letter\n"), std::string(1000, '\0'),
        std::string(1000, '\xFF'), std::string("\x89PNG\r\n\x1a\n 1234567890")}) {
    EXPECT_THROW(parse_onnx(bytes, "junk"), Error) << bytes.substr(0, 10);
  }
}

TEST(ParseOnnx, TruncationIsAnErrorOrHarmless) {
  const std::string whole = test::tiny_model("Relu", {1, 3, 8, 8}, {1, 3, 8, 8});
  std::size_t errors = 0;
  for (std::size_t length = 0; length < whole.size(); ++length) {
    try {
      EXPECT_EQ(parse_onnx(std::string_view(whole).substr(0, length), "cut").nodes, 1U);
    } catch (const Error&) {
      ++errors;
    }
  }
  EXPECT_GT(errors, whole.size() / 2);  // all but those after the graph
}

TEST(ReadOnnx, MissingFileIsAnErrorThatNamesIt) {
  try {
    read_onnx("/nowhere/yolo.onnx");
    FAIL() << "read a missing file";
  } catch (const Error& e) {
    EXPECT_EQ(e.where(), "/nowhere/yolo.onnx");
    EXPECT_THAT(e.fix(), testing::HasSubstr("yolo export"));
  }
}

TEST(ReadOnnx, AFolderIsAnErrorThatNamesANetworkInIt) {
  const std::filesystem::path folder = test::own_path("networks");
  std::filesystem::create_directories(folder);
  const auto error_of = [&] {
    try {
      read_onnx(folder);
    } catch (const Error& e) {
      return e.problem() + "; " + e.fix();
    }
    return std::string("no error");
  };
  EXPECT_EQ(error_of(),
            "this is a folder, not a network file; name a file (.onnx), or pass a "
            "folder of masks with --masks");
  write_file(folder / "b.onnx", "");
  write_file(folder / "a.onnx", "");
  EXPECT_EQ(error_of(), "this is a folder, not a network file; name a file, such as " +
                            (folder / "a.onnx").string());
  std::filesystem::remove_all(folder);
}

TEST(ParseClassNames, ReadsPythonDicts) {
  EXPECT_THAT(parse_class_names("{0: 'person', 1: 'bicycle'}"), ElementsAre("person", "bicycle"));
  EXPECT_THAT(parse_class_names(R"({0:"driver's cab",1:'a\'b', 2: 'x, y: {z}',})"),
              ElementsAre("driver's cab", "a'b", "x  y: {z}"));
  EXPECT_THAT(parse_class_names("{2: 'c', 0: 'a'}"), ElementsAre("a", "class 1", "c"));
  EXPECT_THAT(parse_class_names(R"({"0": "person", "1": "bicycle"})"),
              ElementsAre("person", "bicycle"));
  EXPECT_THAT(parse_class_names("['person', 'bicycle']"), ElementsAre("person", "bicycle"));
}

TEST(ParseClassNames, SeparatorsOfLinesAndColumnsBecomeBlanks) {
  EXPECT_THAT(parse_class_names("{0: 'person\nend_header\n,x'}"),
              ElementsAre("person end_header  x"));
}

TEST(ParseClassNames, OtherTextsGiveNothing) {
  for (const char* text : {"", "{", "{}", "{0: person}", "{0 'person'}", "['person'", "[",
                           "{0: 'person", "{-1: 'x'}", "{99999999999: 'x'}", "{0: 'a'"}) {
    EXPECT_THAT(parse_class_names(text), IsEmpty()) << text;
  }
}

}  // namespace
}  // namespace stillmap
