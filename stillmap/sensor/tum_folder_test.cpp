// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/tum_folder.hpp"

#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/depth_image.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <cstdlib>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;

namespace fs = std::filesystem;
using ::testing::HasSubstr;
using ::testing::IsEmpty;
using ::testing::SizeIs;

TEST(TumFolder, ReturnsColorGrayAndMetricDepth) {
  const TestSequence sequence(2);
  cv::Mat color = TestSequence::color_image();
  color.at<cv::Vec3b>(10, 20) = {10, 100, 200};
  sequence.write_image("rgb/1.png", color);
  TumFolder source = sequence.open();
  EXPECT_EQ(source.size(), 2u);
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_EQ(frames[0]->index, 0u);
  EXPECT_EQ(frames[1]->index, 1u);
  EXPECT_NEAR(frames[1]->timestamp, 100 + 1 / 30.0, 1e-6);
  EXPECT_EQ(frames[1]->color.at<cv::Vec3b>(10, 20), cv::Vec3b(10, 100, 200));
  // ITU-R BT.601 luma of blue 10, green 100, red 200.
  EXPECT_NEAR(frames[1]->gray.at<uchar>(10, 20), 0.114 * 10 + 0.587 * 100 + 0.299 * 200, 1);
  EXPECT_EQ(frames[1]->depth.type(), CV_32FC1);
  EXPECT_FLOAT_EQ(frames[1]->depth.at<float>(47, 63), 2);
  EXPECT_THAT(source.skipped(), IsEmpty());
  EXPECT_EQ(source.size(), 0u);
  EXPECT_EQ(source.next(), nullptr);
}

TEST(TumFolder, AcceptsGrayImagesJpegsAndAlpha) {
  const TestSequence sequence(3);
  sequence.write_image("rgb/0.png", TestSequence::color_image({64, 48}, CV_8UC1));
  sequence.write_image("rgb/1.png", TestSequence::color_image({64, 48}, CV_8UC4));
  sequence.write_image("rgb/2.jpg", TestSequence::color_image());
  sequence.write("rgb.txt", "100 rgb/0.png\n100.0333 rgb/1.png\n100.0667 rgb/2.jpg\n");
  TumFolder source = sequence.open();
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(3));
  for (const auto& frame : frames) {
    EXPECT_EQ(frame->color.type(), CV_8UC3);
    for (int c = 0; c < 3; ++c) EXPECT_NEAR(frame->color.at<cv::Vec3b>(20, 30)[c], 100, 3);
  }
}

TEST(TumFolder, DepthMayBeTiffOfWholeNumbersOrOfMeters) {
  const TestSequence sequence(2);
  cv::Mat1f meters(48, 64, 1.5F);
  meters(0, 0) = std::numeric_limits<float>::quiet_NaN();
  meters(0, 1) = std::numeric_limits<float>::infinity();
  for (const auto& [image, file] :
       {std::pair<cv::Mat, int>(TestSequence::depth_image(2.5), 0), {meters, 1}}) {
    sequence.write_image("depth/image.tiff", image);  // in files of any name
    fs::rename(sequence.path("depth/image.tiff"), sequence.path(TestSequence::depth_name(file)));
  }
  TumFolder source = sequence.open();
  const auto frames = all_frames(source);
  ASSERT_EQ(frames.size(), 2U);
  const cv::Mat1f whole = frames[0]->depth, floats = frames[1]->depth;
  EXPECT_EQ(cv::countNonZero(whole != 2.5F), 0);
  EXPECT_EQ(floats(0, 0), 0);
  EXPECT_EQ(floats(0, 1), 0);
  EXPECT_EQ(cv::countNonZero(floats == 1.5F), 48 * 64 - 2);
  EXPECT_TRUE(source.skipped().empty());
}

