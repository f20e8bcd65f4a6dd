// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/onnx_info.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/field_text.hpp"
#include "stillmap/base/file.hpp"

#include <charconv>
#include <optional>
#include <set>

namespace stillmap {
namespace {

/// Internal exception for invalid protobuf bytes; parse_onnx() converts it to an Error.
struct BadWire {};

/// One field of a protobuf message: a number, or the bytes of a string or nested message.
struct Field {
  std::uint32_t id = 0;
  std::uint64_t number = 0;
  std::string_view bytes;
};

/// Iterates over the fields of one protobuf message (wire format:
/// protobuf.dev/programming-guides/encoding).
class Message {
 public:
  explicit Message(std::string_view bytes) : rest_(bytes) {}

  std::optional<Field> next() {
    if (rest_.empty()) return std::nullopt;
    const std::uint64_t key = varint();
    Field field{.id = static_cast<std::uint32_t>(key >> 3), .number = 0, .bytes = {}};
    if (field.id == 0) throw BadWire{};
    switch (key & 7) {
      case 0:
        field.number = varint();
        break;
      case 1:
        field.bytes = take(8);
        break;
      case 2:
        field.bytes = take(varint());
        break;
      case 5:
        field.bytes = take(4);
        break;
      default:
        throw BadWire{};
    }
    return field;
  }

 private:
  std::string_view take(std::uint64_t count) {
    if (count > rest_.size()) throw BadWire{};
    const std::string_view taken = rest_.substr(0, count);
    rest_.remove_prefix(count);
    return taken;
  }
  std::uint64_t varint() {
    std::uint64_t value = 0;
    for (int shift = 0; shift < 64; shift += 7) {
      const auto byte = static_cast<std::uint8_t>(take(1)[0]);
      value |= static_cast<std::uint64_t>(byte & 0x7F) << shift;
      if ((byte & 0x80) == 0) return value;
    }
    throw BadWire{};
  }
  std::string_view rest_;
};

template <typename F>
void for_each_field_of(std::string_view bytes, F&& f) {
  Message message(bytes);
  while (const auto field = message.next()) f(*field);
}

std::pair<std::string, std::string> parse_entry(std::string_view bytes) {
  std::pair<std::string, std::string> entry;
  for_each_field_of(bytes, [&](const Field& f) {
    if (f.id == 1) entry.first = f.bytes;
    if (f.id == 2) entry.second = f.bytes;
  });
  return entry;
}

void parse_shape(std::string_view bytes, OnnxValue& value) {
  for_each_field_of(bytes, [&](const Field& dimension) {
    if (dimension.id != 1) return;
    value.shape.push_back(-1);
    value.names.emplace_back();
    for_each_field_of(dimension.bytes, [&](const Field& f) {
      if (f.id == 1 && f.number > 0) value.shape.back() = static_cast<std::int64_t>(f.number);
      if (f.id == 2) value.names.back() = f.bytes;
    });
  });
}

OnnxValue parse_value(std::string_view bytes) {
  OnnxValue value;
  for_each_field_of(bytes, [&](const Field& f) {
    if (f.id == 1) value.name = f.bytes;
    if (f.id != 2) return;  // TypeProto
    for_each_field_of(f.bytes, [&](const Field& type) {
      if (type.id != 1) return;  // its tensor_type
      for_each_field_of(type.bytes, [&](const Field& tensor) {
        if (tensor.id == 1) value.element_type = tensor.number;
        if (tensor.id == 2) parse_shape(tensor.bytes, value);
      });
    });
  });
  return value;
}

std::string parse_tensor_name(std::string_view bytes) {
  std::string name;
  for_each_field_of(bytes, [&](const Field& f) {
    if (f.id == 8) name = f.bytes;
  });
  return name;
}

void parse_graph(std::string_view bytes, OnnxInfo& info) {
  std::set<std::string> weights;
  for_each_field_of(bytes, [&](const Field& f) {
    switch (f.id) {
      case 1:
        ++info.nodes;
        break;
      case 5:
        weights.insert(parse_tensor_name(f.bytes));
        break;
      case 11:
        info.inputs.push_back(parse_value(f.bytes));
        break;
      case 12:
        info.outputs.push_back(parse_value(f.bytes));
        break;
      default:
        break;
    }
  });
  std::erase_if(info.inputs, [&](const OnnxValue& v) { return weights.contains(v.name); });
}

OnnxInfo parse_model(std::string_view bytes) {
  OnnxInfo info;
  for_each_field_of(bytes, [&](const Field& f) {
    if (f.id == 7) parse_graph(f.bytes, info);
    if (f.id == 14) info.metadata.insert(parse_entry(f.bytes));
  });
  return info;
}

/// Parser for a Python dict of int to str, the same in JSON, or a list of str.
class DictReader {
 public:
  explicit DictReader(std::string_view text) : rest_(text) {}
  bool accept(char c) {
    const auto first = rest_.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos || rest_[first] != c) return false;
    rest_.remove_prefix(first + 1);
    return true;
  }
  std::optional<int> integer() {
    const auto first = rest_.find_first_not_of(" \t\r\n");
    if (first == std::string_view::npos) return std::nullopt;
    rest_.remove_prefix(first);
    int value = 0;
    const auto [end, error] = std::from_chars(rest_.data(), rest_.data() + rest_.size(), value);
    if (error != std::errc{}) return std::nullopt;
    rest_.remove_prefix(static_cast<std::size_t>(end - rest_.data()));
    return value;
  }
  /// Returns an integer, which JSON puts into quotes.
  std::optional<int> key() {
    const bool is_quoted = accept('"');
    const auto value = integer();
    return is_quoted && !accept('"') ? std::nullopt : value;
  }
  std::optional<std::string> quoted() {
    const char quote = accept('\'') ? '\'' : accept('"') ? '"' : '\0';
    if (quote == '\0') return std::nullopt;
    std::string text;
    while (!rest_.empty() && rest_.front() != quote) {
      if (rest_.front() == '\\' && rest_.size() > 1) rest_.remove_prefix(1);
      text += rest_.front();
      rest_.remove_prefix(1);
    }
    if (rest_.empty()) return std::nullopt;
    rest_.remove_prefix(1);
    return text;
  }

