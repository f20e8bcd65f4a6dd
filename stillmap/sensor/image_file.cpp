// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/image_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/image_header.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/sensor/exr_image.hpp"
#include "stillmap/sensor/jpeg_image.hpp"
#include "stillmap/sensor/npy_image.hpp"
#include "stillmap/sensor/png_decoder.hpp"
#include "stillmap/sensor/png_encoder.hpp"
#include "stillmap/sensor/tiff_image.hpp"

#include <algorithm>
#include <array>
#include <fstream>
#include <vector>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using Bytes = std::vector<unsigned char>;
using View = std::span<const unsigned char>;

constexpr std::size_t kPngEnd = 12;  // Size of the empty chunk IEND [bytes].
// Bytes that contain a PNG's header and usually the start of a JPEG.
constexpr std::size_t kHeadBytes = 256;

bool is_named(View chunk_name, const char* name) {
  return std::equal(chunk_name.begin(), chunk_name.end(), name);
}

HeaderRead parse_header(View bytes) {
  if (bytes.empty()) return {{}, "is empty"};
  if (is_tiff(bytes)) return tiff_header(bytes);
  if (is_npy(bytes)) return npy_header(bytes);
  if (is_exr(bytes)) return exr_header(bytes);
  if (!is_png(bytes) && !is_jpeg(bytes)) return {{}, "is not a PNG, JPEG, TIFF, NPY or EXR image"};
  const auto header = encoded_header(bytes);
  if (!header) return {{}, "is truncated or damaged: it has no image header"};
  const cv::Size size(header->width, header->height);
  if (size.empty()) return {{}, "is damaged: its header says 0 pixels"};
  return {{.size = size, .bits = header->bits, .channels = header->channels}, ""};
}

// Whether the header functions of the format need the whole file and check that it is complete.
bool has_header_of_all(View head) { return is_tiff(head) || is_npy(head) || is_exr(head); }

// Returns whether the end mark exists, if the kind of file has one. Some cameras pad a JPEG after
// it, so the last bytes are searched.
bool is_complete(View head, View tail) {
  if (has_header_of_all(head)) return true;
  if (is_png(head)) {
    return tail.size() >= kPngEnd && is_named(tail.last(8).first(4), "IEND");
  }
  constexpr std::array<unsigned char, 2> end{0xff, 0xd9};
  return std::search(tail.begin(), tail.end(), end.begin(), end.end()) != tail.end();
}

/// Larger files are no images of a camera [bytes].
constexpr std::size_t kLargestFile = std::size_t{256} << 20;

std::string too_large(std::size_t bytes) {
  return fmt::format("has {} MB, more than an image of a camera", bytes >> 20);
}

constexpr const char* kCutShort = "is truncated: its end is missing";

struct OpenFile {
  std::ifstream stream;
  std::size_t bytes = 0;
  std::string problem;
};

OpenFile open(const fs::path& file) {
  std::error_code ignored;
  if (!fs::exists(file, ignored)) return {{}, 0, "is missing"};
  if (!fs::is_regular_file(file, ignored)) return {{}, 0, "is not a file"};
  OpenFile opened{std::ifstream(file, std::ios::binary), fs::file_size(file, ignored), ""};
  if (!opened.stream) opened.problem = "cannot be read: check its permissions";
  return opened;
}

Bytes read_at(std::ifstream& stream, std::size_t at, std::size_t count) {
  Bytes bytes(count);
  stream.clear();
  stream.seekg(static_cast<std::streamoff>(at));
  stream.read(reinterpret_cast<char*>(bytes.data()), static_cast<std::streamsize>(count));
  bytes.resize(static_cast<std::size_t>(std::max<std::streamsize>(0, stream.gcount())));
  return bytes;
}

struct Loaded {
  Bytes bytes;
  std::string problem;
};

Loaded load(const fs::path& file) {
  const TraceScope scope("read file");
  OpenFile opened = open(file);
  if (!opened.problem.empty()) return {{}, opened.problem};
  if (opened.bytes > kLargestFile) return {{}, too_large(opened.bytes)};
  return {read_at(opened.stream, 0, opened.bytes), ""};
}

/// Decodes the pixels as they are stored; colors as BGR, or BGRA.
ImageRead decode(View bytes) {
  cv::Mat image;
  if (is_png(bytes)) {
    if (const std::string damage = png_damage(bytes); !damage.empty()) return {{}, damage};
    image = decode_png(bytes);
  } else if (is_tiff(bytes)) {
    image = decode_tiff(bytes);
  } else if (is_npy(bytes)) {
    image = decode_npy(bytes);
  } else if (is_exr(bytes)) {
    image = decode_exr(bytes);
  } else {
    auto [pixels, problem] = decode_jpeg(bytes);
    return {pixels, problem};
  }
  if (image.empty()) return {{}, "cannot be decoded: it is damaged"};
  return {image, ""};
}