/// A TIFF file of the given numbers, without the directory's end: in the byte order of Motorola.
std::string big_endian_tiff() {
  const auto number = [](std::uint32_t value, int bytes) {
    std::string text;
    for (int i = bytes - 1; i >= 0; --i) text += static_cast<char>(value >> 8 * i & 0xff);
    return text;
  };
  constexpr std::uint32_t kShort = 3, kLong = 4, kPixels = 64 * 48;
  const std::uint32_t fields[][3] = {
      {256, kShort, 64}, {257, kShort, 48}, {258, kShort, 16},
      {259, kShort, 1},  {262, kShort, 1},  {273, kLong, 8},
      {277, kShort, 1},  {278, kShort, 48}, {279, kLong, 2 * kPixels}};
  std::string tiff = "MM" + number(42, 2) + number(8 + 2 * kPixels, 4);
  for (std::uint32_t i = 0; i < kPixels; ++i) tiff += number(10000, 2);  // 2 m
  tiff += number(std::size(fields), 2);
  for (const auto& [tag, type, value] : fields) {
    tiff += number(tag, 2) + number(type, 2) + number(1, 4);
    tiff += type == kShort ? number(value, 2) + number(0, 2) : number(value, 4);
  }
  return tiff + number(0, 4);
}

TEST(TumFolder, ReadsTiffOfEitherByteOrder) {
  const TestSequence sequence(1);
  sequence.write(TestSequence::depth_name(0), big_endian_tiff());
  TumFolder source = sequence.open();
  const RgbdFramePtr frame = source.next();
  ASSERT_TRUE(frame);
  EXPECT_EQ(cv::countNonZero(frame->depth == 2.0F), 48 * 64);
}

TEST(TumFolder, DepthOutOfRangeOrSaturatedIsUnknown) {
  const TestSequence sequence(1);
  cv::Mat depth = TestSequence::depth_image();
  const std::vector<std::uint16_t> raw{0, 400, 2249, 2250, 37500, 37501, 65534, 65535};
  for (int i = 0; i < 8; ++i) depth.at<std::uint16_t>(0, i) = raw[i];
  sequence.write_image("depth/0.png", depth);
  TumFolder source = sequence.open();  // of a Kinect: 0.45 m to 7.5 m
  const auto frame = source.next();
  ASSERT_NE(frame, nullptr);
  const std::vector<float> expected{0, 0, 0, 0.45F, 7.5F, 0, 0, 0};
  for (int i = 0; i < 8; ++i) EXPECT_FLOAT_EQ(frame->depth.at<float>(0, i), expected[i]) << raw[i];
}

TEST(TumFolder, SaturationIsUnknownEvenWithinTheRange) {
  const cv::Mat raw = (cv::Mat_<std::uint16_t>(1, 2) << 65534, 65535);
  const cv::Mat meters = depth_in_meters(raw, 10000, find_depth_sensor("ideal"));
  EXPECT_FLOAT_EQ(meters.at<float>(0), 6.5534F);
  EXPECT_EQ(meters.at<float>(1), 0);
}

TEST(TumFolder, UsesTheSelectedRange) {
  const TestSequence sequence(10);
  TumFolder source = sequence.open({.first = 2, .count = 6, .stride = 2});
  EXPECT_EQ(source.size(), 3u);
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(3));
  for (int i = 0; i < 3; ++i) {
    EXPECT_EQ(frames[i]->index, static_cast<std::size_t>(i));
    EXPECT_NEAR(frames[i]->timestamp, TestSequence::stamp(2 + 2 * i), 1e-6);
  }
  EXPECT_THAT(error_of([&] { sequence.open({.first = 10}); }), HasSubstr("10 frames"));
  EXPECT_THAT(error_of([&] { sequence.open({.stride = 0}); }), HasSubstr("stride"));
}

