// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/bytes.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/dense/cloud.hpp"

#include <algorithm>
#include <charconv>
#include <cstring>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include <fmt/format.h>

// Written by hand rather than with Open3D, whose writer stores doubles (twice the size) and whose
// readers report errors by a console warning and a bool.

namespace stillmap {
namespace fs = std::filesystem;
namespace {

constexpr Rgb kWhite = {255, 255, 255};

template <typename T>
T load(const char* bytes) {
  T value;
  std::memcpy(&value, bytes, sizeof(T));
  return value;
}

// Returns the words of a line, separated by blanks.
std::vector<std::string_view> words_of(std::string_view line) {
  constexpr std::string_view kBlanks = " \t\r";
  std::vector<std::string_view> words;
  while (true) {
    const std::size_t begin = line.find_first_not_of(kBlanks);
    if (begin == std::string_view::npos) return words;
    const std::size_t end = std::min(line.find_first_of(kBlanks, begin), line.size());
    words.push_back(line.substr(begin, end - begin));
    line.remove_prefix(end);
  }
}

std::optional<std::size_t> parse_count(std::string_view word) {
  std::size_t value = 0;
  const auto [end, failed] = std::from_chars(word.data(), word.data() + word.size(), value);
  if (failed != std::errc() || end != word.data() + word.size()) return std::nullopt;
  return value;
}

// Reads the header of a file line by line.
class HeaderLines {
 public:
  HeaderLines(std::string_view bytes, std::string file) : bytes_(bytes), file_(std::move(file)) {}

  // Returns the words of the next line that is not empty. Throws Error at the end of the file.
  std::vector<std::string_view> next() {
    while (true) {
      const std::size_t end = bytes_.find('\n', position_);
      if (end == std::string_view::npos) fail("its header has no end");
      const std::string_view line = bytes_.substr(position_, end - position_);
      position_ = end + 1;
      if (auto words = words_of(line); !words.empty()) return words;
    }
  }
  // Returns the bytes after the lines read so far.
  std::string_view rest() const { return bytes_.substr(position_); }

  std::size_t count(std::string_view word) const {
    const auto value = parse_count(word);
    if (!value) fail(fmt::format("its header has '{}' instead of a number", word));
    return *value;
  }

  [[noreturn]] void fail(const std::string& problem) const {
    throw Error(problem, file_, "give a complete, binary little-endian PLY file");
  }

