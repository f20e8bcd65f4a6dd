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

/// An array of an image.
struct NpyArray {
  char kind = 'u';        // of numbers: u and i whole ones, f floating point, or another
  std::size_t width = 2;  // of a number [bytes]
  bool big_endian = false;
  bool by_columns = false;  // Fortran's order
  cv::Size size;
  std::size_t begin = 0;  // offset of the numbers in the file

  std::size_t count() const {
    return static_cast<std::size_t>(size.width) * static_cast<std::size_t>(size.height);
  }
  std::size_t bytes() const { return count() * width; }
};

/// Returns the array that the header declares; none if it is not two-dimensional.
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
  static const std::regex kType("'descr': *'([<>|=])([a-z])([1248])'"),
      kShape(R"('shape': *\((?: *1,)? *(\d{1,6}), *(\d{1,6})(?:, *1)?,? *\))");
  std::smatch type, shape;
  if (!std::regex_search(header, type, kType) || !std::regex_search(header, shape, kShape))
    return std::nullopt;
  return NpyArray{.kind = type[2].str()[0],
                  .width = std::stoul(type[3].str()),
                  .big_endian = type[1] == ">",
                  .by_columns = header.find("'fortran_order': True") != std::string::npos,
                  .size = {std::stoi(shape[2].str()), std::stoi(shape[1].str())},
                  .begin = at + length};
}

/// Copies numbers into an image, with the first byte the lowest one.
cv::Mat numbers_of(View bytes, const NpyArray& array, int type) {
  cv::Mat image(array.by_columns ? cv::Size(array.size.height, array.size.width) : array.size,
                type);
  std::copy_n(bytes.begin() + static_cast<std::ptrdiff_t>(array.begin), array.bytes(), image.data);
  if (array.big_endian) {
    for (std::size_t i = 0; i < array.count(); ++i)
      std::reverse(image.data + i * array.width, image.data + (i + 1) * array.width);
  }
  return array.by_columns ? cv::Mat(image.t()) : image;
}

/// Returns the type of OpenCV for the numbers; none for those that no depth image has.
std::optional<int> opencv_type(const NpyArray& array) {
  const bool is_float = array.kind == 'f', is_signed = array.kind == 'i';
  if (!is_float && !is_signed && array.kind != 'u') return std::nullopt;
  switch (array.width) {
    case 2:
      return is_float ? CV_16FC1 : is_signed ? CV_16SC1 : CV_16UC1;
    case 4:
      return is_float ? CV_32FC1 : CV_32SC1;  // whole numbers up to 2^31 - 1
    case 8:
      return is_float ? std::optional(CV_64FC1) : std::nullopt;
    default:
      return std::nullopt;
  }
}

}  // namespace

bool is_npy(View bytes) {
  return bytes.size() >= kMagic.size() && std::equal(kMagic.begin(), kMagic.end(), bytes.begin());
}

HeaderRead npy_header(View bytes) {
  const auto array = declared_array(bytes);
  if (!array) return {{}, "is no array of height x width numbers"};
  if (array->size.empty()) return {{}, "is damaged: its header says 0 pixels"};
  if (array->bytes() > bytes.size() - array->begin) return {{}, "is truncated: its end is missing"};
  ImageHeader header{array->size, 8 * static_cast<int>(array->width), 1};
  if (!opencv_type(*array)) {
    header.samples = Samples::kOther;
  } else if (array->kind == 'f') {
    header.samples = Samples::kFloat;
    header.bits = 32;
  } else {
    header.bits = 16;
  }
  return {header, ""};
}

cv::Mat decode_npy(View bytes) {
  const NpyArray array = declared_array(bytes).value();
  cv::Mat image = numbers_of(bytes, array, opencv_type(array).value());
  // Whole numbers outside 0 to 65535 become the nearest of these.
  image.convertTo(image, array.kind == 'f' ? CV_32F : CV_16U);
  return image;
}

}  // namespace stillmap
