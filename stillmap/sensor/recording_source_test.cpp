// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/recording_source.hpp"

#include "stillmap/recording/test_recording.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/recorded_image.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <cstring>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using test::error_of;
using test::Kind;
using test::TestCamera;
using test::TestFolder;
using test::TestMessage;
using ::testing::HasSubstr;
using ::testing::SizeIs;

constexpr const char* kImage = "sensor_msgs/msg/Image";

std::string bytes_of(const cv::Mat& image) {
  return {reinterpret_cast<const char*>(image.data), image.total() * image.elemSize()};
}

std::string file_of(const std::string& extension, const cv::Mat& image) {
  std::vector<std::uint8_t> bytes;
  cv::imencode(extension, image, bytes);
  return {bytes.begin(), bytes.end()};
}

// A recording of the frames of a TestSequence: depth 5 ms after the color image.
std::vector<TestMessage> messages(int frames, const std::string& depth_frame = "color") {
  const TestCamera color{.frame = "color"}, depth{.frame = depth_frame};
  cv::Mat rgb;
  cv::cvtColor(TestSequence::color_image(), rgb, cv::COLOR_BGR2RGB);
  const cv::Mat meters(48, 64, CV_16UC1, cv::Scalar(2000));
  std::vector<TestMessage> all;
  for (int i = 0; i < frames; ++i) {
    const std::int64_t time = 100'000'000'000 + i * 33'333'333LL, later = time + 5'000'000;
    const auto stamp = [](std::int64_t ns) {
      return std::pair(static_cast<std::uint32_t>(ns / 1'000'000'000),
                       static_cast<std::uint32_t>(ns % 1'000'000'000));
    };
    all.push_back({"/rgb/info/camera_info", "sensor_msgs/msg/CameraInfo",
                   color.info(64, 48, 60, "plumb_bob", {}), time});
    all.push_back(
        {"/rgb/info/image", kImage,
         color.image(stamp(time).first, stamp(time).second, 64, 48, "rgb8", 3, bytes_of(rgb)),
         time});
    all.push_back(
        {"/depth/image", kImage,
         depth.image(stamp(later).first, stamp(later).second, 64, 48, "16UC1", 2, bytes_of(meters)),
         later});
  }
  return all;
}

TEST(RecordingSource, ReturnsTheFramesOfTheFolderWithTheSameImages) {
  const TestFolder folder;
  const auto file = folder.write("a.mcap", test::mcap_of(messages(3), "cdr", "zstd", 4, true));
  const auto source = make_source(file.string());
  EXPECT_EQ(source->camera().fx, 60);
  EXPECT_EQ(source->camera().width, 64);
  EXPECT_EQ(source->camera().fps, 30);
  EXPECT_EQ(source->size(), 3U);
  const auto frames = all_frames(*source);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(frames[1]->timestamp, 100.033333333);
  EXPECT_NEAR(frames[1]->depth_delay, 0.005, 1e-9);
  EXPECT_EQ(cv::norm(frames[1]->color, TestSequence::color_image(), cv::NORM_INF), 0);
  EXPECT_EQ(frames[1]->depth.at<float>(20, 30), 2);
  EXPECT_THAT(source->notes(), ::testing::Contains(HasSubstr("/rgb/info/image, 3 images")));
}

TEST(RecordingSource, ADamagedImageCostsOneFrameAndOneWithoutDepthIsKept) {
  auto all = messages(4);
  all[3 + 1].data.resize(500);  // the color image of the second frame
  all[6 + 2].data.resize(500);  // the depth image of the third frame
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, "");
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
  ASSERT_THAT(source.skipped(), SizeIs(2));
  EXPECT_THAT(source.skipped()[0].reason, HasSubstr("/rgb/info/image: an image is damaged"));
  EXPECT_FALSE(source.skipped()[1].frame_lost);
}

TEST(RecordingSource, UsesTheSelectedRangeAndTheGivenCamera) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", messages(8));
  Camera camera = TestSequence::camera();
  camera.depth_factor = 500;
  RecordingSource source(file, camera, "", {.first = 1, .count = 4, .stride = 2});
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_NEAR(frames[0]->timestamp, 100 + 1 / 30.0, 1e-6);
  EXPECT_EQ(frames[0]->depth.at<float>(20, 30), 4);
  camera.width = 80;
  EXPECT_THAT(error_of([&] { RecordingSource(file, camera, ""); }),
              HasSubstr("is 64 x 48 pixels where the camera has 80 x 48"));
}

TEST(RecordingSource, DepthOfAnotherCameraIsRegistered) {
  auto all = messages(2, "depth");
  const TestFolder folder;
  all.push_back({"/depth/camera_info", "sensor_msgs/msg/CameraInfo",
                 TestCamera{.frame = "depth"}.info(64, 48, 60, "plumb_bob", {}), 1});
  all.push_back({"/tf_static", "tf2_msgs/msg/TFMessage",
                 TestCamera().transform("color", "depth", {0.1, 0, 0, 0, 0, 0, 1}), 2});
  RecordingSource source(folder.write("a.mcap", test::mcap_of(all, "cdr", "", 0, true)),
                         std::nullopt, "");
  const auto frame = source.next();
  ASSERT_NE(frame, nullptr);
  // 0.1 m to the right at 2 m are 3 pixels, where the depth image shows nothing.
  EXPECT_EQ(frame->depth.at<float>(20, 2), 0);
  EXPECT_EQ(frame->depth.at<float>(20, 3), 2);
  EXPECT_THAT(source.notes(), ::testing::Contains(HasSubstr("100.0 mm")));
}

TEST(RecordingSource, ARecordingWithoutACameraNeedsOne) {
  auto all = messages(2);
  std::erase_if(all,
                [](const TestMessage& message) { return message.topic.ends_with("camera_info"); });
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", all);
  EXPECT_THAT(error_of([&] { RecordingSource(file, std::nullopt, ""); }), HasSubstr("--camera"));
  EXPECT_EQ(RecordingSource(file, TestSequence::camera(), "").size(), 2U);
}

TEST(RecordingSource, ACameraThatIsNotCalibratedIsAnErrorThatSaysSo) {
  auto all = messages(2);
  for (TestMessage& message : all) {
    if (message.topic.ends_with("camera_info"))
      message.data = TestCamera{.frame = "color"}.info(64, 48, 0, "", {});
  }
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", all);
  EXPECT_THAT(
      error_of([&] { RecordingSource(file, std::nullopt, ""); }),
      ::testing::AllOf(HasSubstr("K of /rgb/info/camera_info is 0"), HasSubstr("--camera")));
}

// ---- stereo pairs

constexpr double kFocal = 450, kBaseline = 0.12;  // pixels, m
constexpr int kDisparity = 24;                    // pixels

// Two frames of a stereo pair that looks at a wall.
// @param delay  of the right images [ns]
std::vector<TestMessage> pair_messages(std::int64_t delay = 0) {
  cv::Mat wall(160, 400, CV_8UC1);
  cv::theRNG().state = 5;
  cv::randu(wall, 0, 255);
  cv::GaussianBlur(wall, wall, {5, 5}, 0);
  std::vector<TestMessage> all;
  for (int i = 0; i < 2; ++i) {
    for (const bool left : {true, false}) {
      const std::string name = left ? "/left" : "/right";
      const TestCamera camera{.frame = name};
      const cv::Mat image = wall.colRange(left ? 0 : kDisparity, left ? 320 : 320 + kDisparity);
      const std::int64_t time = 1'000'000'000 + i * 100'000'000 + (left ? 0 : delay);
      all.push_back(
          {name + "/camera_info", "sensor_msgs/msg/CameraInfo",
           camera.info(320, 160, kFocal / 2, "plumb_bob", {}, left ? 0 : -kFocal * kBaseline),
           time});
      all.push_back({name + "/image_rect", kImage,
                     camera.image(1, static_cast<std::uint32_t>(time - 1'000'000'000), 320, 160,
                                  "mono8", 1, bytes_of(image.clone())),
                     time});
    }
  }
  return all;
}

constexpr const char* kPair = "/left/image_rect,/right/image_rect";

TEST(RecordingSource, AStereoPairGivesTheLeftImagesWithDepth) {
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", pair_messages()), std::nullopt, kPair);
  EXPECT_EQ(source.camera().fx, kFocal);
  EXPECT_NEAR(source.camera().baseline, kBaseline, 1e-12);
  EXPECT_EQ(source.camera().depth_sensor.name, "stereo");
  EXPECT_THAT(source.notes(), ::testing::Contains(HasSubstr("baseline 0.120 m, rectified")));
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  const double depth = kFocal * kBaseline / kDisparity;  // m
  EXPECT_NEAR(frames[0]->depth.at<float>(80, 200), depth, 0.01 * depth);
  EXPECT_EQ(frames[1]->depth_delay, 0);
}

TEST(RecordingSource, ImagesOfAStereoPairMustBeOfTheSameInstant) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", pair_messages(5'000'000));
  EXPECT_THAT(
      error_of([&] { RecordingSource(file, std::nullopt, kPair); }),
      HasSubstr("no image of /left/image_rect has one of /right/image_rect within 0.002 s"));
}

TEST(RecordingSource, ADamagedRightImageLeavesAFrameWithoutDepth) {
  auto all = pair_messages();
  all[7].data.resize(500);
  const TestFolder folder;
  RecordingSource source(folder.write_sqlite("a.db3", all), std::nullopt, kPair);
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
  ASSERT_THAT(source.skipped(), SizeIs(1));
  EXPECT_FALSE(source.skipped()[0].frame_lost);
}

TEST(RecordingSource, AStereoPairRefusesAnotherCamera) {
  const TestFolder folder;
  const auto file = folder.write_sqlite("a.db3", pair_messages());
  EXPECT_THAT(error_of([&] { RecordingSource(file, TestSequence::camera(), kPair); }),
              HasSubstr("leave --camera out"));
}

// ---- pixel formats ------------------------------------------------------------------------------

// Decodes an image message without compression in every encoding of messages.
ImageRead decode(const std::string& format, int pixel_bytes, const std::string& pixels, Kind kind,
                 bool depth) {
  const std::string bytes = TestCamera{.kind = kind}.image(1, 2, 4, 2, format, pixel_bytes, pixels);
  const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
  const ImageStream stream{.encoding = format};
  const std::string encoding = kind == Kind::kRos1 ? "ros1" : "cdr";
  return depth ? decode_recorded_depth(stream, encoding, span, {4, 2})
               : decode_recorded_color(stream, encoding, span, {4, 2});
}

TEST(RecordedImage, PixelFormatsBecomeBgr) {
  const auto repeated = [](const std::string& pixel) {
    std::string all;
    for (int i = 0; i < 8; ++i) all += pixel;
    return all;
  };
  for (const Kind kind : {Kind::kRos1, Kind::kLittleCdr, Kind::kBigCdr}) {
    for (const auto& [format, pixel] :
         std::vector<std::pair<std::string, std::string>>{{"rgb8", "\x03\x02\x01"},
                                                          {"bgr8", "\x01\x02\x03"},
                                                          {"rgba8", "\x03\x02\x01\x09"},
                                                          {"bgra8", "\x01\x02\x03\x09"}}) {
      const auto read =
          decode(format, static_cast<int>(pixel.size()), repeated(pixel), kind, false);
      ASSERT_EQ(read.problem, "") << format;
      EXPECT_EQ(read.image.at<cv::Vec3b>(1, 3), cv::Vec3b(1, 2, 3)) << format;
    }
    EXPECT_EQ(decode("mono8", 1, repeated("\x07"), kind, false).image.at<cv::Vec3b>(1, 3),
              cv::Vec3b(7, 7, 7));
    EXPECT_NE(decode("rgb16", 6, repeated("123456"), kind, false).problem, "");
    EXPECT_NE(decode("rgb8", 3, repeated("12"), kind, false).problem, "");
  }
}

TEST(RecordedImage, BayerPatternsAreCalledByTheirFirstTwoPixels) {
  for (const auto& [format, row, column, channel] :
       {std::tuple("bayer_rggb8", 0, 0, 2), std::tuple("bayer_bggr8", 0, 0, 0),
        std::tuple("bayer_grbg8", 0, 1, 2), std::tuple("bayer_gbrg8", 0, 1, 0)}) {
    cv::Mat1b pattern(8, 8, uchar{0});  // Only the pixels of one color are bright.
    for (int y = row; y < 8; y += 2)
      for (int x = column; x < 8; x += 2) pattern(y, x) = 200;
    const std::string bytes = TestCamera().image(1, 2, 8, 8, format, 1, bytes_of(pattern));
    const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    const ImageStream stream{.encoding = format};
    const ImageRead read = decode_recorded_color(stream, "cdr", span, {8, 8});
    ASSERT_EQ(read.problem, "");
    cv::Vec3b expected(0, 0, 0);
    expected[channel] = 200;
    EXPECT_EQ(read.image.at<cv::Vec3b>(4 + row, 4 + column), expected) << format;
  }
}

TEST(RecordedImage, DepthIsReadInBothByteOrders) {
  const std::string little("\x10\x27\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16);
  const std::string big("\x27\x10\0\0\0\0\0\0\0\0\0\0\0\0\0\0", 16);
  for (const char* format : {"16UC1", "mono16"}) {
    EXPECT_EQ(decode(format, 2, little, Kind::kLittleCdr, true).image.at<std::uint16_t>(0, 0),
              10000);
    EXPECT_EQ(decode(format, 2, big, Kind::kBigCdr, true).image.at<std::uint16_t>(0, 0), 10000);
  }
  const cv::Mat1f meters(2, 4, 1.5F);
  EXPECT_EQ(decode("32FC1", 4, bytes_of(meters), Kind::kRos1, true).image.at<float>(1, 3), 1.5F);
  EXPECT_NE(decode("rgb8", 3, std::string(24, 'x'), Kind::kRos1, true).problem, "");
}

TEST(RecordedImage, CompressedDepthIsReadInMillimetersAndAsInverseDepth) {
  cv::Mat raw(2, 4, CV_16UC1, cv::Scalar(1234));
  raw.at<std::uint16_t>(0, 0) = 0;
  // As compressed_depth_image_transport quantizes: a = q (q + 1), b = 1 - a / longest depth.
  const float a = 100 * 101, b = 1 - a / 10;
  for (const bool inverse : {false, true}) {
    std::string data(12, '\0');
    std::memcpy(data.data() + 4, &a, 4);
    std::memcpy(data.data() + 8, &b, 4);
    data += file_of(".png", raw);
    const std::string format = inverse ? "32FC1" : "16UC1";
    const std::string bytes =
        TestCamera().compressed_image(1, 2, format + "; compressedDepth png", data);
    const ByteSpan span(reinterpret_cast<const std::uint8_t*>(bytes.data()), bytes.size());
    const ImageStream stream{.storage = ImageStorage::kCompressedDepth, .encoding = format};
    const ImageRead read = decode_recorded_depth(stream, "cdr", span, {4, 2});
    ASSERT_EQ(read.problem, "");
    if (inverse) {
      EXPECT_FLOAT_EQ(read.image.at<float>(1, 2), a / (1234 - b));
      EXPECT_EQ(read.image.at<float>(0, 0), 0);
    } else {
      EXPECT_EQ(read.image.at<std::uint16_t>(1, 2), 1234);
    }
    EXPECT_NE(decode_recorded_depth(stream, "cdr", span.first(70), {4, 2}).problem, "");
    EXPECT_NE(decode_recorded_depth(stream, "cdr", span, {5, 2}).problem, "");
  }
}

}  // namespace
}  // namespace stillmap
