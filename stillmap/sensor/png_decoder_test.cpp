// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/png_decoder.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <filesystem>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// Noise on a gradient, so that every row filter has content.
cv::Mat test_image(cv::Size size, int type) {
  cv::Mat noise(size, type), image(size, type);
  cv::theRNG().state = 11;
  const bool deep = CV_MAT_DEPTH(type) == CV_16U;
  cv::randu(noise, 0, deep ? 3000 : 30);
  for (int x = 0; x < size.width; ++x)
    image.col(x).setTo(cv::Scalar::all((deep ? 500 : 3) * (x % 80)));
  return image + noise;
}

std::vector<unsigned char> encode(const cv::Mat& image, int strategy) {
  std::vector<unsigned char> bytes;
  cv::imencode(".png", image, bytes,
               {cv::IMWRITE_PNG_STRATEGY, strategy, cv::IMWRITE_PNG_COMPRESSION, 6});
  return bytes;
}

class PngKinds : public ::testing::TestWithParam<std::tuple<int, cv::Size>> {};

TEST_P(PngKinds, DecodeToThePixelsThatWereEncoded) {
  const auto [type, size] = GetParam();
  const cv::Mat image = test_image(size, type);
  const auto bytes = encode(image, cv::IMWRITE_PNG_STRATEGY_DEFAULT);
  EXPECT_EQ(png_damage(bytes), "");
  const cv::Mat decoded = decode_png(bytes);
  ASSERT_EQ(decoded.type(), type);
  ASSERT_EQ(decoded.size(), size);
  EXPECT_EQ(cv::norm(decoded, image, cv::NORM_INF), 0);
}

TEST_P(PngKinds, AreEncodedAsOtherProgramsReadThem) {
  const auto [type, size] = GetParam();
  const cv::Mat image = test_image(size, type);
  const std::string png = encode_png(image);
  const std::vector<unsigned char> bytes(png.begin(), png.end());
  EXPECT_EQ(png_damage(bytes), "");
  const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_UNCHANGED);
  ASSERT_EQ(decoded.type(), type);
  EXPECT_EQ(cv::norm(decoded, image, cv::NORM_INF), 0);
}

TEST(EncodePng, RefusesWhatAPngCannotHold) {
  for (const int type : {CV_32FC1, CV_8UC2, CV_16SC1, CV_16UC4})
    EXPECT_THROW((void)encode_png(cv::Mat(2, 2, type, cv::Scalar(1))), std::invalid_argument);
  EXPECT_THROW((void)encode_png(cv::Mat()), std::invalid_argument);
}

INSTANTIATE_TEST_SUITE_P(
    All, PngKinds,
    ::testing::Combine(::testing::Values(CV_8UC1, CV_8UC3, CV_8UC4, CV_16UC1, CV_16UC3),
                       ::testing::Values(cv::Size(1, 1), cv::Size(3, 2), cv::Size(67, 41),
                                         cv::Size(640, 480))));

// OpenCV writes rows with one filter only, so each filter is tested with manual encoding: filter f
// applied to known pixels, stored without compression.
class RowFilters : public ::testing::TestWithParam<int> {};

void append_big_endian(std::vector<unsigned char>& bytes, std::uint32_t value) {
  for (const int shift : {24, 16, 8, 0})
    bytes.push_back(static_cast<unsigned char>(value >> shift));
}

std::uint32_t crc32(const std::vector<unsigned char>& bytes) {  // PNG specification, annex D
  std::uint32_t crc = 0xffffffff;
  for (const unsigned char byte : bytes) {
    crc ^= byte;
    for (int bit = 0; bit < 8; ++bit) crc = (crc & 1) ? 0xedb88320 ^ (crc >> 1) : crc >> 1;
  }
  return ~crc;
}

void append_chunk(std::vector<unsigned char>& png, const std::string& name,
                  const std::vector<unsigned char>& data) {
  append_big_endian(png, static_cast<std::uint32_t>(data.size()));
  std::vector<unsigned char> checked(name.begin(), name.end());
  checked.insert(checked.end(), data.begin(), data.end());
  png.insert(png.end(), checked.begin(), checked.end());
  append_big_endian(png, crc32(checked));
}

