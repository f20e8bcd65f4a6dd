// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A graph input or output as the file declares it.
struct OnnxValue {
  std::string name;
  std::vector<std::int64_t> shape;  ///< -1 where the size is left open
};

/// What the file of a network says about itself, without running it.
struct OnnxInfo {
  std::string producer;                         ///< "pytorch", ...
  std::map<std::string, std::string> metadata;  ///< metadata_props: "names", "stride", "task", ...
  std::vector<OnnxValue> inputs;                ///< without the weights
  std::vector<OnnxValue> outputs;
  std::size_t nodes = 0;  ///< operators in the graph
};

/// Reads the few fields named above out of an ONNX protobuf (field numbers: onnx.proto3, messages
/// ModelProto, GraphProto, ValueInfoProto). Throws Error where the bytes are no ONNX model. `where`
/// names it in errors.
OnnxInfo parse_onnx(std::string_view bytes, const std::string& where);

/// The same for a file. Throws Error if it is missing, or no ONNX model.
OnnxInfo read_onnx(const std::filesystem::path& file);

/// Parses the class list that Ultralytics writes into the metadata, a Python dict of int to str
/// such as {0: 'person', 1: "driver's cab"}. Missing ids get the name "class <id>". Empty if the
/// text is no such dict.
std::vector<std::string> parse_class_names(std::string_view dict);

/// The one line of advice that all errors about unfit networks end with.
std::string export_advice();

}  // namespace stillmap
