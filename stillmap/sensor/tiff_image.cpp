// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/tiff_image.hpp"

#include <algorithm>
#include <cstdint>
#include <cstring>
#include <memory>
#include <tiffio.h>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using View = std::span<const unsigned char>;

constexpr const char* kCutShort = "is truncated: its end is missing";
constexpr std::uint16_t kUpright = ORIENTATION_TOPLEFT;

/// A file in memory, for libtiff.
class TiffFile {
 public:
  explicit TiffFile(View bytes) : bytes_(bytes) {
    TIFFOpenOptions* options = TIFFOpenOptionsAlloc();
    TIFFOpenOptionsSetErrorHandlerExtR(options, say_nothing, nullptr);
    TIFFOpenOptionsSetWarningHandlerExtR(options, say_nothing, nullptr);
    tiff_ = TIFFClientOpenExt("", "rm", this, read, write, seek, close, size, map, unmap, options);
    TIFFOpenOptionsFree(options);
  }
  TiffFile(const TiffFile&) = delete;
  TiffFile& operator=(const TiffFile&) = delete;
  ~TiffFile() {
    if (tiff_ != nullptr) TIFFClose(tiff_);
  }

  /// Null if the file has no readable directory.
  TIFF* get() const { return tiff_; }

  template <typename T>
  T field(ttag_t tag) const {
    T value{};
    TIFFGetFieldDefaulted(tiff_, tag, &value);
    return value;
  }

 private:
  static TiffFile& self(thandle_t handle) { return *static_cast<TiffFile*>(handle); }
  static int say_nothing(TIFF*, void*, const char*, const char*, va_list) { return 1; }
  static tmsize_t read(thandle_t handle, void* to, tmsize_t wanted) {
    TiffFile& file = self(handle);
    const std::size_t left = file.bytes_.size() - std::min(file.at_, file.bytes_.size());
    const std::size_t count = std::min(left, static_cast<std::size_t>(wanted));
    if (count > 0) std::memcpy(to, file.bytes_.data() + file.at_, count);
    file.at_ += count;
    return static_cast<tmsize_t>(count);
  }
  static tmsize_t write(thandle_t, void*, tmsize_t) { return 0; }
  static toff_t seek(thandle_t handle, toff_t offset, int from) {
    TiffFile& file = self(handle);
    const std::size_t base = from == SEEK_CUR   ? file.at_
                             : from == SEEK_END ? file.bytes_.size()
                                                : 0;
    return file.at_ = base + offset;
  }
  static int close(thandle_t) { return 0; }
  static toff_t size(thandle_t handle) { return self(handle).bytes_.size(); }
  static int map(thandle_t, void**, toff_t*) { return 0; }
  static void unmap(thandle_t, void*, toff_t) {}

  View bytes_;
  std::size_t at_ = 0;
  TIFF* tiff_ = nullptr;
};

/// Whether the strips or tiles of the image lie within a file of so many bytes.
bool has_pixels(TIFF* tiff, std::size_t bytes) {
  const std::uint32_t parts =
      TIFFIsTiled(tiff) != 0 ? TIFFNumberOfTiles(tiff) : TIFFNumberOfStrips(tiff);
  if (parts == 0 || parts > bytes) return false;
  for (std::uint32_t i = 0; i < parts; ++i) {
    const std::uint64_t offset = TIFFGetStrileOffset(tiff, i);
    const std::uint64_t size = TIFFGetStrileByteCount(tiff, i);
    if (offset == 0 || size == 0 || offset > bytes || size > bytes - offset) return false;
  }
  return true;
}

Samples samples_of(const TiffFile& file) {
  switch (file.field<std::uint16_t>(TIFFTAG_SAMPLEFORMAT)) {
    case SAMPLEFORMAT_UINT:
      return Samples::kUnsigned;
    case SAMPLEFORMAT_IEEEFP:
      return Samples::kFloat;
    default:
      return Samples::kOther;
  }
}

ImageHeader header_of(const TiffFile& file) {
  const auto length = [&](ttag_t tag) {
    constexpr std::uint32_t kLargest = 1 << 30;
    return static_cast<int>(std::min(file.field<std::uint32_t>(tag), kLargest));
  };
  return {.size = {length(TIFFTAG_IMAGEWIDTH), length(TIFFTAG_IMAGELENGTH)},
          .bits = file.field<std::uint16_t>(TIFFTAG_BITSPERSAMPLE),
          .channels = file.field<std::uint16_t>(TIFFTAG_SAMPLESPERPIXEL),
          .samples = samples_of(file)};
}

