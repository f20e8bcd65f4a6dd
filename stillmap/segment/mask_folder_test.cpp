// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_folder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/image_file.hpp"

#include <fstream>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

struct MaskFolderTest : testing::Test {
  fs::path folder = test::own_path("masks");
  void SetUp() override {
    fs::remove_all(folder);
    fs::create_directories(folder);
  }
  void TearDown() override { fs::remove_all(folder); }

  /// A 40 x 30 mask with a square of `value` at a distinctive left edge.
  void write(const std::string& name, int left, int value = 255) const {
    cv::Mat1b mask = cv::Mat1b::zeros(30, 40);
    mask(cv::Rect(left, 10, 8, 8)) = value;
    write_png(folder / name, mask);
  }
  static RgbdFrame frame(std::size_t index, double stamp) {
    RgbdFrame frame;
    frame.index = index;
    frame.timestamp = stamp;
    frame.gray = cv::Mat1b::zeros(30, 40);
    return frame;
  }
  static RgbdFrame named_frame(const std::string& name, double stamp) {
    RgbdFrame named = frame(0, stamp);
    named.name = name;
    return named;
  }
};

TEST_F(MaskFolderTest, NumbersAreTimestampsMatchedWithinTwentyMilliseconds) {
  write("100.000000.png", 1);
  write("100.100000.png", 2);
  write("100.200000.png", 3);
  MaskFolder masks(folder);
  EXPECT_EQ(masks.detect(frame(7, 100.10)).at(0).box.x, 2);
  EXPECT_EQ(masks.detect(frame(8, 100.185)).at(0).box.x, 3);
  EXPECT_EQ(masks.detect(frame(9, 99.985)).at(0).box.x, 1);
  EXPECT_EQ(masks.missing(), 0U);
  EXPECT_EQ(masks.skipped(), "");
  EXPECT_TRUE(masks.detect(frame(10, 100.15)).empty()) << "that of another frame";
  EXPECT_TRUE(masks.detect(frame(11, 99.0)).empty());
  EXPECT_EQ(masks.missing(), 2U);
}

TEST_F(MaskFolderTest, OtherNamesAreAssignedInOrder) {
  write("frame_a.png", 1);
  write("frame_b.png", 2);
  MaskFolder masks(folder);
  EXPECT_EQ(masks.detect(frame(1, 55)).at(0).box.x, 2);
  EXPECT_EQ(masks.detect(frame(0, 99)).at(0).box.x, 1);
  EXPECT_TRUE(masks.detect(frame(2, 0)).empty());
  EXPECT_EQ(masks.missing(), 1U);
}

TEST_F(MaskFolderTest, FramesWithANameTakeTheMaskOfThatName) {
  write("000001.png", 1);
  write("000002.png", 2);
  MaskFolder masks(folder);
  EXPECT_EQ(masks.detect(named_frame("000002", 2 / 30.0)).at(0).box.x, 2);
  EXPECT_EQ(masks.detect(named_frame("frame1", 1 / 30.0)).at(0).box.x, 1);
  EXPECT_TRUE(masks.detect(named_frame("000030", 1)).empty()) << "a number is no second";
  EXPECT_EQ(masks.missing(), 1U);
}

TEST_F(MaskFolderTest, FramesWhoseNamesAreNoTimesTakeTheMaskOfTheirTime) {
  write("100.000000.png", 1);
  write("100.100000.png", 2);
  MaskFolder masks(folder);
  EXPECT_EQ(masks.detect(named_frame("1", 100.1)).at(0).box.x, 2);
}

TEST_F(MaskFolderTest, WhatOtherFormatsCanOnlyMeanIsRead) {
  write("0.png", 4, 128);
  const cv::Mat1b gray = read_stored_image(folder / "0.png").image;
  cv::Mat three, alpha, sixteen, stretched;
  cv::cvtColor(gray, three, cv::COLOR_GRAY2BGR);
  cv::cvtColor(gray, alpha, cv::COLOR_GRAY2BGRA);
  gray.convertTo(sixteen, CV_16U);
  gray.convertTo(stretched, CV_16U, 257);
  cv::Mat large, small, colored = cv::Mat::zeros(gray.size(), CV_8UC3);
  cv::resize(gray, large, {}, 3, 3, cv::INTER_NEAREST);
  cv::resize(gray, small, {}, 0.5, 0.5, cv::INTER_NEAREST);
  colored.setTo(cv::Scalar(30, 0, 255), gray > 0);
  int number = 1;
  for (const cv::Mat& image : {three, alpha, sixteen, stretched, large, small, colored})
    write_png(folder / fmt::format("{}.png", number++), image);
  MaskFolder masks(folder);
  for (int i = 0; i < number; ++i) {
    const auto found = masks.detect(named_frame(std::to_string(i), 0));
    ASSERT_EQ(found.size(), 1U) << i;
    EXPECT_EQ(found[0].box, cv::Rect(4, 10, 8, 8)) << i;
    EXPECT_EQ(found[0].class_name, "unknown") << i;
  }
}

