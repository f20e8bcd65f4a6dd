// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/keypoint_flow.hpp"

#include "stillmap/motion/test_frames.hpp"

#include <cstring>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Size kSize(320, 240);

/// Two frames of one texture, the second moved.
struct Pair {
  RgbdFramePtr first, second;
  Pair(double dx, double dy)
      : first(test::image_of(0, test::moved_texture(kSize, 1, 0, 0))),
        second(test::image_of(1, test::moved_texture(kSize, 1, dx, dy))) {}
  MotionInput input(const std::vector<cv::Point2f>& before,
                    const std::vector<cv::Point2f>& now) const {
    return test::input_of(second, test::keypoints_at(now), nullptr,
                          test::frame_of(first, test::keypoints_at(before)));
  }
};

const std::vector<cv::Point2f> kInner = test::lattice({cv::Point(), kSize}, 17, 30);

void expect_flow(const KeypointFlow& flow, cv::Point2f truth) {
  ASSERT_EQ(flow.size(), kInner.size());
  std::size_t good = 0;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] != 0 && cv::norm(flow.flow(i) - truth) < 0.2) ++good;
  }
  EXPECT_GE(good, flow.size() * 97 / 100);
}

TEST(FlowTracker, MeasuresAKnownMovementInBothDirections) {
  const cv::Point2f moved(7.4F, -3.2F);
  const Pair pair(moved.x, moved.y);
  FlowTracker tracker(9);
  const auto input = pair.input(kInner, kInner);
  const KeypointFlow back = tracker.to_previous(input);
  expect_flow(back, moved);
  EXPECT_EQ(back.now, kInner);
  const KeypointFlow ahead = tracker.from_previous(input);
  expect_flow(ahead, moved);
  EXPECT_EQ(ahead.before, kInner);
}

TEST(FlowTracker, PointsThatCameFromOutsideAreLost) {
  const Pair pair(12, 0);
  FlowTracker tracker(5);
  std::vector<cv::Point2f> at_the_border;  // up to 12 pixels outside in the first frame
  for (int i = 0; i < 110; ++i) {
    at_the_border.emplace_back(static_cast<float>(i % 11), 10.0F + 2.0F * static_cast<float>(i));
  }
  const KeypointFlow border = tracker.to_previous(pair.input({}, at_the_border));
  for (std::size_t i = 0; i < border.size(); ++i) {
    EXPECT_TRUE(border.found[i] == 0 || border.before[i].x >= 0) << i;
  }
  EXPECT_GT(std::count(border.found.begin(), border.found.end(), 0), 50);
  EXPECT_EQ(tracker.to_previous(pair.input({}, {{160, 120}})).found[0], 1);
}

TEST(FlowTracker, WithoutAPreviousFrameAllAreLost) {
  FlowTracker tracker(5);
  const MotionInput input =
      test::input_of(test::image_of(0, test::texture(kSize, 1)), test::keypoints_at(kInner));
  const KeypointFlow flow = tracker.to_previous(input);
  EXPECT_EQ(std::count(flow.found.begin(), flow.found.end(), 0),
            static_cast<std::ptrdiff_t>(kInner.size()));
  EXPECT_EQ(tracker.from_previous(input).size(), 0U);
}

bool same_bits(const std::vector<cv::Point2f>& a, const std::vector<cv::Point2f>& b) {
  return a.size() == b.size() && std::memcmp(a.data(), b.data(), a.size() * sizeof(a[0])) == 0;
}

TEST(FlowTracker, GivesTheSameBitsForOneThreadAndMany) {
  const Pair pair(5.5, 2.5);
  const auto input = pair.input(kInner, kInner);
  const int threads = cv::getNumThreads();
  cv::setNumThreads(1);
  const auto one = FlowTracker(5).to_previous(input);
  cv::setNumThreads(4);
  const auto many = FlowTracker(5).to_previous(input);
  cv::setNumThreads(threads);
  EXPECT_TRUE(same_bits(one.before, many.before));
  EXPECT_EQ(one.found, many.found);
}

TEST(FlowTracker, DoesNotDependOnEarlierCalls) {
  const Pair pair(5.5, 2.5), other(-4, 9);
  const auto input = pair.input(kInner, kInner);
  FlowTracker used(5);
  used.to_previous(other.input(kInner, kInner));
  used.from_previous(input);
  const auto again = used.to_previous(input);
  EXPECT_TRUE(same_bits(again.before, FlowTracker(5).to_previous(input).before));
}

TEST(FlowTracker, FlatImagesAndOtherSizesHaveNoFlow) {
  FlowTracker tracker(5);
  const cv::Mat1b flat(kSize, static_cast<std::uint8_t>(90));
  const auto before = test::frame_of(test::image_of(0, flat), test::keypoints_at(kInner));
  const auto lost_all = [&](const cv::Mat1b& gray) {
    const auto flow = tracker.to_previous(
        test::input_of(test::image_of(1, gray), test::keypoints_at(kInner), nullptr, before));
    return std::count(flow.found.begin(), flow.found.end(), 1) == 0;
  };
  EXPECT_TRUE(lost_all(flat.clone()));
  EXPECT_TRUE(lost_all(test::texture({400, 300}, 1)));
}

}  // namespace
}  // namespace stillmap
