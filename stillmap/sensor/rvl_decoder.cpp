// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/rvl_decoder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <cstdint>

#include <fmt/format.h>

namespace stillmap {
namespace {

class NumberReader {
 public:
  explicit NumberReader(ByteCursor words) : words_(words) {}

  std::uint32_t next() {
    constexpr int kBits = 32;
    std::uint32_t number = 0, nibble = 0;
    int shift = 0;
    do {
      if (shift >= kBits) throw Error("a number has more than 32 bits", "", "");
      nibble = next_nibble();
      number |= (nibble & 7U) << shift;
      shift += 3;
    } while ((nibble & 8U) != 0);
    return number;
  }

 private:
  std::uint32_t next_nibble() {
    if (left_ == 0) {
      word_ = words_.get<std::uint32_t>();
      left_ = 8;
    }
    --left_;
    return word_ >> (4 * left_) & 0xfU;
  }

  ByteCursor words_;
  std::uint32_t word_ = 0;
  std::uint32_t left_ = 0;  // nibbles of the word
};

// 0, 1, 2, 3, 4 stand for 0, -1, 1, -2, 2.
std::uint32_t difference_of(std::uint32_t zigzag) { return (zigzag >> 1) ^ (0U - (zigzag & 1U)); }

}  // namespace

ImageRead decode_rvl(ByteSpan bytes, cv::Size wanted) {
  const TraceScope scope("decode depth");
  ByteCursor cursor(bytes);
  const auto width = cursor.get<std::uint32_t>(), height = cursor.get<std::uint32_t>();
  if (width != static_cast<std::uint32_t>(wanted.width) ||
      height != static_cast<std::uint32_t>(wanted.height)) {
    return {{},
            fmt::format("is {} x {} pixels where the camera has {} x {}", width, height,
                        wanted.width, wanted.height)};
  }
  cv::Mat image(wanted, CV_16UC1);
  auto* to = image.ptr<std::uint16_t>();
  auto* const end = to + image.total();
  NumberReader numbers(cursor);
  std::uint16_t last = 0;
  while (to < end) {
    const std::uint32_t zeros = numbers.next();
    if (zeros > static_cast<std::size_t>(end - to)) return {{}, "is damaged: a run is too long"};
    to = std::fill_n(to, zeros, std::uint16_t{0});
    const std::uint32_t others = numbers.next();
    if (others > static_cast<std::size_t>(end - to)) return {{}, "is damaged: a run is too long"};
    for (auto* const run_end = to + others; to < run_end; ++to) {
      last = static_cast<std::uint16_t>(last + difference_of(numbers.next()));
      *to = last;
    }
  }
  return {image, ""};
}

}  // namespace stillmap
