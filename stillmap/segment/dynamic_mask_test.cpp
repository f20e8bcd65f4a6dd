// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/dynamic_mask.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

SegmentedFrame person_and_chair() {
  SegmentedFrame frame;
  cv::Mat mask = cv::Mat::zeros(10, 20, CV_8UC1);
  mask(cv::Rect(5, 0, 5, 10)) = 255;
  frame.instances.push_back({0, "person", 0.9F, cv::Rect(30, 40, 20, 10), mask});
  frame.instances.push_back({56, "chair", 0.5F, cv::Rect(90, 90, 8, 8), {}});
  return frame;
}

TEST(DynamicMask, DrawsTheMaskOrTheBoxOfTheNamedClasses) {
  const cv::Size size(100, 100);
  cv::Mat1b person = cv::Mat1b::zeros(size), both = cv::Mat1b::zeros(size);
  person(cv::Rect(35, 40, 5, 10)) = 255;
  both = person.clone();
  both(cv::Rect(90, 90, 8, 8)) = 255;
  const auto frame = person_and_chair();
  EXPECT_EQ(cv::norm(dynamic_mask(frame, {"person"}, size), person), 0);
  EXPECT_EQ(cv::norm(dynamic_mask(frame, {"person", "chair"}, size), both), 0);
  EXPECT_EQ(cv::countNonZero(dynamic_mask(frame, {}, size)), 0);
  EXPECT_EQ(cv::countNonZero(dynamic_mask(frame, {"cat"}, size)), 0);
}

TEST(DynamicMask, BoxesThatLeaveTheImageAreClipped) {
  const auto mask = dynamic_mask(person_and_chair(), {"person", "chair"}, {93, 45});
  EXPECT_EQ(cv::boundingRect(mask), cv::Rect(35, 40, 5, 5));
}

}  // namespace
}  // namespace stillmap