/// Returns an image in color, without alpha.
cv::Mat in_color(cv::Mat image) {
  if (image.type() == CV_8UC2) cv::extractChannel(image, image, 0);
  if (image.type() == CV_8UC1) cv::cvtColor(image, image, cv::COLOR_GRAY2BGR);
  if (image.type() == CV_8UC4) cv::cvtColor(image, image, cv::COLOR_BGRA2BGR);
  return image;
}

}  // namespace

HeaderRead read_image_header(const fs::path& file) {
  OpenFile opened = open(file);
  if (!opened.problem.empty()) return {{}, opened.problem};
  if (opened.bytes > kLargestFile) return {{}, too_large(opened.bytes)};
  const Bytes head = read_at(opened.stream, 0, std::min(kHeadBytes, opened.bytes));
  HeaderRead read = parse_header(head);
  // A JPEG with a long comment or thumbnail, or a TIFF, whose header may be anywhere.
  if (!read.problem.empty() && (is_jpeg(head) || has_header_of_all(head)))
    read = parse_header(read_at(opened.stream, 0, opened.bytes));
  if (!read.problem.empty()) return read;
  const std::size_t tail = std::min(kHeadBytes, opened.bytes);
  if (!is_complete(head, read_at(opened.stream, opened.bytes - tail, tail)))
    read.problem = kCutShort;
  return read;
}

std::string color_problem(const ImageHeader& header) {
  if (header.bits <= 8) return "";
  return fmt::format("has {} bits per channel where a color image has 8", header.bits);
}

std::string depth_problem(const ImageHeader& header) {
  const bool raw = header.bits == 16 && header.samples == Samples::kUnsigned;
  const bool meters = header.bits == 32 && header.samples == Samples::kFloat;
  if (header.channels == 1 && (raw || meters)) return "";
  const char* kinds[] = {"", " (floats)", " (signed)"};
  return fmt::format(
      "has {} channel{} of {} bits{} where a depth image has one of 16 or, as TIFF, of 32-bit "
      "floats",
      header.channels, header.channels == 1 ? "" : "s", header.bits,
      kinds[static_cast<int>(header.samples)]);
}

std::string size_problem(const ImageHeader& header, cv::Size wanted) {
  if (header.size == wanted) return "";
  return fmt::format("is {} x {} pixels where the camera has {} x {}", header.size.width,
                     header.size.height, wanted.width, wanted.height);
}

HeaderRead decode_image_header(View bytes) {
  HeaderRead read = parse_header(bytes);
  if (read.problem.empty() && !is_complete(bytes, bytes.last(std::min(kHeadBytes, bytes.size()))))
    read.problem = kCutShort;
  return read;
}

ImageRead decode_color_image(View bytes, cv::Size wanted) {
  auto [header, problem] = decode_image_header(bytes);
  if (problem.empty()) problem = color_problem(header);
  if (problem.empty()) problem = size_problem(header, wanted);
  if (!problem.empty()) return {{}, problem};
  const TraceScope scope("decode color");
  ImageRead read = decode(bytes);
  if (!read.problem.empty()) return read;
  read.image = in_color(read.image);
  return read;
}

ImageRead decode_depth_image(View bytes, cv::Size wanted) {
  auto [header, problem] = decode_image_header(bytes);
  if (problem.empty()) problem = depth_problem(header);
  if (problem.empty()) problem = size_problem(header, wanted);
  if (!problem.empty()) return {{}, problem};
  const TraceScope scope("decode depth");
  return decode(bytes);
}

ImageRead read_color_image(const fs::path& file, cv::Size wanted) {
  const Loaded loaded = load(file);
  if (!loaded.problem.empty()) return {{}, loaded.problem};
  return decode_color_image(loaded.bytes, wanted);
}

ImageRead read_depth_image(const fs::path& file, cv::Size wanted) {
  const Loaded loaded = load(file);
  if (!loaded.problem.empty()) return {{}, loaded.problem};
  return decode_depth_image(loaded.bytes, wanted);
}

ImageRead read_stored_image(const fs::path& file) {
  const Loaded loaded = load(file);
  if (!loaded.problem.empty()) return {{}, loaded.problem};
  const auto [header, problem] = decode_image_header(loaded.bytes);
  if (!problem.empty()) return {{}, problem};
  return decode(loaded.bytes);
}

void write_png(const fs::path& file, const cv::Mat& image) { write_file(file, encode_png(image)); }

}  // namespace stillmap
