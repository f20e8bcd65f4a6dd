// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/jpeg_decoder.hpp"

#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

#ifdef STILLMAP_HAS_JPEG
#include <csetjmp>
#include <cstdio>  // jpeglib.h wants it before itself
#include <jerror.h>
#include <jpeglib.h>
#endif

namespace stillmap {
namespace {

constexpr const char* kUndecodable = "cannot be decoded: it is damaged";

JpegRead decode_by_opencv(std::span<const unsigned char> bytes) {
  try {
    const cv::Mat raw(1, static_cast<int>(bytes.size()), CV_8UC1,
                      const_cast<unsigned char*>(bytes.data()));  // imdecode only reads
    cv::Mat image = cv::imdecode(raw, cv::IMREAD_COLOR | cv::IMREAD_IGNORE_ORIENTATION);
    if (!image.empty()) return {image, ""};
  } catch (const cv::Exception&) {  // reported like an empty image
    return {{}, kUndecodable};
  }
  return {{}, kUndecodable};
}

#ifdef STILLMAP_HAS_JPEG
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
#endif

}  // namespace

JpegRead decode_jpeg(std::span<const unsigned char> bytes) {
#ifdef STILLMAP_HAS_JPEG
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
  if (four_colors) return decode_by_opencv(bytes);
  if (!decoded) return {{}, kUndecodable};
  if (errors.damaged) return {{}, "is damaged: its pixels cannot all be decoded"};
  cv::cvtColor(image, image, cv::COLOR_RGB2BGR);
  return {image, ""};
#else
  return decode_by_opencv(bytes);
#endif
}

}  // namespace stillmap
