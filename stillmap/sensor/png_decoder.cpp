// Follows the PNG specification (W3C, 2nd edition, 2003); numbers are its sections.
#include "stillmap/sensor/png_decoder.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <libdeflate.h>
#include <memory>
#include <optional>
#include <png.h>

#include <opencv2/core/hal/intrin.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using View = std::span<const unsigned char>;

constexpr std::size_t kSignature = 8;  // bytes
constexpr std::size_t kReadAhead = 8;  // Bytes that vector loads may read behind the last pixel.

std::uint32_t big_endian(View bytes) {
  return std::uint32_t{bytes[0]} << 24 | std::uint32_t{bytes[1]} << 16 |
         std::uint32_t{bytes[2]} << 8 | std::uint32_t{bytes[3]};
}

// One chunk: length, name, data, checksum of name and data (5.3).
struct Chunk {
  View name, data, name_and_data;
  std::uint32_t checksum = 0;

  bool is(const char* wanted) const { return std::memcmp(name.data(), wanted, 4) == 0; }
};

std::optional<Chunk> chunk_at(View bytes, std::size_t at) {
  constexpr std::size_t kFrame = 12;  // Bytes around the data of a chunk.
  if (at > bytes.size() || bytes.size() - at < kFrame) return std::nullopt;
  const std::size_t length = big_endian(bytes.subspan(at, 4));
  if (bytes.size() - at - kFrame < length) return std::nullopt;
  return Chunk{bytes.subspan(at + 4, 4), bytes.subspan(at + 8, length),
               bytes.subspan(at + 4, length + 4), big_endian(bytes.subspan(at + 8 + length, 4))};
}

std::size_t behind(const Chunk& chunk, std::size_t at) { return at + 12 + chunk.data.size(); }

struct Header {  // 11.2.2
  int width = 0, height = 0, bits = 0, color_type = 0;
  bool interlaced = false;

  int channels() const { return color_type == 0 ? 1 : color_type == 2 ? 3 : 4; }
  bool common() const {
    const bool camera_like = bits == 8 ? color_type == 0 || color_type == 2 || color_type == 6
                                       : bits == 16 && color_type == 0;
    return camera_like && !interlaced;
  }
  std::size_t pixel_bytes() const { return static_cast<std::size_t>(channels() * bits / 8); }
  std::size_t row_bytes() const { return static_cast<std::size_t>(width) * pixel_bytes(); }
};

Header header_of(View bytes) {
  const View data = bytes.subspan(kSignature + 8, 13);
  return {static_cast<int>(big_endian(data)), static_cast<int>(big_endian(data.subspan(4))),
          data[8], data[9], data[12] != 0};
}

// Returns the compressed pixels: the data of all IDAT chunks in sequence (11.2.4).
std::vector<unsigned char> compressed_pixels(View bytes) {
  std::vector<unsigned char> joined;
  joined.reserve(bytes.size());
  std::size_t at = kSignature;
  while (const auto chunk = chunk_at(bytes, at)) {
    if (chunk->is("IDAT")) joined.insert(joined.end(), chunk->data.begin(), chunk->data.end());
    at = behind(*chunk, at);
  }
  return joined;
}

bool inflate(View compressed, std::span<unsigned char> out) {
  const TraceScope scope("inflate");
  const std::unique_ptr<libdeflate_decompressor, decltype(&libdeflate_free_decompressor)>
      decompressor(libdeflate_alloc_decompressor(), &libdeflate_free_decompressor);
  return decompressor &&
         libdeflate_zlib_decompress(decompressor.get(), compressed.data(), compressed.size(),
                                    out.data(), out.size(), nullptr) == LIBDEFLATE_SUCCESS;
}

// ---- row filters (9.2): each reverts the encoding of one row in place. Names as in the
// specification: x this byte, a the pixel to the left, b above, c above left.

void undo_up(unsigned char* row, const unsigned char* above, std::size_t bytes) {
  for (std::size_t i = 0; i < bytes; ++i) row[i] = static_cast<unsigned char>(row[i] + above[i]);
}

// One pixel's bytes in the low 16-bit lanes, and back; the other lanes are never used.
cv::v_int16x8 load_pixel(const unsigned char* from) {
  return cv::v_reinterpret_as_s16(cv::v_load_expand(from));
}

