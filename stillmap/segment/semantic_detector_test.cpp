// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/semantic_detector.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/segment/make_detector.hpp"
#include "stillmap/segment/test_onnx.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

// A mask of 40 x 20 pixels with two persons side by side: the left one at 2 m, the right one at 3
// m.
struct SplitByDepth : testing::Test {
  cv::Mat1b mask = cv::Mat1b(20, 40, std::uint8_t{255});
  cv::Mat1f depth = cv::Mat1f(20, 40, 2.0F);
  cv::Rect left{0, 0, 20, 20}, right{20, 0, 20, 20};

  void SetUp() override { depth(right) = 3; }
  static cv::Rect bounds(const cv::Mat1b& object) { return cv::boundingRect(object); }
};

TEST_F(SplitByDepth, PersonsWhoTouchInTheImageAreTwo) {
  const auto objects = split_by_depth(mask, depth);
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(bounds(objects[0]), left);
  EXPECT_EQ(bounds(objects[1]), right);
}

TEST_F(SplitByDepth, AnArmInFrontOfTheBodyIsPartOfIt) {
  depth(right) = 2;
  depth(cv::Rect(5, 5, 12, 12)) = 1.6F;
  EXPECT_EQ(split_by_depth(mask, depth).size(), 1U);
}

TEST_F(SplitByDepth, ASmallPartFarBehindGoesToTheObjectNextToIt) {
  depth(right) = 2;
  depth(cv::Rect(35, 0, 5, 20)) = 4;  // a strip of the wall
  EXPECT_EQ(split_by_depth(mask, depth).size(), 1U);
}

TEST_F(SplitByDepth, PixelsWithoutDepthGoToTheNearestPiece) {
  depth(cv::Rect(18, 0, 6, 20)) = 0;
  const auto objects = split_by_depth(mask, depth);
  ASSERT_EQ(objects.size(), 2U);
  EXPECT_EQ(bounds(objects[0]), cv::Rect(0, 0, 21, 20));
  EXPECT_EQ(cv::countNonZero(objects[0]) + cv::countNonZero(objects[1]), 800);
}

TEST_F(SplitByDepth, WithoutDepthConnectedRegionsAreTheObjects) {
  mask(cv::Rect(19, 0, 2, 20)) = 0;
  depth = 0;
  EXPECT_EQ(split_by_depth(mask, depth).size(), 2U);
  mask = 0;
  EXPECT_TRUE(split_by_depth(mask, depth).empty());
}

// A network whose scores are the colors: red is background, green a person, blue a cat.
struct ColorNetwork : testing::Test {
  std::filesystem::path file = test::own_path("semantic.onnx");
  std::string names = "{0: 'background', 1: 'person', 2: 'cat'}";
  RgbdFrame frame;

  void SetUp() override {
    frame.color = cv::Mat(80, 160, CV_8UC3, cv::Scalar(0, 0, 255));
    frame.depth = cv::Mat1f(80, 160, 4.0F);
    frame.gray = cv::Mat1b::zeros(80, 160);
  }
  void TearDown() override { std::filesystem::remove(file); }
  std::unique_ptr<Detector> detector() const {
    write_file(file, test::tiny_model("Relu", {1, 16, 16, 3}, {1, 16, 16, 3}, {{"names", names}}));
    SegmentOptions options;
    options.model = file.string();
    return make_detector(options);
  }
  void paint(const cv::Rect& box, const cv::Scalar& bgr, float depth) {
    frame.color(box) = bgr;
    frame.depth(box) = depth;
  }
};

TEST_F(ColorNetwork, GivesTheObjectsOfEachClassWithTheirMasks) {
  const cv::Rect person(40, 20, 40, 60), other(80, 20, 20, 60), cat(120, 0, 30, 40);
  paint(person, {0, 255, 0}, 1.5F);
  paint(other, {0, 255, 0}, 2.5F);
  paint(cat, {255, 0, 0}, 2);
  auto found = detector()->detect(frame);
  ASSERT_EQ(found.size(), 3U);
  std::ranges::sort(found, {}, [](const Instance& i) { return i.box.x; });
  EXPECT_EQ(found[0].class_name, "person");
  EXPECT_EQ(found[0].box, person);
  EXPECT_EQ(cv::countNonZero(found[0].mask), person.area());
  EXPECT_EQ(found[1].class_name, "person");
  EXPECT_EQ(found[1].box, other);
  EXPECT_EQ(found[2].class_name, "cat");
  EXPECT_EQ(found[2].box, cat);
}

TEST_F(ColorNetwork, FramesWithoutDepthHaveObjectsToo) {
  paint({40, 20, 40, 60}, {0, 255, 0}, 1);
  frame.depth = cv::Mat();
  EXPECT_EQ(detector()->detect(frame).size(), 1U);
}

TEST_F(ColorNetwork, OtherNumbersOfClassesAreAnErrorThatSaysSo) {
  names = "{0: 'background', 1: 'person'}";
  try {
    detector();
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.problem(), testing::HasSubstr("3 classes, but the names of 2"));
    EXPECT_EQ(e.where(), file.string());
  }
}

}  // namespace
}  // namespace stillmap
