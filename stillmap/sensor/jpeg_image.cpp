// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/jpeg_image.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <csetjmp>
#include <cstdio>  // jpeglib.h wants it before itself
#include <cstdlib>
#include <jerror.h>
#include <jpeglib.h>
#include <memory>
#include <stdexcept>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr const char* kUndecodable = "cannot be decoded: it is damaged";

/// Error handler of libjpeg.
struct ErrorManager {
  jpeg_error_mgr base;  // First member: libjpeg sees only this.
  std::jmp_buf back;
  bool damaged;
};

// An exception must not pass through libjpeg's C code, so longjmp is used as its authors intend.
// NOLINTBEGIN(modernize-avoid-setjmp-longjmp)
[[noreturn]] void jump_back(j_common_ptr decoder) {
  std::longjmp(reinterpret_cast<ErrorManager*>(decoder->err)->back, 1);
}

/// Number of bytes allowed after the last pixel: some cameras append a few; more belong to damaged
/// pixels.
constexpr int kStrayBytes = 8;

void note_damage(j_common_ptr decoder, int level) {
  constexpr int kWarning = -1;
  if (level != kWarning) return;
  bool& damaged = reinterpret_cast<ErrorManager*>(decoder->err)->damaged;
  switch (decoder->err->msg_code) {
    case JWRN_HIT_MARKER:     // The data of an image or interval ends too early.
    case JWRN_HUFF_BAD_CODE:  // An invalid code.
    case JWRN_MUST_RESYNC:    // An interval is missing.
    case JWRN_JPEG_EOF:
    case JWRN_BOGUS_PROGRESSION:
      damaged = true;
      break;
    case JWRN_EXTRANEOUS_DATA:
      damaged = damaged || decoder->err->msg_parm.i[0] >= kStrayBytes;
      break;
    default:  // For example an unknown header version, which is harmless.
      break;
  }
}

void say_nothing(j_common_ptr /*decoder*/) {}

/// Decodes into a new image. Returns false if libjpeg fails. Creates no object with a destructor,
/// which a longjmp would skip.
bool decode_rows(jpeg_decompress_struct& decoder, ErrorManager& errors,
                 std::span<const unsigned char> bytes, cv::Mat& image) {
  if (setjmp(errors.back) != 0) return false;
  jpeg_create_decompress(&decoder);
  jpeg_mem_src(&decoder, bytes.data(), bytes.size());
  jpeg_read_header(&decoder, TRUE);
  decoder.out_color_space = JCS_RGB;
  jpeg_start_decompress(&decoder);
  image.create(static_cast<int>(decoder.output_height), static_cast<int>(decoder.output_width),
               CV_8UC3);
  while (decoder.output_scanline < decoder.output_height) {
    JSAMPROW row = image.ptr(static_cast<int>(decoder.output_scanline));
    jpeg_read_scanlines(&decoder, &row, 1);
  }
  jpeg_finish_decompress(&decoder);
  return true;
}
// NOLINTEND(modernize-avoid-setjmp-longjmp)

cv::Mat in_rgb(const cv::Mat& bgr) {
  cv::Mat rgb;
  cv::cvtColor(bgr, rgb, cv::COLOR_BGR2RGB);
  return rgb;
}

}  // namespace

JpegRead decode_jpeg(std::span<const unsigned char> bytes) {
  ErrorManager errors{};
  jpeg_decompress_struct decoder{};
  decoder.err = jpeg_std_error(&errors.base);
  errors.base.error_exit = jump_back;
  errors.base.emit_message = note_damage;
  errors.base.output_message = say_nothing;
  cv::Mat image;
  const bool decoded = decode_rows(decoder, errors, bytes, image);
  const bool four_colors = decoder.num_components == 4;
  jpeg_destroy_decompress(&decoder);
  if (four_colors) return {{}, "has the four colors of printers (CMYK): store it as RGB"};
  if (!decoded) return {{}, kUndecodable};
  if (errors.damaged) return {{}, "is damaged: its pixels cannot all be decoded"};
  cv::cvtColor(image, image, cv::COLOR_RGB2BGR);
  return {image, ""};
}

std::vector<unsigned char> encode_jpeg(const cv::Mat& image, int quality) {
  const TraceScope scope("encode JPEG");
  if (image.depth() != CV_8U || image.empty() ||
      std::max(image.rows, image.cols) > JPEG_MAX_DIMENSION)
    throw std::invalid_argument("no image of a JPEG file");
  const cv::Mat rows = image.channels() == 1 ? image : in_rgb(image);
  jpeg_compress_struct encoder{};
  jpeg_error_mgr errors{};
  encoder.err = jpeg_std_error(&errors);  // memory is all that can fail
  jpeg_create_compress(&encoder);
  unsigned char* bytes = nullptr;
  unsigned long size = 0;
  jpeg_mem_dest(&encoder, &bytes, &size);
  encoder.image_width = static_cast<JDIMENSION>(rows.cols);
  encoder.image_height = static_cast<JDIMENSION>(rows.rows);
  encoder.input_components = rows.channels();
  encoder.in_color_space = rows.channels() == 1 ? JCS_GRAYSCALE : JCS_RGB;
  jpeg_set_defaults(&encoder);
  jpeg_set_quality(&encoder, quality, TRUE);
  jpeg_start_compress(&encoder, TRUE);
  for (int y = 0; y < rows.rows; ++y) {
    auto* row = const_cast<JSAMPROW>(rows.ptr(y));  // libjpeg only reads
    jpeg_write_scanlines(&encoder, &row, 1);
  }
  jpeg_finish_compress(&encoder);
  jpeg_destroy_compress(&encoder);
  const std::unique_ptr<unsigned char, decltype(&std::free)> owner(bytes, &std::free);
  return {bytes, bytes + size};
}

}  // namespace stillmap
