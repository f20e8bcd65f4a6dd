// SPDX-License-Identifier: Apache-2.0
// TIFF, revision 6.0 (Adobe, 1992), sections 2 and 8.
#include "stillmap/sensor/tiff_header.hpp"

#include <algorithm>
#include <cstdint>
#include <optional>

namespace stillmap {
namespace {

using View = std::span<const unsigned char>;

constexpr std::size_t kEntry = 12;  // Size of an entry of a directory [bytes].

// Numbers of the fields.
enum Field : std::uint16_t {
  kWidth = 256,
  kHeight = 257,
  kBits = 258,
  kStripOffsets = 273,
  kChannels = 277,
  kStripBytes = 279,
  kTileOffsets = 324,
  kTileBytes = 325,
  kSampleFormat = 339,
};

/// The values of a field: whole numbers of `size` bytes each.
struct Values {
  std::size_t at = 0, size = 0, count = 0;
};

/// The fields of the first image of a file.
class Directory {
 public:
  explicit Directory(View file) : file_(file), little_endian_(file[0] == 'I') {
    at_ = number(4, 4).value_or(0);
    entries_ = number(at_, 2).value_or(0);
  }

  /// Whether all entries lie within the file.
  bool complete() const {
    return at_ > 0 && entries_ > 0 && at_ + 2 + entries_ * kEntry <= file_.size();
  }

  /// Returns where the values of a field of whole numbers are; none without it.
  Values values(Field field) const {
    constexpr std::uint32_t kShort = 3, kLong = 4;
    for (std::size_t i = 0; i < entries_; ++i) {
      const std::size_t entry = at_ + 2 + i * kEntry;
      if (number(entry, 2) != field) continue;
      const std::uint32_t type = number(entry + 2, 2).value_or(0);
      if (type != kShort && type != kLong) break;
      Values values{entry + 8, type == kShort ? 2U : 4U, number(entry + 4, 4).value_or(0)};
      const bool inside_entry = values.size * values.count <= 4;
      if (!inside_entry) values.at = number(entry + 8, 4).value_or(0);
      return values;
    }
    return {};
  }

  /// Returns the i-th value; none behind the last one and behind the end of the file.
  std::optional<std::uint32_t> value(const Values& values, std::size_t i = 0) const {
    return i < values.count ? number(values.at + i * values.size, values.size) : std::nullopt;
  }

 private:
  std::optional<std::uint32_t> number(std::size_t at, std::size_t size) const {
    if (at > file_.size() || size > file_.size() - at) return std::nullopt;
    std::uint32_t value = 0;
    for (std::size_t i = 0; i < size; ++i)
      value = value << 8 | file_[at + (little_endian_ ? size - 1 - i : i)];
    return value;
  }

  View file_;
  bool little_endian_;
  std::size_t at_ = 0, entries_ = 0;
};

/// Whether the strips or tiles of the image lie within a file of so many bytes.
bool has_pixels(const Directory& directory, std::size_t bytes) {
  const bool tiled = directory.values(kTileOffsets).count > 0;
  const Values offsets = directory.values(tiled ? kTileOffsets : kStripOffsets),
               sizes = directory.values(tiled ? kTileBytes : kStripBytes);
  if (offsets.count == 0 || sizes.count != offsets.count) return false;
  for (std::size_t i = 0; i < offsets.count; ++i) {
    const auto offset = directory.value(offsets, i), size = directory.value(sizes, i);
    if (!offset || !size || std::uint64_t{*offset} + *size > bytes) return false;
  }
  return true;
}

ImageHeader header_of(const Directory& directory) {
  const auto number = [&](Field field, std::uint32_t otherwise) {
    constexpr std::uint32_t kLargest = 1 << 30;
    const auto value = directory.value(directory.values(field)).value_or(otherwise);
    return static_cast<int>(std::min(value, kLargest));
  };
  constexpr int kUnsigned = 1, kFloats = 3;
  ImageHeader header{
      {number(kWidth, 0), number(kHeight, 0)}, number(kBits, 1), number(kChannels, 1)};
  const int format = number(kSampleFormat, kUnsigned);
  if (format == kFloats)
    header.samples = Samples::kFloat;
  else if (format != kUnsigned)
    header.samples = Samples::kOther;
  return header;
}

}  // namespace

bool is_tiff(View bytes) {
  return bytes.size() >= 4 && ((bytes[0] == 'I' && bytes[1] == 'I' && bytes[2] == 42) ||
                               (bytes[0] == 'M' && bytes[1] == 'M' && bytes[3] == 42));
}

HeaderRead tiff_header(View bytes) {
  constexpr const char* kCutShort = "is truncated: its end is missing";
  const Directory directory(bytes);
  if (!directory.complete()) return {{}, kCutShort};
  const ImageHeader header = header_of(directory);
  if (header.size.empty()) return {{}, "is damaged: its header says 0 pixels"};
  return {header, has_pixels(directory, bytes.size()) ? "" : kCutShort};
}

}  // namespace stillmap