template <std::size_t Pixel>
void store_pixel(unsigned char* to, const cv::v_int16x8& lanes) {
  const cv::v_uint8x16 packed = cv::v_pack_u(lanes, lanes);
  const std::uint32_t low = cv::v_reinterpret_as_u32(packed).get0();
  std::memcpy(to, &low, Pixel);
}

template <std::size_t Pixel>
void undo_sub(unsigned char* row, std::size_t bytes) {
  cv::v_uint8x16 a = cv::v_setzero_u8();
  for (std::size_t i = 0; i < bytes; i += Pixel) {
    a = cv::v_add_wrap(a, cv::v_load_low(row + i));
    const std::uint32_t low = cv::v_reinterpret_as_u32(a).get0();
    std::memcpy(row + i, &low, Pixel);
  }
}

enum Filter { kNoFilter, kSub, kUp, kAverage, kPaeth };

/// What a filter predicts of x (9.3, 9.4).
template <Filter kFilter>
cv::v_int16x8 predicted(const cv::v_int16x8& a, const cv::v_int16x8& b, const cv::v_int16x8& c) {
  if constexpr (kFilter == kAverage) return cv::v_shr<1>(a + b);
  // Distances of the estimate a + b - c to a, b and c; the nearest of the three predicts x.
  const cv::v_int16x8 to_a = b - c, to_b = a - c, to_c = to_a + to_b;
  const cv::v_int16x8 pa = cv::v_max(to_a, c - b), pb = cv::v_max(to_b, c - a);
  const cv::v_int16x8 pc = cv::v_max(to_c, cv::v_setzero_s16() - to_c);
  const cv::v_int16x8 least = cv::v_min(pc, cv::v_min(pa, pb));
  return cv::v_select(pa == least, a, cv::v_select(pb == least, b, c));
}

/// A row whose pixels each depend on the one before.
template <std::size_t Pixel, Filter kFilter>
struct SlowRow {
  unsigned char* next;
  cv::v_int16x8 a = cv::v_setzero_s16(), c = cv::v_setzero_s16();

  void step(const cv::v_int16x8& b) {
    a = (load_pixel(next) + predicted<kFilter>(a, b, c)) & cv::v_setall_s16(255);
    c = b;
    store_pixel<Pixel>(next, a);
    next += Pixel;
  }
};

template <std::size_t Pixel, Filter kFilter>
void undo_slow(unsigned char* row, const unsigned char* above, std::size_t bytes) {
  SlowRow<Pixel, kFilter> undone{row};
  for (std::size_t i = 0; i < bytes; i += Pixel) undone.step(load_pixel(above + i));
}

/// Two rows at once, the lower one a pixel behind: a processor has time for another pixel while it
/// computes one.
template <std::size_t Pixel, Filter kFilter, Filter kBelow>
void undo_two(unsigned char* row, const unsigned char* above, std::size_t bytes) {
  SlowRow<Pixel, kFilter> first{row};
  SlowRow<Pixel, kBelow> second{row + bytes + 1};
  first.step(load_pixel(above));
  for (std::size_t i = Pixel; i < bytes; i += Pixel) {
    const cv::v_int16x8 between = first.a;
    first.step(load_pixel(above + i));
    second.step(between);
  }
  second.step(first.a);
}

bool is_slow(int filter) { return filter == kAverage || filter == kPaeth; }

template <std::size_t Pixel>
void undo_two(unsigned char* row, const unsigned char* above, std::size_t bytes) {
  const bool average = row[-1] == kAverage;
  if (row[bytes] == kAverage) {
    average ? undo_two<Pixel, kAverage, kAverage>(row, above, bytes)
            : undo_two<Pixel, kPaeth, kAverage>(row, above, bytes);
  } else {
    average ? undo_two<Pixel, kAverage, kPaeth>(row, above, bytes)
            : undo_two<Pixel, kPaeth, kPaeth>(row, above, bytes);
  }
}

template <std::size_t Pixel>
bool undo_filter(int filter, unsigned char* row, const unsigned char* above, std::size_t bytes) {
  switch (filter) {
    case kNoFilter:
      return true;
    case kSub:
      undo_sub<Pixel>(row, bytes);
      return true;
    case kUp:
      undo_up(row, above, bytes);
      return true;
    case kAverage:
      undo_slow<Pixel, kAverage>(row, above, bytes);
      return true;
    case kPaeth:
      undo_slow<Pixel, kPaeth>(row, above, bytes);
      return true;
    default:
      return false;
  }
}

