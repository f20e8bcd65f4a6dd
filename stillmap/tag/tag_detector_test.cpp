// SPDX-License-Identifier: Apache-2.0
#include "stillmap/tag/tag_detector.hpp"

#include "stillmap/base/error.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kCell = 12;  // pixels

/// Returns an upright tag whose image begins at a pixel of a gray image.
cv::Mat drawn(const std::string& family, std::uint32_t id, cv::Point at,
              cv::Mat on = cv::Mat(400, 480, CV_8UC1, cv::Scalar(128))) {
  cv::Mat enlarged;
  cv::resize(tag_image(family, id), enlarged, {}, kCell, kCell, cv::INTER_NEAREST);
  enlarged.copyTo(on(cv::Rect(at, enlarged.size())));
  return on;
}

TEST(TagDetector, FindsTheCornersOfEachFamily) {
  for (const std::string& family : tag_family_names()) {
    const cv::Rect border = tag_border(family);
    const std::vector<Tag> tags = TagDetector(family).detect(drawn(family, 5, {60, 80}));
    ASSERT_EQ(tags.size(), 1U) << family;
    EXPECT_EQ(tags[0].name.id, 5U) << family;
    EXPECT_EQ(tag_family_names()[tags[0].name.family], family);
    // Edges lie between pixels, so half a pixel before the first one of the border.
    const float left = 60 + kCell * border.x - .5F, top = 80 + kCell * border.y - .5F;
    const float right = left + kCell * border.width, bottom = top + kCell * border.height;
    const cv::Point2f expected[] = {{left, bottom}, {right, bottom}, {right, top}, {left, top}};
    for (int i = 0; i < 4; ++i)
      EXPECT_LT(cv::norm(tags[0].corners[i] - expected[i]), .3) << family << ", corner " << i;
  }
}

TEST(TagDetector, OrdersTagsByIdAndLeavesOutThoseThatAreThereTwice) {
  const TagDetector detector("tag36h11");
  const cv::Mat two = drawn("tag36h11", 3, {240, 100}, drawn("tag36h11", 7, {60, 100}));
  const std::vector<Tag> tags = detector.detect(two);
  ASSERT_EQ(tags.size(), 2U);
  EXPECT_EQ(tags[0].name.id, 3U);
  EXPECT_EQ(tags[1].name.id, 7U);
  EXPECT_TRUE(
      detector.detect(drawn("tag36h11", 7, {240, 220}, drawn("tag36h11", 7, {60, 100}))).empty());
}

TEST(TagDetector, FindsNoTagsOfOtherFamiliesAndInTinyImages) {
  EXPECT_TRUE(TagDetector("tag25h9").detect(drawn("tag36h11", 5, {60, 80})).empty());
  EXPECT_TRUE(TagDetector("tag36h11").detect({}).empty());
  for (const cv::Size size : {cv::Size(1, 1), cv::Size(3, 3), cv::Size(640, 2), cv::Size(16, 16)})
    EXPECT_TRUE(TagDetector("tag36h11").detect(cv::Mat(size, CV_8UC1, cv::Scalar(0))).empty());
}

TEST(TagDetector, RefusesUnknownFamiliesAndIds) {
  EXPECT_THROW(TagDetector("tag36h12"), Error);
  EXPECT_THROW(tag_image("tag16h5", 30), Error);
  EXPECT_NO_THROW(tag_image("tag16h5", 29));
}

}  // namespace
}  // namespace stillmap
