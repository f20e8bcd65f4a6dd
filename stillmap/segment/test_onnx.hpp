// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdint>
#include <map>
#include <string>
#include <vector>

namespace stillmap::test {

/// Writers for the parts of protobuf that a minimal ONNX file needs.
inline std::string varint(std::uint64_t value) {
  std::string bytes;
  for (; value > 0x7F; value >>= 7) bytes += static_cast<char>((value & 0x7F) | 0x80);
  return bytes + static_cast<char>(value);
}
inline std::string number(int id, std::uint64_t value) {
  return varint(static_cast<std::uint64_t>(id) << 3) + varint(value);
}
inline std::string bytes(int id, const std::string& content) {
  return varint(static_cast<std::uint64_t>(id) << 3 | 2) + varint(content.size()) + content;
}

inline std::string tensor_value(const std::string& name, const std::vector<std::int64_t>& shape,
                                int element_type = 1) {
  std::string dimensions;
  for (const auto n : shape) {
    dimensions += bytes(1, n > 0 ? number(1, static_cast<std::uint64_t>(n)) : bytes(2, "open"));
  }
  const std::string tensor =
      number(1, static_cast<std::uint64_t>(element_type)) + bytes(2, dimensions);
  return bytes(1, name) + bytes(2, bytes(1, tensor));
}

/// Returns a model with one operator, such as "Relu", from `in` to `out`; the types of their
/// elements are numbers of TensorProto.DataType, 1 for floats.
inline std::string tiny_model(const std::string& operation, const std::vector<std::int64_t>& in,
                              const std::vector<std::int64_t>& out,
                              const std::map<std::string, std::string>& metadata = {},
                              int in_type = 1, int out_type = 1) {
  const std::string node =
      bytes(1, "in") + bytes(2, "out") + bytes(3, "node") + bytes(4, operation);
  const std::string graph = bytes(1, node) + bytes(2, "graph") +
                            bytes(11, tensor_value("in", in, in_type)) +
                            bytes(12, tensor_value("out", out, out_type));
  std::string model =
      number(1, 7) + bytes(2, "test") + bytes(7, graph) + bytes(8, bytes(1, "") + number(2, 12));
  for (const auto& [key, value] : metadata) model += bytes(14, bytes(1, key) + bytes(2, value));
  return model;
}

/// An output of mean_model().
struct MeanOutput {
  std::string name;
  std::vector<std::int64_t> shape;
  /// Row-major; for each value the factors of the means of the image's three channels.
  std::vector<float> weights;
  /// Row-major; is added to the values. Empty: zeros.
  std::vector<float> bias = {};
  bool integers = false;  ///< 64-bit integers instead of floats.
};

/// Returns a model that computes its outputs from the means of its image's three channels.
inline std::string mean_model(const std::vector<std::int64_t>& in,
                              const std::vector<MeanOutput>& outputs,
                              const std::map<std::string, std::string>& metadata = {}) {
  constexpr int kFloat = 1, kInt64 = 7, kInt = 2, kInts = 7;  // TensorProto, AttributeProto
  const auto node = [](const std::string& operation, const std::vector<std::string>& from,
                       const std::string& to, const std::string& attribute) {
    std::string text;
    for (const std::string& name : from) text += bytes(1, name);
    return bytes(1, text + bytes(2, to) + bytes(3, to) + bytes(4, operation) + attribute);
  };
  const auto constant = [](const std::string& name, int type,
                           const std::vector<std::int64_t>& shape, const void* values,
                           std::size_t size) {
    std::string text;
    for (const auto n : shape) text += number(1, static_cast<std::uint64_t>(n));
    return bytes(5, text + number(2, static_cast<std::uint64_t>(type)) + bytes(8, name) +
                        bytes(9, std::string(static_cast<const char*>(values), size)));
  };
  const std::string kernel =
      bytes(5, bytes(1, "kernel_shape") + number(8, 1) + number(8, 1) + number(20, kInts));
  const std::string to_int64 = bytes(5, bytes(1, "to") + number(3, kInt64) + number(20, kInt));
  std::string nodes = node("GlobalAveragePool", {"in"}, "mean", ""), constants, values;
  for (const MeanOutput& output : outputs) {
    const std::string& name = output.name;
    const std::size_t count = output.weights.size() / 3;
    std::vector<float> bias = output.bias;
    bias.resize(count);
    const auto filters = static_cast<std::int64_t>(count);
    const std::string reshaped = output.integers ? name + "_floats" : name;
    nodes += node("Conv", {"mean", name + "_weights", name + "_bias"}, name + "_flat", kernel) +
             node("Reshape", {name + "_flat", name + "_shape"}, reshaped, "");
    if (output.integers) nodes += node("Cast", {reshaped}, name, to_int64);
    constants +=
        constant(name + "_weights", kFloat, {filters, 3, 1, 1}, output.weights.data(), 12 * count) +
        constant(name + "_bias", kFloat, {filters}, bias.data(), 4 * count) +
        constant(name + "_shape", kInt64, {static_cast<std::int64_t>(output.shape.size())},
                 output.shape.data(), 8 * output.shape.size());
    values += bytes(12, tensor_value(name, output.shape, output.integers ? kInt64 : kFloat));
  }
  const std::string graph =
      nodes + bytes(2, "graph") + constants + bytes(11, tensor_value("in", in)) + values;
  std::string model =
      number(1, 7) + bytes(2, "test") + bytes(7, graph) + bytes(8, bytes(1, "") + number(2, 12));
  for (const auto& [key, value] : metadata) model += bytes(14, bytes(1, key) + bytes(2, value));
  return model;
}

}  // namespace stillmap::test
