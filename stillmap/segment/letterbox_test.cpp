// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/letterbox.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Letterbox, WideImageIsPaddedAboveAndBelow) {
  const Letterbox letterbox({640, 320}, {320, 320});
  EXPECT_EQ(letterbox.inner, cv::Size(320, 160));
  EXPECT_EQ(letterbox.pad_x, 0);
  EXPECT_EQ(letterbox.pad_y, 80);
  const cv::Point2f corner = letterbox.to_input({640, 320});
  EXPECT_FLOAT_EQ(corner.x, 320);
  EXPECT_FLOAT_EQ(corner.y, 240);
}

TEST(Letterbox, ToImageInvertsToInput) {
  for (const cv::Size image : {cv::Size(640, 480), {1280, 720}, {333, 777}, {5, 900}}) {
    for (const cv::Size input : {cv::Size(640, 640), {320, 256}, {640, 480}}) {
      const Letterbox letterbox(image, input);
      const cv::Point2f p(static_cast<float>(image.width) * 0.3F,
                          static_cast<float>(image.height) * 0.8F);
      const cv::Point2f there = letterbox.to_input(p), back = letterbox.to_image(there);
      EXPECT_NEAR(back.x, p.x, 1e-3) << image << " in " << input;
      EXPECT_NEAR(back.y, p.y, 1e-3) << image << " in " << input;
      EXPECT_TRUE(cv::Rect2f(0, 0, input.width, input.height).contains(there));
    }
  }
}

TEST(Letterbox, FillsPlanesInRgbWithGrayAround) {
  const cv::Mat color(2, 4, CV_8UC3, cv::Scalar(255, 51, 0));  // blue, green, red
  std::vector<float> planes(3U * 16U);
  Letterbox({4, 2}, {4, 4}).fill(color, planes);
  const auto at = [&](int channel, int y) {
    return planes[static_cast<std::size_t>(channel * 16 + y * 4)];
  };
  EXPECT_FLOAT_EQ(at(0, 0), 114.0F / 255);  // above the image
  EXPECT_FLOAT_EQ(at(0, 1), 0);             // red
  EXPECT_FLOAT_EQ(at(1, 1), 0.2F);          // green
  EXPECT_FLOAT_EQ(at(2, 2), 1);             // blue
  EXPECT_FLOAT_EQ(at(2, 3), 114.0F / 255);  // below
}

TEST(Letterbox, OtherFormatsDifferInOrderOfChannelsAndInValues) {
  const cv::Mat color(2, 2, CV_8UC3, cv::Scalar(255, 51, 0));  // blue, green, red
  std::vector<float> values(12);
  const Letterbox whole({2, 2}, {2, 2});
  whole.fill(color, values, {.bgr = true, .scale = {1, 1, 1}});
  EXPECT_EQ(values, (std::vector<float>{255, 255, 255, 255, 51, 51, 51, 51, 0, 0, 0, 0}));
  constexpr float kScale = 2.0F / 255;
  whole.fill(color, values,
             {.channels_last = true, .scale = {kScale, kScale, kScale}, .offset = {-1, -1, -1}});
  for (std::size_t i = 0; i < 12; i += 3) {
    EXPECT_FLOAT_EQ(values[i], -1);
    EXPECT_NEAR(values[i + 1], -0.6F, 1e-6);
    EXPECT_NEAR(values[i + 2], 1, 1e-6);
  }
}

TEST(Letterbox, StretchedHasNoPaddingAndAnotherAspectRatio) {
  const auto whole = Letterbox::stretched({640, 480}, {256, 256});
  EXPECT_EQ(whole.inner, whole.input);
  EXPECT_EQ(whole.to_input({320, 240}), cv::Point2f(128, 128));
  EXPECT_EQ(whole.to_image({256, 256}), cv::Point2f(640, 480));
}

TEST(Letterbox, InTheCornerAllPaddingIsOnTheRightAndBelow) {
  const auto corner = Letterbox::in_corner({640, 320}, {320, 320});
  EXPECT_EQ(corner.inner, cv::Size(320, 160));
  EXPECT_EQ(corner.to_image({0, 0}), cv::Point2f(0, 0));
  EXPECT_EQ(corner.to_image({320, 160}), cv::Point2f(640, 320));
}

TEST(Letterbox, EachChannelHasItsOwnScaleAndOffset) {
  const cv::Mat color(1, 1, CV_8UC3, cv::Scalar(10, 20, 30));  // blue, green, red
  std::vector<float> values(3);
  const PixelFormat format{.scale = {1, 2, 3}, .offset = {5, 6, 7}};
  Letterbox({1, 1}, {1, 1}).fill(color, values, format);
  EXPECT_EQ(values, (std::vector<float>{97, 46, 15}));  // red, green, blue
}

}  // namespace
}  // namespace stillmap