std::vector<unsigned char> stored(
    const std::vector<unsigned char>& raw) {        // zlib, one stored block
  const int length = static_cast<int>(raw.size());  // below 65536
  std::vector<unsigned char> bytes;
  bytes.reserve(raw.size() + 11);
  for (const int byte :
       {0x78, 0x01, 0x01, length & 255, length >> 8, ~length & 255, (~length >> 8) & 255}) {
    bytes.push_back(static_cast<unsigned char>(byte));
  }
  bytes.insert(bytes.end(), raw.begin(), raw.end());
  std::uint32_t a = 1, b = 0;
  for (const unsigned char byte : raw) {
    a = (a + byte) % 65521;
    b = (b + a) % 65521;
  }
  append_big_endian(bytes, b << 16 | a);
  return bytes;
}

int predict(int filter, int a, int b, int c) {
  const int p = a + b - c, pa = std::abs(p - a), pb = std::abs(p - b), pc = std::abs(p - c);
  switch (filter) {
    case 1:
      return a;
    case 2:
      return b;
    case 3:
      return (a + b) / 2;
    case 4:
      return pa <= pb && pa <= pc ? a : pb <= pc ? b : c;
    default:
      return 0;
  }
}

/// Filters the rows with the filters of a list in turn.
std::vector<unsigned char> filtered(const cv::Mat& image, const std::vector<int>& filters) {
  const int pixel = image.channels(), bytes = image.cols * pixel;
  std::vector<unsigned char> raw;
  const auto at = [&](int y, int i) { return y < 0 || i < 0 ? 0 : image.ptr(y)[i]; };
  for (int y = 0; y < image.rows; ++y) {
    const int filter = filters[static_cast<std::size_t>(y) % filters.size()];
    raw.push_back(static_cast<unsigned char>(filter));
    for (int i = 0; i < bytes; ++i) {
      const int above_left = i < pixel ? 0 : at(y - 1, i - pixel);
      const int predicted = predict(filter, at(y, i - pixel), at(y - 1, i), above_left);
      raw.push_back(static_cast<unsigned char>(at(y, i) - predicted));
    }
  }
  return raw;
}

struct ChunkToWrite {
  std::string name;
  std::vector<unsigned char> data;
};