// Each row is preceded by a byte that names its filter (7.2).
template <std::size_t Pixel>
bool undo_filters(const Header& header, unsigned char* rows) {
  const std::size_t bytes = header.row_bytes();
  const std::vector<unsigned char> nothing(bytes + kReadAhead);
  const unsigned char* above = nothing.data();
  for (int y = 0; y < header.height; ++y) {
    unsigned char* row = rows + static_cast<std::size_t>(y) * (bytes + 1) + 1;
    if (is_slow(row[-1]) && y + 1 < header.height && is_slow(row[bytes])) {
      undo_two<Pixel>(row, above, bytes);
      row += bytes + 1;
      ++y;
    } else if (!undo_filter<Pixel>(row[-1], row, above, bytes)) {
      return false;
    }
    above = row;
  }
  return true;
}

bool undo_filters(const Header& header, unsigned char* rows) {
  switch (header.pixel_bytes()) {
    case 1:
      return undo_filters<1>(header, rows);
    case 2:
      return undo_filters<2>(header, rows);
    case 3:
      return undo_filters<3>(header, rows);
    default:
      return undo_filters<4>(header, rows);
  }
}

// Converts from PNG order (red first; high byte first) to OpenCV's.
cv::Mat as_opencv(const Header& header, unsigned char* rows) {
  cv::Mat image;
  const std::size_t step = header.row_bytes() + 1;
  const cv::Mat stored(header.height, header.width,
                       CV_MAKETYPE(CV_8U, static_cast<int>(header.pixel_bytes())), rows + 1, step);
  if (header.bits == 8) {
    if (header.channels() == 1) stored.copyTo(image);
    if (header.channels() == 3) cv::cvtColor(stored, image, cv::COLOR_RGB2BGR);
    if (header.channels() == 4) cv::cvtColor(stored, image, cv::COLOR_RGBA2BGRA);
    return image;
  }
  image.create(header.height, header.width, CV_16UC1);
  for (int y = 0; y < header.height; ++y) {
    const unsigned char* from = stored.ptr(y);
    auto* to = image.ptr<std::uint16_t>(y);
    for (int x = 0; x < header.width; ++x) {
      to[x] = static_cast<std::uint16_t>(from[2 * x] << 8 | from[2 * x + 1]);
    }
  }
  return image;
}

// For the rarer kinds: palettes, interlaced rows, fewer than 8 bits, gray with alpha, colors of 16.
cv::Mat decode_by_libpng(View bytes) {
  png_image png{};
  png.version = PNG_IMAGE_VERSION;
  if (png_image_begin_read_from_memory(&png, bytes.data(), bytes.size()) == 0) return {};
  const bool wide = (png.format & PNG_FORMAT_FLAG_LINEAR) != 0;
  const bool colored = (png.format & PNG_FORMAT_FLAG_COLOR) != 0;
  const bool alpha = (png.format & PNG_FORMAT_FLAG_ALPHA) != 0;
  png.format &= ~PNG_FORMAT_FLAG_COLORMAP;
  if (colored) png.format |= PNG_FORMAT_FLAG_BGR;
  cv::Mat image(static_cast<int>(png.height), static_cast<int>(png.width),
                CV_MAKETYPE(wide ? CV_16U : CV_8U, (colored ? 3 : 1) + (alpha ? 1 : 0)));
  return png_image_finish_read(&png, nullptr, image.data, 0, nullptr) == 0 ? cv::Mat() : image;
}

}  // namespace

std::string png_damage(View bytes) {
  const TraceScope scope("checksums");
  std::size_t at = kSignature;
  while (const auto chunk = chunk_at(bytes, at)) {
    const View checked = chunk->name_and_data;
    if (libdeflate_crc32(0, checked.data(), checked.size()) != chunk->checksum) {
      return "is damaged: a checksum is wrong";
    }
    if (chunk->is("IEND")) return "";
    at = behind(*chunk, at);
  }
  return "is truncated: its end is missing";
}

cv::Mat decode_png(View bytes) {
  const TraceScope scope("PNG");
  const Header header = header_of(bytes);
  if (!header.common()) return decode_by_libpng(bytes);
  const std::size_t size = static_cast<std::size_t>(header.height) * (header.row_bytes() + 1);
  const auto rows = std::make_unique_for_overwrite<unsigned char[]>(size + kReadAhead);
  if (!inflate(compressed_pixels(bytes), {rows.get(), size})) return {};
  if (!undo_filters(header, rows.get())) return {};
  return as_opencv(header, rows.get());
}

}  // namespace stillmap
