// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_folder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"

#include <fstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>
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
    cv::imwrite((folder / name).string(), mask);
  }
  static RgbdFrame frame(std::size_t index, double stamp) {
    RgbdFrame frame;
    frame.index = index;
    frame.timestamp = stamp;
    frame.gray = cv::Mat1b::zeros(30, 40);
    return frame;
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

TEST_F(MaskFolderTest, WrongSizeDamagedFileAndColorAreSkipped) {
  cv::imwrite((folder / "1.png").string(), cv::Mat1b(10, 10, 255));
  std::ofstream(folder / "2.png") << "not an image";
  cv::imwrite((folder / "3.png").string(), cv::Mat(30, 40, CV_8UC3, cv::Scalar::all(255)));
  cv::imwrite((folder / "4.png").string(), cv::Mat(30, 40, CV_16UC1, cv::Scalar::all(255)));
  MaskFolder masks(folder);
  for (const double stamp : {1.0, 2.0, 3.0, 4.0})
    EXPECT_TRUE(masks.detect(frame(0, stamp)).empty());
  EXPECT_EQ(masks.unusable(), 4U);
  EXPECT_THAT(masks.skipped(), testing::HasSubstr("4 masks damaged"));
  EXPECT_EQ(masks.missing(), 0U);
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
