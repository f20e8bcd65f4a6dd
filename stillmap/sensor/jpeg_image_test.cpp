// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/jpeg_image.hpp"

#include <random>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Noise on a gradient, so that every block has content.
cv::Mat gradient(int type) {
  cv::Mat noise(120, 161, type), image(120, 161, type);
  cv::theRNG().state = 11;
  cv::randu(noise, 0, 60);
  for (int x = 0; x < image.cols; ++x) image.col(x).setTo(cv::Scalar(x % 90, x, 190 - x));
  return image + noise;
}

std::vector<unsigned char> encoded(int type, const std::vector<int>& how = {}) {
  std::vector<unsigned char> bytes;
  cv::imencode(".jpg", gradient(type), bytes, how);
  return bytes;
}

TEST(JpegDecoder, DecodesTheSamePixelsAsOpenCv) {
  for (const int type : {CV_8UC1, CV_8UC3}) {
    for (const int progressive : {0, 1}) {
      const auto bytes = encoded(type, {cv::IMWRITE_JPEG_PROGRESSIVE, progressive});
      const JpegRead read = decode_jpeg(bytes);
      ASSERT_EQ(read.problem, "");
      ASSERT_EQ(read.image.type(), CV_8UC3);
      EXPECT_EQ(cv::norm(read.image, cv::imdecode(bytes, cv::IMREAD_COLOR), cv::NORM_INF), 0);
    }
  }
}

TEST(JpegDecoder, OtherDataIsAProblem) {
  EXPECT_NE(decode_jpeg(std::vector<unsigned char>{0xff, 0xd8, 0xff}).problem, "");
  auto bytes = encoded(CV_8UC3);
  bytes.resize(40);
  EXPECT_NE(decode_jpeg(bytes).problem, "");
}

TEST(JpegDecoder, DamageInTheMiddleIsDetected) {
  const auto bytes = encoded(CV_8UC3);
  std::mt19937 random(5);
  int noticed = 0;
  constexpr int kRounds = 100, kDamaged = 64;
  for (int round = 0; round < kRounds; ++round) {
    auto damaged = bytes;
    const std::size_t at = bytes.size() / 4 + random() % (bytes.size() / 2);
    for (std::size_t i = at; i < at + kDamaged; ++i) {
      damaged[i] = static_cast<unsigned char>(random());
    }
    noticed += !decode_jpeg(damaged).problem.empty();
  }
  EXPECT_GE(noticed, 80) << "without a checksum some damage is undetectable";
}

TEST(JpegDecoder, MissingDataIsDetected) {
  auto bytes = encoded(CV_8UC3);
  const auto middle = bytes.begin() + static_cast<std::ptrdiff_t>(bytes.size() / 2);
  bytes.erase(middle, middle + 500);
  EXPECT_EQ(decode_jpeg(bytes).problem, "is damaged: its pixels cannot all be decoded");
}

TEST(JpegDecoder, TrailingBytesAreIgnored) {
  auto bytes = encoded(CV_8UC3);
  bytes.insert(bytes.end(), 100, 0);
  EXPECT_EQ(decode_jpeg(bytes).problem, "");
}
TEST(JpegEncoder, WritesTheSameBytesAsOpenCv) {
  for (const int type : {CV_8UC1, CV_8UC3})
    EXPECT_EQ(encode_jpeg(gradient(type), 90), encoded(type, {cv::IMWRITE_JPEG_QUALITY, 90}));
}

TEST(JpegEncoder, RefusesWhatAJpegCannotHold) {
  EXPECT_THROW((void)encode_jpeg(cv::Mat(2, 70000, CV_8UC1), 90), std::invalid_argument);
  EXPECT_THROW((void)encode_jpeg(cv::Mat(2, 2, CV_16UC1), 90), std::invalid_argument);
  EXPECT_THROW((void)encode_jpeg(cv::Mat(), 90), std::invalid_argument);
}

}  // namespace
}  // namespace stillmap
