// SPDX-License-Identifier: Apache-2.0
// NumPy Enhancement Proposal 1, "A simple file format for NumPy arrays", and its versions 2 and 3.
#include "stillmap/sensor/npy_image.hpp"

#include <algorithm>
#include <array>
#include <optional>
#include <regex>
#include <string>

namespace stillmap {
namespace {

using View = std::span<const unsigned char>;

constexpr std::array<unsigned char, 6> kMagic{0x93, 'N', 'U', 'M', 'P', 'Y'};
constexpr std::size_t kPreamble =
    12;  // Magic, version and length of the header, version 2 [bytes].

/// A little-endian, row-major array.
struct NpyArray {
  std::string type;  // "u2", "f4", "f8" or another
  cv::Size size;
  std::size_t begin = 0;  // offset of the numbers in the file

  std::size_t bytes() const {
    const auto width = static_cast<std::size_t>(size.width);
    return width * static_cast<std::size_t>(size.height) * static_cast<std::size_t>(type[1] - '0');
  }
};

/// Returns the array that the header declares; none if it is not two-dimensional and row-major.
std::optional<NpyArray> declared_array(View file) {
  if (file.size() < kPreamble) return std::nullopt;
  const bool long_length = file[6] > 1;
  std::size_t length = file[8] | std::size_t{file[9]} << 8;
  if (long_length) length |= std::size_t{file[10]} << 16 | std::size_t{file[11]} << 24;
  const std::size_t at = long_length ? kPreamble : kPreamble - 2;
  constexpr std::size_t kLongest = 1024;  // Length of a header; those of images have 118 [bytes].
  if (length > kLongest || length > file.size() - at) return std::nullopt;
  const std::string header(file.begin() + static_cast<std::ptrdiff_t>(at),
                           file.begin() + static_cast<std::ptrdiff_t>(at + length));
  static const std::regex kType("'descr': *'[<|]([a-z][1-8])'"),
      kShape(R"('shape': *\( *(\d{1,6}), *(\d{1,6})(?:, *1)?,? *\))");
  std::smatch type, shape;
  if (header.find("'fortran_order': False") == std::string::npos ||
      !std::regex_search(header, type, kType) || !std::regex_search(header, shape, kShape))
    return std::nullopt;
  return NpyArray{
      type[1].str(), {std::stoi(shape[2].str()), std::stoi(shape[1].str())}, at + length};
}

}  // namespace

bool is_npy(View bytes) {
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

HeaderRead npy_header(View bytes) {
  const auto array = declared_array(bytes);
  if (!array) return {{}, "is no array of height x width numbers, row-major and little-endian"};
  if (array->size.empty()) return {{}, "is damaged: its header says 0 pixels"};
  if (array->bytes() > bytes.size() - array->begin) return {{}, "is truncated: its end is missing"};
  ImageHeader header{array->size, 8 * (array->type[1] - '0'), 1};
  if (array->type[0] == 'f') {
    header.samples = Samples::kFloat;
    if (header.bits == 64) header.bits = 32;
  } else if (array->type[0] != 'u') {
    header.samples = Samples::kOther;
  }
  return {header, ""};
}

cv::Mat decode_npy(View bytes) {
  const NpyArray array = declared_array(bytes).value();
  int type = CV_16UC1;
  if (array.type == "f4") type = CV_32FC1;
  if (array.type == "f8") type = CV_64FC1;
  cv::Mat image(array.size, type);
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(array.begin), array.bytes(), image.data);
  if (type == CV_64FC1) image.convertTo(image, CV_32F);
  return image;
}

}  // namespace stillmap
