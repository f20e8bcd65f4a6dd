#include "stillmap/report/raster.hpp"

#include <algorithm>
#include <array>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

const cv::Vec3b kRed(0x45, 0x45, 0xd6);  // class "error" of the style sheet

int dark_pixels(const cv::Mat& image) {
  cv::Mat gray;
  cv::cvtColor(image, gray, cv::COLOR_BGR2GRAY);
  return cv::countNonZero(gray < 200);
}

TEST(Raster, DrawsALineInTheColorOfItsClass) {
  Raster raster(100, 60);
  raster.line({10, 30}, {90, 30}, "error");
  const cv::Mat3b image = raster.image();
  ASSERT_EQ(image.size(), cv::Size(100, 60));
  const auto distance = cv::norm(image(30, 50) - kRed);
  EXPECT_LT(distance, 160) << "nearly red: the line is one pixel wide and lies between two rows";
  EXPECT_EQ(image(20, 50), cv::Vec3b(255, 255, 255));
}

TEST(Raster, LeavesOutAnUnknownClass) {
  Raster raster(40, 40);
  raster.line({0, 20}, {40, 20}, "nothing");
  EXPECT_EQ(dark_pixels(raster.image()), 0);
}

TEST(Raster, ClipsToTheRectangle) {
  Raster raster(100, 100);
  raster.begin_clip(20, 20, 30, 30);
  raster.line({0, 35}, {100, 35}, "frame-start");
  raster.end_clip();
  const cv::Mat image = raster.image();
  EXPECT_EQ(dark_pixels(image.colRange(0, 19)) + dark_pixels(image.colRange(51, 100)), 0);
  EXPECT_GT(dark_pixels(image.colRange(20, 50)), 20);
}

TEST(Raster, AnchorsText) {
  for (const auto& [anchor, left, right] :
       {std::tuple{"start", 0, 1}, {"end", 1, 0}, {"middle", 1, 1}}) {
    Raster raster(200, 40);
    raster.text({100, 25}, "text", anchor, "heading");
    const cv::Mat image = raster.image();
    EXPECT_EQ(dark_pixels(image.colRange(0, 99)) > 0, left == 1) << anchor;
    EXPECT_EQ(dark_pixels(image.colRange(103, 200)) > 0, right == 1) << anchor;
  }
}

TEST(Raster, WritesTextUpwardsHigherThanWide) {
  Raster raster(100, 100);
  raster.text_upwards({50, 50}, "upwards");
  cv::Mat gray;
  cv::cvtColor(raster.image(), gray, cv::COLOR_BGR2GRAY);
  const cv::Rect box = cv::boundingRect(gray < 200);
  EXPECT_GT(box.height, 2 * box.width);
  EXPECT_NEAR(box.y + box.height / 2.0, 50, 6);
}

}  // namespace
}  // namespace stillmap
