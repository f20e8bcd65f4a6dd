// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/motion_labels.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <limits>
#include <optional>
#include <string_view>

#include <fmt/format.h>

namespace stillmap {
namespace {

static_assert(std::endian::native == std::endian::little, "files are little endian");

constexpr std::string_view kHeader = "stillmap labels 1\n";
constexpr double kPixel = 8, kMeter = 1000, kLogOdds = 256, kWeight = 255;

struct PackedKeypoint {
  std::uint16_t u = 0, v = 0, depth = 0;
  std::int16_t log_odds = 0;
  std::uint8_t weight = 0, zero = 0;
};
static_assert(sizeof(PackedKeypoint) == 10);

/// Returns the value rounded to whole units and clipped to the range of Integer; 0 for NaN.
template <typename Integer>
Integer in_units(double value, double units) {
  using Limits = std::numeric_limits<Integer>;
  if (std::isnan(value)) return 0;
  return static_cast<Integer>(std::clamp(std::round(value * units),
                                         static_cast<double>(Limits::min()),
                                         static_cast<double>(Limits::max())));
}

PackedKeypoint pack(const KeypointLabel& k) {
  PackedKeypoint packed;
  packed.u = in_units<std::uint16_t>(k.u, kPixel);
  packed.v = in_units<std::uint16_t>(k.v, kPixel);
  packed.depth = in_units<std::uint16_t>(k.depth, kMeter);
  packed.log_odds = in_units<std::int16_t>(k.static_log_odds, kLogOdds);
  packed.weight = in_units<std::uint8_t>(k.weight, kWeight);
  if (!k.moving()) packed.weight = std::max<std::uint8_t>(packed.weight, 1);
  return packed;
}

KeypointLabel unpack(const PackedKeypoint& p) {
  return {static_cast<float>(p.u / kPixel), static_cast<float>(p.v / kPixel),
          static_cast<float>(p.depth / kMeter), static_cast<float>(p.log_odds / kLogOdds),
          static_cast<float>(p.weight / kWeight)};
}

template <typename T>
void append(std::string& bytes, const T& value) {
  bytes.append(reinterpret_cast<const char*>(&value), sizeof(T));
}

/// Reads values one after the other from a string of bytes.
class Reader {
 public:
  explicit Reader(std::string_view bytes) : bytes_(bytes) {}
  bool at_end() const { return bytes_.empty(); }
  template <typename T>
  std::optional<T> take() {
    if (bytes_.size() < sizeof(T)) return std::nullopt;
    T value;
    bytes_.copy(reinterpret_cast<char*>(&value), sizeof(T));
    bytes_.remove_prefix(sizeof(T));
    return value;
  }

 private:
  std::string_view bytes_;
};

std::optional<LabeledFrame> take_frame(Reader& reader) {
  const auto index = reader.take<std::uint32_t>();
  const auto timestamp = reader.take<double>();
  const auto count = reader.take<std::uint32_t>();
  if (!index || !timestamp || !count) return std::nullopt;
  LabeledFrame frame{*index, *timestamp, {}};
  for (std::uint32_t i = 0; i < *count; ++i) {
    const auto packed = reader.take<PackedKeypoint>();
    if (!packed) return std::nullopt;
    frame.keypoints.push_back(unpack(*packed));
  }
  return frame;
}

}  // namespace

LabelFile::LabelFile() : bytes_(kHeader) {}

void LabelFile::add(const LabeledFrame& frame) {
  append(bytes_, static_cast<std::uint32_t>(frame.index));
  append(bytes_, frame.timestamp);
  append(bytes_, static_cast<std::uint32_t>(frame.keypoints.size()));
  for (const KeypointLabel& keypoint : frame.keypoints) append(bytes_, pack(keypoint));
}

std::vector<LabeledFrame> read_labels(const std::filesystem::path& file) {
  const std::string bytes = read_file(file, kAnySize);
  if (!bytes.starts_with(kHeader)) {
    throw Error("is not a file of motion labels", file.string(),
                "stillmap run --save-labels writes one: labels.bin");
  }
  Reader reader(std::string_view(bytes).substr(kHeader.size()));
  std::vector<LabeledFrame> frames;
  while (!reader.at_end()) {
    auto frame = take_frame(reader);
    if (!frame) {
      throw Error(fmt::format("ends within frame number {}", frames.size() + 1), file.string(),
                  "write it again: stillmap run --save-labels");
    }
    frames.push_back(std::move(*frame));
  }
  return frames;
}

}  // namespace stillmap