TEST(TumFolder, SkippedFramesLeaveNoGapInTheIndices) {
  const TestSequence sequence(4);
  fs::remove(sequence.path("rgb/1.png"));
  sequence.truncate("depth/2.png", 0.5);
  TumFolder source = sequence.open();
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(frames[1]->index, 1u);
  EXPECT_NEAR(frames[1]->timestamp, TestSequence::stamp(2), 1e-6);
  ASSERT_THAT(source.skipped(), SizeIs(2));
  EXPECT_EQ(source.skipped()[0].reason, "rgb/1.png is missing");
  EXPECT_NEAR(source.skipped()[0].timestamp, TestSequence::stamp(1), 1e-6);
  EXPECT_THAT(source.skipped()[1].reason, HasSubstr("depth/2.png is truncated"));
}

TEST(TumFolder, RectifiesImagesOfADistortedCamera) {
  const TestSequence sequence(1);
  Camera camera = TestSequence::camera();
  camera.distortion << 0.26, -0.95, -0.005, 0.0026, 1.16;
  TumFolder source(find_sequence(sequence.folder()), camera);
  EXPECT_FALSE(source.camera().distorted());
  EXPECT_EQ(source.camera().fx, camera.fx);
  const auto frame = source.next();
  ASSERT_NE(frame, nullptr);
  EXPECT_GT(cv::norm(frame->color, TestSequence::color_image(), cv::NORM_INF), 1);
  for (const float z : cv::Mat_<float>(frame->depth)) EXPECT_TRUE(z == 0 || z == 2) << z;
}

// ---- lists ------------------------------------------------------------------------------------

TEST(ListFrames, PairsTheClosestTimestampsAndListsTheRest) {
  const TestSequence sequence(0);
  sequence.write("rgb.txt", "1.00 rgb/a.png\n1.03 rgb/b.png\n1.06 rgb/c.png\n");
  sequence.write("depth.txt", "1.07 depth/z.png\n1.005 depth/x.png\n");
  const FrameList list = list_frames(find_sequence(sequence.folder()));
  ASSERT_THAT(list.skipped, SizeIs(1));  // depth.txt decreases, so one of its lines is dropped.
  EXPECT_THAT(list.skipped[0].reason, HasSubstr("out of order"));
  ASSERT_THAT(list.frames, SizeIs(3));
  EXPECT_EQ(list.frames[0].depth.filename(), "x.png");
  EXPECT_TRUE(list.frames[1].depth.empty() && list.frames[2].depth.empty());
}

TEST(TumFolder, AColorImageWithoutDepthImageGivesAFrameWithoutDepth) {
  const TestSequence sequence(3);
  sequence.write("depth.txt", fmt::format("{:.6f} depth/0.png\n{:.6f} depth/2.png\n",
                                          TestSequence::stamp(0), TestSequence::stamp(2)));
  TumFolder source = sequence.open();
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_THAT(source.skipped(), IsEmpty());
  EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
  EXPECT_EQ(frames[1]->depth.size(), frames[0]->depth.size());
  EXPECT_GT(cv::countNonZero(frames[0]->depth), 0);
  EXPECT_NEAR(frames[1]->timestamp, TestSequence::stamp(1), 1e-6);
}

TEST(ListFrames, AnAssociationsFileIsUsedAsGiven) {
  const TestSequence sequence(0);
  fs::remove(sequence.path("depth.txt"));
  sequence.write("associations.txt",
                 "1.0 rgb/a.png 1.5 depth/x.png\n2.0,rgb/b.png,2.5,depth/y.png\r\n");
  const FrameList list = list_frames(find_sequence(sequence.folder()));
  ASSERT_THAT(list.frames, SizeIs(2));
  EXPECT_EQ(list.frames[1].timestamp, 2);
  EXPECT_EQ(list.frames[1].depth_timestamp, 2.5);
  EXPECT_EQ(list.frames[1].depth, sequence.path("depth/y.png"));
  EXPECT_THAT(list.skipped, IsEmpty());
}