 private:
  std::string_view bytes_;
  std::size_t position_ = 0;
  std::string file_;
};

// Position of a field inside a record [bytes].
struct Field {
  std::size_t offset = 0, size = 0;
};

// Layout of the points of a file: records of fixed size, one per point.
struct RecordLayout {
  std::size_t records = 0, record_size = 0;
  std::array<std::optional<Field>, 3> position = {};  // x, y, z: float (4 bytes) or double (8)
  std::array<std::optional<Field>, 3> color = {};     // red, green, blue: one byte each
};

float coordinate(const char* record, const Field& field) {
  const char* bytes = record + field.offset;
  return field.size == sizeof(float) ? load<float>(bytes) : static_cast<float>(load<double>(bytes));
}

// Returns whether all three fields exist.
bool complete(const std::array<std::optional<Field>, 3>& fields) {
  return fields[0] && fields[1] && fields[2];
}

Cloud read_records(const HeaderLines& header, const RecordLayout& layout) {
  if (!complete(layout.position)) header.fail("its points lack x, y or z as float or double");
  const std::string_view data = header.rest();
  if (layout.records > data.size() / layout.record_size) {
    header.fail(fmt::format(
        "it is truncated: the header declares {} points of {} bytes, but {} bytes are present",
        layout.records, layout.record_size, data.size()));
  }
  const bool colored = complete(layout.color);
  Cloud cloud;
  cloud.reserve(layout.records);
  for (std::size_t i = 0; i < layout.records; ++i) {
    const char* record = data.data() + i * layout.record_size;
    const auto axis = [&](std::size_t j) { return coordinate(record, *layout.position[j]); };
    const auto channel = [&](std::size_t j) {
      return load<std::uint8_t>(record + layout.color[j]->offset);
    };
    const Eigen::Vector3f point(axis(0), axis(1), axis(2));
    if (!point.allFinite()) continue;
    cloud.add(point, colored ? Rgb{channel(0), channel(1), channel(2)} : kWhite);
  }
  return cloud;
}

void require_colors(const Cloud& cloud, const fs::path& file) {
  if (cloud.points.size() == cloud.colors.size()) return;
  throw Error(fmt::format("the cloud has {} points and {} colors", cloud.points.size(),
                          cloud.colors.size()),
              file.string(), "give every point one color");
}

// Returns the size of a PLY scalar type by its old or its sized name [bytes]; 0 for an unknown one.
std::size_t ply_size(std::string_view type) {
  struct Named {
    std::string_view name, sized_name;
    std::size_t size;
  };
  constexpr std::array<Named, 8> kTypes = {{{"char", "int8", 1},
                                            {"uchar", "uint8", 1},
                                            {"short", "int16", 2},
                                            {"ushort", "uint16", 2},
                                            {"int", "int32", 4},
                                            {"uint", "uint32", 4},
                                            {"float", "float32", 4},
                                            {"double", "float64", 8}}};
  for (const Named& type_of : kTypes) {
    if (type == type_of.name || type == type_of.sized_name) return type_of.size;
  }
  return 0;
}

// Sets the field of `fields` whose name in `names` matches.
void assign_named(std::string_view name, const std::array<std::string_view, 3>& names,
                  const Field& field, std::array<std::optional<Field>, 3>& fields) {
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (name == names[i]) fields[i] = field;
  }
}

// Adds a line `property TYPE NAME` of the element vertex.
void add_ply_property(const HeaderLines& header, const std::vector<std::string_view>& words,
                      RecordLayout& layout) {
  if (words.size() != 3) header.fail("its vertices have a property that is no plain number");
  const std::string_view type = words[1], name = words[2];
  const Field field{.offset = layout.record_size, .size = ply_size(type)};
  if (field.size == 0)
    header.fail(fmt::format("its vertices have a property of unknown type '{}'", type));
  layout.record_size += field.size;

  if (type.starts_with("float") || type == "double") {
    assign_named(name, {"x", "y", "z"}, field, layout.position);
  }
  if (type == "uchar" || type == "uint8") {
    assign_named(name, {"red", "green", "blue"}, field, layout.color);
    assign_named(name, {"diffuse_red", "diffuse_green", "diffuse_blue"}, field, layout.color);
  }
}

RecordLayout read_ply_header(HeaderLines& header) {
  if (header.next() != std::vector<std::string_view>{"ply"})
    header.fail("it does not begin with 'ply'");
  RecordLayout layout;
  bool in_vertices = false, seen_vertices = false, little_endian = false;
  for (auto words = header.next(); words[0] != "end_header"; words = header.next()) {
    if (words[0] == "format" && words.size() >= 2) {
      little_endian = words[1] == "binary_little_endian";
    } else if (words[0] == "element" && words.size() == 3) {
      in_vertices = words[1] == "vertex" && !seen_vertices;
      if (!in_vertices && !seen_vertices) header.fail("its first element is not 'vertex'");
      if (in_vertices) layout.records = header.count(words[2]);
      seen_vertices = true;
    } else if (words[0] == "property" && in_vertices) {
      add_ply_property(header, words, layout);
    }
  }
  if (!little_endian) header.fail("its format is not binary_little_endian");
  return layout;
}

}  // namespace

void write_ply(const fs::path& file, const Cloud& cloud) {
  require_colors(cloud, file);
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment Stillmap, meters\nelement vertex {}\n"
      "property float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\nend_header\n",
      cloud.size());
  ByteWriter bytes;
  bytes.reserve(header.size() + cloud.size() * (3 * sizeof(float) + sizeof(Rgb)));
  bytes.put_list(std::span(header));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    bytes.put_list(std::span<const float>(cloud.points[i].data(), 3));
    bytes.put(cloud.colors[i]);
  }
  write_file(file, bytes.bytes());
}

Cloud read_ply(const fs::path& file) {
  const std::string bytes = read_file(file, kAnySize);
  HeaderLines header(bytes, file.string());
  const RecordLayout layout = read_ply_header(header);
  return read_records(header, layout);
}

}  // namespace stillmap
