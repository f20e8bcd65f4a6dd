// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/tiff_image.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <cstdint>
#include <string>
#include <tiffio.h>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {
namespace {

using Bytes = std::vector<unsigned char>;

cv::Mat noise(int type) {
  cv::Mat image(41, 67, type);
  cv::RNG(3).fill(image, cv::RNG::UNIFORM, 0, 250);
  return image;
}

/// Returns the first image of a file whose directory holds what `describe` sets.
template <typename Describe, typename Write>
Bytes file_of(const Describe& describe, const Write& write) {
  const std::string file = test::own_path("image.tiff").string();
  TIFF* tiff = TIFFOpen(file.c_str(), "w");
  TIFFSetField(tiff, TIFFTAG_IMAGEWIDTH, 67);
  TIFFSetField(tiff, TIFFTAG_IMAGELENGTH, 41);
  TIFFSetField(tiff, TIFFTAG_BITSPERSAMPLE, 16);
  TIFFSetField(tiff, TIFFTAG_SAMPLESPERPIXEL, 1);
  TIFFSetField(tiff, TIFFTAG_PHOTOMETRIC, PHOTOMETRIC_MINISBLACK);
  TIFFSetField(tiff, TIFFTAG_COMPRESSION, COMPRESSION_ADOBE_DEFLATE);
  describe(tiff);
  write(tiff);
  TIFFClose(tiff);
  const std::string bytes = read_file(file);
  return {bytes.begin(), bytes.end()};
}

void write_rows(TIFF* tiff, cv::Mat image) {
  for (int y = 0; y < image.rows; ++y)
    TIFFWriteScanline(tiff, image.ptr(y), static_cast<std::uint32_t>(y), 0);
}

void expect_pixels(const Bytes& bytes, const cv::Mat& image) {
  const auto [header, problem] = tiff_header(bytes);
  EXPECT_EQ(problem, "");
  EXPECT_EQ(header.size, image.size());
  const cv::Mat decoded = decode_tiff(bytes);
  ASSERT_EQ(decoded.type(), image.type());
  ASSERT_EQ(decoded.size(), image.size());
  EXPECT_EQ(cv::norm(decoded, image, cv::NORM_INF), 0);
}

TEST(TiffImage, DecodesWhatOpenCvWrites) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_16UC1, CV_32FC1}) {
    const cv::Mat image = noise(type);
    for (const int compression : {COMPRESSION_NONE, COMPRESSION_LZW, COMPRESSION_ADOBE_DEFLATE}) {
      Bytes bytes;
      cv::imencode(".tiff", image, bytes, {cv::IMWRITE_TIFF_COMPRESSION, compression});
      expect_pixels(bytes, image);
    }
  }
}

TEST(TiffImage, DecodesTiles) {
  const cv::Mat image = noise(CV_16UC1);
  cv::Mat enlarged(48, 80, CV_16UC1, cv::Scalar(0));
  image.copyTo(enlarged(cv::Rect({}, image.size())));
  const Bytes bytes = file_of(
      [](TIFF* tiff) {
        TIFFSetField(tiff, TIFFTAG_TILEWIDTH, 16);
        TIFFSetField(tiff, TIFFTAG_TILELENGTH, 16);
      },
      [&](TIFF* tiff) {
        for (int y = 0; y < enlarged.rows; y += 16) {
          for (int x = 0; x < enlarged.cols; x += 16) {
            cv::Mat tile = enlarged(cv::Rect(x, y, 16, 16)).clone();
            TIFFWriteTile(tiff, tile.data, static_cast<std::uint32_t>(x),
                          static_cast<std::uint32_t>(y), 0, 0);
          }
        }
      });
  expect_pixels(bytes, image);
}

TEST(TiffImage, ATurnedImageIsRefused) {
  const cv::Mat image = noise(CV_16UC1);
  const Bytes bytes =
      file_of([](TIFF* tiff) { TIFFSetField(tiff, TIFFTAG_ORIENTATION, ORIENTATION_RIGHTTOP); },
              [&](TIFF* tiff) { write_rows(tiff, image); });
  EXPECT_EQ(tiff_header(bytes).problem, "is turned by its orientation: store it upright");
}

TEST(TiffImage, TruncatedOrDamagedFilesAreProblemsWithoutOutput) {
  Bytes bytes = file_of([](TIFF*) {}, [&](TIFF* tiff) { write_rows(tiff, noise(CV_16UC1)); });
  testing::internal::CaptureStderr();
  constexpr std::size_t kNextDirectory = 4;  // bytes at the end; 0: there is none
  for (std::size_t size = 4; size < bytes.size() - kNextDirectory; size += 5)
    EXPECT_NE(tiff_header(std::span(bytes).first(size)).problem, "") << size << " bytes";
  for (std::size_t i = 8; i < bytes.size() / 2; ++i) bytes[i] = 0xff;  // the pixels
  ASSERT_EQ(tiff_header(bytes).problem, "");
  EXPECT_TRUE(decode_tiff(bytes).empty());
  EXPECT_EQ(testing::internal::GetCapturedStderr(), "");
}

}  // namespace
}  // namespace stillmap
