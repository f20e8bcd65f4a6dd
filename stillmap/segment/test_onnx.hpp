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

/// Returns a model that computes `rows` times `columns` values from the means of its image's three
/// channels, times `weights`: row-major, for each value the factors of the three means.
inline std::string mean_model(const std::vector<std::int64_t>& in, std::int64_t rows,
                              std::int64_t columns, const std::vector<float>& weights,
                              const std::map<std::string, std::string>& metadata) {
  constexpr int kFloat = 1, kInt64 = 7, kInts = 7;  // TensorProto.DataType, AttributeProto.Type
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
  const std::vector<std::int64_t> shape = {1, rows, columns};
  const std::string kernel =
      bytes(5, bytes(1, "kernel_shape") + number(8, 1) + number(8, 1) + number(20, kInts));
  const std::string graph =
      node("GlobalAveragePool", {"in"}, "mean", "") +
      node("Conv", {"mean", "weights"}, "flat", kernel) +
      node("Reshape", {"flat", "shape"}, "out", "") + bytes(2, "graph") +
      constant("weights", kFloat, {rows * columns, 3, 1, 1}, weights.data(), 4 * weights.size()) +
      constant("shape", kInt64, {3}, shape.data(), 24) + bytes(11, tensor_value("in", in)) +
      bytes(12, tensor_value("out", shape));
  std::string model =
      number(1, 7) + bytes(2, "test") + bytes(7, graph) + bytes(8, bytes(1, "") + number(2, 12));
  for (const auto& [key, value] : metadata) model += bytes(14, bytes(1, key) + bytes(2, value));
  return model;
}

}  // namespace stillmap::test