TEST_F(MaskFolderTest, ColorsOfWhichNoneIsBlackAreNoMask) {
  cv::Mat viridis(30, 40, CV_8UC3, cv::Scalar(84, 1, 68));
  viridis(cv::Rect(4, 10, 8, 8)) = cv::Scalar(37, 231, 253);
  write_png(folder / "1.png", viridis);
  viridis(cv::Rect(20, 0, 20, 30)) = cv::Scalar(0, 0, 0);
  write_png(folder / "2.png", viridis);
  MaskFolder masks(folder);
  for (const char* name : {"1", "2"}) EXPECT_TRUE(masks.detect(named_frame(name, 0)).empty());
  EXPECT_THAT(masks.skipped(), testing::HasSubstr("2 unusable masks; the first: 1.png has colors"));
}

TEST_F(MaskFolderTest, InvertedMasksAreToldAsSuch) {
  for (int i = 0; i < 50; ++i) {
    cv::Mat1b mask(240, 320, 255);
    cv::ellipse(mask, {60 + 4 * i, 120}, {25, 80}, 0, 0, 360, 0, cv::FILLED);
    write_png(folder / fmt::format("{}.png", i), mask);
  }
  MaskFolder masks(folder);
  for (int i = 0; i < 50; ++i) {
    RgbdFrame seen = named_frame(std::to_string(i), i);
    seen.gray = cv::Mat1b::zeros(240, 320);
    seen.depth = cv::Mat1f(240, 320, 3.F);
    cv::ellipse(seen.depth, {60 + 4 * i, 120}, {25, 80}, 0, 0, 360, 1.5, cv::FILLED);
    masks.detect(seen);
  }
  ASSERT_TRUE(masks.finding());
  EXPECT_EQ(masks.finding()->code, "masks-inverted");
}

TEST_F(MaskFolderTest, WhatCannotBeUsedIsNamed) {
  write_png(folder / "1.png", cv::Mat1b(10, 10, 255));
  std::ofstream(folder / "2.png") << "not an image";
  write_png(folder / "3.png", cv::Mat(30, 40, CV_8UC3, cv::Scalar(0, 0, 128)));
  write_png(folder / "4.png", cv::Mat(30, 40, CV_16UC1, cv::Scalar::all(300)));
  write_png(folder / "5.png", cv::Mat(30, 40, CV_8UC4, cv::Scalar(0, 0, 0, 128)));
  const char* problems[] = {"1.png is 10 x 10 pixels where the frame has 40 x 30",
                            "2.png is not a PNG", "3.png has colors", "4.png has 16-bit values",
                            "5.png has colors"};
  for (int i = 0; i < 5; ++i) {
    MaskFolder masks(folder);
    EXPECT_TRUE(masks.detect(frame(0, i + 1)).empty());
    EXPECT_EQ(masks.unusable(), 1U);
    EXPECT_EQ(masks.missing(), 0U);
    EXPECT_THAT(masks.skipped(), testing::HasSubstr(problems[i]));
  }
}

TEST_F(MaskFolderTest, MasksOfHalvedFramesAreHalved) {
  write("1.png", 6);
  MaskFolder masks(folder);
  RgbdFrame half = frame(0, 1.0);
  half.gray = cv::Mat1b::zeros(15, 20);
  const auto found = masks.detect(half);
  ASSERT_EQ(found.size(), 1U);
  EXPECT_EQ(found[0].box, cv::Rect(3, 5, 4, 4));
}

TEST_F(MaskFolderTest, FolderWithoutMasksIsAnError) {
  EXPECT_THROW(MaskFolder{folder}, Error);
  EXPECT_THROW(MaskFolder{folder / "none"}, Error);
}

TEST(InstancesOfMask, OnePerConnectedRegionAndValueBySize) {
  cv::Mat1b mask = cv::Mat1b::zeros(60, 80);
  cv::circle(mask, {15, 15}, 10, 255, -1);  // a person
  mask(cv::Rect(50, 10, 6, 20)) = 255;      // another, smaller
  mask(cv::Rect(56, 10, 20, 40)) = 128;     // An adjacent object, the largest.
  mask(cv::Rect(2, 50, 3, 3)) = 255;        // a speck
  const auto found = instances_of_mask(mask);
  ASSERT_EQ(found.size(), 3U);
  EXPECT_EQ(found[0].class_name, "unknown");
  EXPECT_EQ(found[0].box, cv::Rect(56, 10, 20, 40));
  EXPECT_EQ(found[1].class_name, "person");
  EXPECT_EQ(found[1].box, cv::Rect(5, 5, 21, 21));
  EXPECT_EQ(cv::norm(found[1].mask, mask(found[1].box)), 0);
  EXPECT_EQ(found[2].box, cv::Rect(50, 10, 6, 20));
  EXPECT_EQ(found[2].class_id, 0);
}

}  // namespace
}  // namespace stillmap