 private:
  std::string_view rest_;
};

std::vector<std::string> list_of(const std::map<int, std::string>& names) {
  std::vector<std::string> list;
  for (const auto& [id, name] : names) {
    while (static_cast<int>(list.size()) < id)
      list.push_back("class " + std::to_string(list.size()));
    list.push_back(name);
  }
  return list;
}

/// Returns the advice for a folder that is given instead of a network: the first network in it, by
/// name, if there is one.
std::string network_in(const std::filesystem::path& folder) {
  std::filesystem::path first;
  std::error_code error;
  for (const auto& entry : std::filesystem::directory_iterator(folder, error)) {
    const std::filesystem::path& file = entry.path();
    if (file.extension() == ".onnx" && (first.empty() || file < first)) first = file;
  }
  return first.empty() ? "name a file (.onnx), or pass a folder of masks with --masks"
                       : "name a file, such as " + first.string();
}

}  // namespace

OnnxInfo parse_onnx(std::string_view bytes, const std::string& where) {
  if (bytes.starts_with("PK"))
    throw Error("this file is a ZIP archive, such as PyTorch's weights (.pt), not an ONNX network",
                where, export_advice());
  OnnxInfo info;
  try {
    info = parse_model(bytes);
  } catch (const BadWire&) {
    throw Error("this file is not an ONNX network (or is truncated)", where, export_advice());
  }
  if (info.nodes == 0 || info.inputs.empty() || info.outputs.empty()) {
    throw Error("this file is not an ONNX network: it has no graph with inputs and outputs", where,
                export_advice());
  }
  return info;
}

OnnxInfo read_onnx(const std::filesystem::path& file) {
  if (std::filesystem::is_directory(file))
    throw Error("this is a folder, not a network file", file.string(), network_in(file));
  if (!std::filesystem::is_regular_file(file)) {
    throw Error("there is no such network file", file.string(), export_advice());
  }
  return parse_onnx(read_file(file, kLargestNetwork), file.string());
}

std::vector<std::string> parse_class_names(std::string_view dict) {
  constexpr int kMostClasses = 100000;  // Larger ids are treated as invalid.
  DictReader reader(dict);
  std::map<int, std::string> names;
  const bool is_list = reader.accept('[');
  if (!is_list && !reader.accept('{')) return {};
  const char end = is_list ? ']' : '}';
  bool more = !reader.accept(end);
  while (more) {
    const auto id = is_list ? std::optional(static_cast<int>(names.size())) : reader.key();
    if (!id || *id < 0 || *id > kMostClasses || (!is_list && !reader.accept(':'))) return {};
    const auto name = reader.quoted();
    if (!name) return {};
    names[*id] = field_text(*name);
    reader.accept(',');
    more = !reader.accept(end);
  }
  return list_of(names);
}

std::vector<std::string> class_names_in(const std::map<std::string, std::string>& metadata) {
  if (const auto found = metadata.find("names"); found != metadata.end())
    return parse_class_names(found->second);
  const auto found = metadata.find("rfdetr_inference");
  if (found == metadata.end()) return {};
  constexpr std::string_view kKey = "\"class_id_to_name\":";
  const std::string_view text = found->second;
  const auto at = text.find(kKey);
  return at == std::string_view::npos ? std::vector<std::string>()
                                      : parse_class_names(text.substr(at + kKey.size()));
}

std::string export_advice() {
  return "export one with `yolo export model=yolo11n-seg.pt format=onnx imgsz=480,640` "
         "(AGPL-3.0; others are under the Apache license: docs/networks.md)";
}

}  // namespace stillmap
