// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <filesystem>
#include <map>
#include <string>
#include <string_view>
#include <vector>

namespace stillmap {

/// A graph input or output declared in the file.
struct OnnxValue {
  std::string name;
  std::vector<std::int64_t> shape;  ///< -1 for a dynamic size.
  std::vector<std::string> names;   ///< Name of each dimension; empty where it has none.
  /// TensorProto.DataType of the elements; a file that leaves it out means floats here.
  std::uint64_t element_type = kFloat;
  static constexpr std::uint64_t kFloat = 1, kInt64 = 7, kHalf = 10;  ///< FLOAT, INT64, FLOAT16.
};

/// Metadata of a network file, read without running the network.
struct OnnxInfo {
  /// Entries of metadata_props: "names", "stride", ...
  std::map<std::string, std::string> metadata;
  std::vector<OnnxValue> inputs;  ///< Without the weights.
  std::vector<OnnxValue> outputs;
  std::size_t nodes = 0;  ///< Number of operators in the graph.
};

/// Reads these fields from an ONNX protobuf (field numbers: onnx.proto3, messages ModelProto,
/// GraphProto, ValueInfoProto). Throws Error if the bytes are not an ONNX model; `where` is the
/// name for messages.
OnnxInfo parse_onnx(std::string_view bytes, const std::string& where);

/// Largest file of a network: the limit of protobuf [bytes].
inline constexpr std::uintmax_t kLargestNetwork = std::uintmax_t{2} << 30;

/// The same for a file. Throws Error if it is missing, larger than kLargestNetwork, or not an ONNX
/// model.
OnnxInfo read_onnx(const std::filesystem::path& file);

/// Parses the class list in the metadata of Ultralytics, a Python dict of int to str such as {0:
/// 'person', 1: "driver's cab"}, the same as JSON, or a list of str. Control characters and commas
/// become blanks. Missing ids get the name "class <id>". Returns an empty list for other texts.
std::vector<std::string> parse_class_names(std::string_view dict);

/// Returns the class names of a network's metadata: `names`, or those in `rfdetr_inference`, JSON
/// that RF-DETR's export writes (class_id_to_name). An empty list if there are none.
std::vector<std::string> class_names_in(const std::map<std::string, std::string>& metadata);

/// Returns the advice for all errors about unsuitable networks.
std::string export_advice();

}  // namespace stillmap