// Returns an 8-bit PNG file: signature, header, the given chunks, end.
std::vector<unsigned char> png_file(cv::Size size, int color_type,
                                    const std::vector<ChunkToWrite>& chunks) {
  std::vector<unsigned char> png{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'}, header;
  append_big_endian(header, static_cast<std::uint32_t>(size.width));
  append_big_endian(header, static_cast<std::uint32_t>(size.height));
  for (const int byte : {8, color_type, 0, 0, 0})
    header.push_back(static_cast<unsigned char>(byte));
  append_chunk(png, "IHDR", header);
  for (const auto& chunk : chunks) append_chunk(png, chunk.name, chunk.data);
  append_chunk(png, "IEND", {});
  return png;
}

std::vector<unsigned char> png_of(const cv::Mat& image, const std::vector<int>& filters) {
  const int color_type = image.channels() == 1 ? 0 : image.channels() == 3 ? 2 : 6;
  return png_file(image.size(), color_type, {{"IDAT", stored(filtered(image, filters))}});
}

void expect_undone(const std::vector<int>& filters) {
  for (const int type : {CV_8UC1, CV_8UC3, CV_8UC4}) {
    for (const int width : {1, 2, 53}) {
      cv::Mat image(51, width, type), expected;
      cv::theRNG().state = 5;
      cv::randu(image, 0, 256);
      const cv::Mat decoded = decode_png(png_of(image, filters));
      ASSERT_EQ(decoded.type(), type);
      expected = image;
      if (type == CV_8UC3) cv::cvtColor(image, expected, cv::COLOR_RGB2BGR);
      if (type == CV_8UC4) cv::cvtColor(image, expected, cv::COLOR_RGBA2BGRA);
      EXPECT_EQ(cv::norm(decoded, expected, cv::NORM_INF), 0);
    }
  }
}

TEST_P(RowFilters, AreUndone) { expect_undone({GetParam()}); }

TEST(DecodePng, UndoesAllPairsOfFilters) {
  std::vector<int> filters;
  for (int above = 0; above < 5; ++above)
    for (int below = 0; below < 5; ++below) filters.insert(filters.end(), {above, below});
  expect_undone(filters);
  filters.erase(filters.begin());  // the rows that are undone two at a time begin elsewhere
  expect_undone(filters);
}

INSTANTIATE_TEST_SUITE_P(All, RowFilters, ::testing::Range(0, 5));

TEST(DecodePng, RejectsAnUnknownFilter) {
  const cv::Mat image(4, 4, CV_8UC3, cv::Scalar::all(9));
  const auto png = png_of(image, {7});
  EXPECT_EQ(png_damage(png), "");
  EXPECT_TRUE(decode_png(png).empty());
}

TEST(PngDamage, IsDetectedForEveryChangedByte) {
  const auto good = png_of(test_image({9, 7}, CV_8UC3), {4});
  ASSERT_EQ(png_damage(good), "");
  for (std::size_t i = 8; i < good.size(); ++i) {
    auto bad = good;
    bad[i] ^= 0x10;
    EXPECT_NE(png_damage(bad), "") << "byte " << i;
  }
}

TEST(PngDamage, IsDetectedForEveryTruncation) {
  const auto good = png_of(test_image({9, 7}, CV_8UC3), {4});
  for (std::size_t size = 33; size < good.size(); ++size) {
    EXPECT_NE(png_damage(std::span(good).first(size)), "") << size << " bytes";
  }
}

class PngFile : public ::testing::Test {
 protected:
  std::filesystem::path file_ = test::own_path("image.png");
  ImageRead read(const std::vector<unsigned char>& png, cv::Size size) const {
    write_file(file_, {reinterpret_cast<const char*>(png.data()), png.size()});
    return read_color_image(file_, size);
  }
  void TearDown() override { std::filesystem::remove(file_); }
};

TEST_F(PngFile, APaletteIsResolved) {
  const cv::Mat index = (cv::Mat_<unsigned char>(2, 2) << 0, 1, 1, 0);
  const auto png = png_file(
      {2, 2}, 3, {{"PLTE", {255, 0, 0, 10, 20, 30}}, {"IDAT", stored(filtered(index, {0}))}});
  const ImageRead read = this->read(png, {2, 2});
  ASSERT_EQ(read.problem, "");
  EXPECT_EQ(read.image.at<cv::Vec3b>(0, 0), cv::Vec3b(0, 0, 255));
  EXPECT_EQ(read.image.at<cv::Vec3b>(0, 1), cv::Vec3b(30, 20, 10));
}

TEST_F(PngFile, AlphaIsDroppedAndGrayIsReplicated) {
  const cv::Mat with_alpha(3, 3, CV_8UC4, cv::Scalar(1, 2, 3, 128)),
      gray(3, 3, CV_8UC1, cv::Scalar(77));
  EXPECT_EQ(read(png_of(with_alpha, {4}), {3, 3}).image.at<cv::Vec3b>(1, 1), cv::Vec3b(3, 2, 1));
  EXPECT_EQ(read(png_of(gray, {3}), {3, 3}).image.at<cv::Vec3b>(1, 1), cv::Vec3b(77, 77, 77));
}

TEST_F(PngFile, PixelsThatDoNotInflateAreDamageWithoutOutput) {
  const auto png = png_file({4, 4}, 2, {{"IDAT", {0x78, 0x01, 1, 2, 3, 4}}});
  ::testing::internal::CaptureStderr();
  const ImageRead read = this->read(png, {4, 4});
  EXPECT_EQ(::testing::internal::GetCapturedStderr(), "");
  EXPECT_EQ(read.problem, "cannot be decoded: it is damaged");
  EXPECT_TRUE(read.image.empty());
}

TEST_F(PngFile, TooFewPixelsAreDamage) {
  const cv::Mat half(2, 4, CV_8UC3, cv::Scalar::all(5));
  const auto png = png_file({4, 4}, 2, {{"IDAT", stored(filtered(half, {0}))}});
  EXPECT_EQ(read(png, {4, 4}).problem, "cannot be decoded: it is damaged");
}

}  // namespace
}  // namespace stillmap