/// Returns the type of a channel that is decoded as it is stored; -1 if it is not.
int stored_type(const TiffFile& file, const ImageHeader& header) {
  const auto colors = file.field<std::uint16_t>(TIFFTAG_PHOTOMETRIC);
  if (header.channels != 1 || colors > PHOTOMETRIC_MINISBLACK) return -1;
  const bool whole = header.samples == Samples::kUnsigned;
  if (header.bits == 8 && whole) return CV_8UC1;
  if (header.bits == 16 && whole) return CV_16UC1;
  return header.bits == 32 && header.samples == Samples::kFloat ? CV_32FC1 : -1;
}

bool read_rows(TIFF* tiff, cv::Mat& image) {
  const std::size_t bytes = image.cols * image.elemSize();
  if (TIFFScanlineSize64(tiff) != bytes) return false;
  for (int y = 0; y < image.rows; ++y)
    if (TIFFReadScanline(tiff, image.ptr(y), static_cast<std::uint32_t>(y)) != 1) return false;
  return true;
}

bool read_tiles(const TiffFile& file, cv::Mat& image) {
  const auto width = file.field<std::uint32_t>(TIFFTAG_TILEWIDTH),
             height = file.field<std::uint32_t>(TIFFTAG_TILELENGTH);
  const std::size_t bytes = std::size_t{width} * height * image.elemSize();
  constexpr std::uint32_t kLargest = 1 << 14;
  if (std::max(width, height) > kLargest || TIFFTileSize64(file.get()) != bytes) return false;
  cv::Mat tile(static_cast<int>(height), static_cast<int>(width), image.type());
  for (int y = 0; y < image.rows; y += tile.rows) {
    for (int x = 0; x < image.cols; x += tile.cols) {
      const auto at = [](int pixel) { return static_cast<std::uint32_t>(pixel); };
      if (TIFFReadTile(file.get(), tile.data, at(x), at(y), 0, 0) < 0) return false;
      const cv::Rect part = cv::Rect(x, y, tile.cols, tile.rows) & cv::Rect({}, image.size());
      tile(cv::Rect({}, part.size())).copyTo(image(part));
    }
  }
  return true;
}

cv::Mat decode_color(const TiffFile& file, cv::Size size) {
  cv::Mat image(size, CV_8UC4);
  if (TIFFReadRGBAImageOriented(file.get(), static_cast<std::uint32_t>(size.width),
                                static_cast<std::uint32_t>(size.height),
                                reinterpret_cast<std::uint32_t*>(image.data), kUpright, 1) != 1)
    return {};
  cv::cvtColor(image, image, cv::COLOR_RGBA2BGR);
  return image;
}

}  // namespace

bool is_tiff(View bytes) {
  return bytes.size() >= 4 && ((bytes[0] == 'I' && bytes[1] == 'I' && bytes[2] == 42) ||
                               (bytes[0] == 'M' && bytes[1] == 'M' && bytes[3] == 42));
}

HeaderRead tiff_header(View bytes) {
  const TiffFile file(bytes);
  if (file.get() == nullptr) return {{}, kCutShort};
  const ImageHeader header = header_of(file);
  if (header.size.empty()) return {{}, "is damaged: its header says 0 pixels"};
  if (!has_pixels(file.get(), bytes.size())) return {header, kCutShort};
  if (file.field<std::uint16_t>(TIFFTAG_ORIENTATION) != kUpright)
    return {header, "is turned by its orientation: store it upright"};
  return {header, ""};
}

cv::Mat decode_tiff(View bytes) {
  const TiffFile file(bytes);
  const ImageHeader header = header_of(file);
  const int type = stored_type(file, header);
  if (type < 0) return decode_color(file, header.size);
  cv::Mat image(header.size, type);
  const bool decoded =
      TIFFIsTiled(file.get()) != 0 ? read_tiles(file, image) : read_rows(file.get(), image);
  return decoded ? image : cv::Mat();
}

}  // namespace stillmap