TEST(ListFrames, AGivenAssociationsFileIsPreferredToTheLists) {
  const TestSequence sequence(3);
  sequence.write("mine.txt", "100 rgb/0.png 100 depth/0.png\n");
  const auto paths = find_sequence(sequence.folder(), sequence.path("mine.txt"));
  EXPECT_THAT(list_frames(paths).frames, SizeIs(1));
  EXPECT_THAT(list_frames(find_sequence(sequence.folder())).frames, SizeIs(3));
}

TEST(ListFrames, SkipsTheFewestLinesThatLeaveIncreasingTimestamps) {
  const TestSequence sequence(0);
  std::string color, depth;
  for (const char* stamp : {"1", "2", "900", "3", "3", "4"})
    color += std::string(stamp) + " rgb/a.png\n";
  for (const char* stamp : {"1", "2", "3", "4", "900"})
    depth += std::string(stamp) + " depth/a.png\n";
  sequence.write("rgb.txt", color);
  sequence.write("depth.txt", depth);
  const FrameList list = list_frames(find_sequence(sequence.folder()));
  std::vector<double> stamps;
  for (const auto& frame : list.frames) stamps.push_back(frame.timestamp);
  EXPECT_THAT(stamps, ::testing::ElementsAre(1, 2, 3, 4));
  ASSERT_THAT(list.skipped, SizeIs(2));
  EXPECT_THAT(list.skipped[0].reason, HasSubstr("3.000000 repeats"));
  EXPECT_THAT(list.skipped[1].reason, HasSubstr("900.000000 is out of order"));
}

// ---- folders ----------------------------------------------------------------------------------

TEST(FindSequence, FindsAllFiles) {
  const TestSequence sequence(1);
  auto paths = find_sequence(sequence.folder());
  EXPECT_EQ(paths.color_list, sequence.path("rgb.txt"));
  EXPECT_TRUE(paths.associations.empty());
  EXPECT_TRUE(paths.camera.empty());
  EXPECT_TRUE(paths.ground_truth.empty());
  EXPECT_TRUE(paths.masks.empty());
  write_camera(sequence.path("camera.yaml"), TestSequence::camera());
  sequence.write("groundtruth.txt", "1 0 0 0 0 0 0 1\n");
  fs::create_directories(sequence.path("mask"));
  paths = find_sequence(sequence.folder());
  EXPECT_EQ(paths.camera, sequence.path("camera.yaml"));
  EXPECT_EQ(paths.ground_truth, sequence.path("groundtruth.txt"));
  EXPECT_EQ(paths.masks, sequence.path("mask"));
}

TEST(FindSequence, SuggestsASequenceNearby) {
  const TestSequence sequence(1);
  EXPECT_THAT(error_of([&] { find_sequence(sequence.path("rgb")); }),
              HasSubstr("did you mean " + sequence.folder().string()));
  fs::create_directories(sequence.path("outer"));
  for (const char* name : {"rgb", "depth", "rgb.txt", "depth.txt"}) {
    fs::create_directories(sequence.path("outer/inner"));
    fs::rename(sequence.path(name), sequence.path("outer/inner") / name);
  }
  EXPECT_THAT(error_of([&] { find_sequence(sequence.path("outer")); }), HasSubstr("outer/inner?"));
}

// ---- real data --------------------------------------------------------------------------------

TEST(TumFolder, ReadsARealRecording) {
  const char* shared = std::getenv("STILLMAP_SHARED");
  const fs::path folder =
      fs::path(shared ? shared : STILLMAP_SHARED_DEFAULT) / "bench/tum_walking_halfsphere_first50";
  if (!fs::exists(folder)) GTEST_SKIP() << folder << " is not there";
  TumFolder source(find_sequence(folder), read_camera("tum_fr3"), {.count = 5});
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(5));
  EXPECT_THAT(source.skipped(), IsEmpty());
  EXPECT_NEAR(frames[0]->timestamp, 1341846434.710184, 1e-6);
  EXPECT_GT(cv::countNonZero(frames[0]->depth), 640 * 480 / 2);
}

}  // namespace
}  // namespace stillmap
