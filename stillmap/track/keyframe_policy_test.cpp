// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/keyframe_policy.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

cv::Mat scene() {
  cv::Mat1b noise(120, 160);
  cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::Mat result;
  cv::GaussianBlur(noise, result, {}, 1.5);
  return result;
}

cv::Mat blurred(const cv::Mat& gray) {
  cv::Mat result;
  cv::blur(gray, result, {9, 1});
  return result;
}

/// Asks about a frame far away from the map's only keyframe: it is wanted, sharp enough provided.
bool wanted(KeyframePolicy& policy, const cv::Mat& gray) {
  auto image = std::make_shared<RgbdFrame>();
  image->gray = gray;
  auto features = std::make_shared<Features>();
  features->keypoints.push_back({.u = 80, .v = 60, .depth = 2});
  Frame frame;
  frame.image = image;
  frame.features = features;
  frame.evidence.weight = {1};
  LocalMap map;
  map.keyframes.emplace_back();
  return policy.wants_keyframe(frame, Pose(Eigen::Quaterniond::Identity(), {1, 0, 0}),
                               {LandmarkId{}}, map, 100);
}

TEST(KeyframePolicy, KeepsASharpFrameFromSomewhereNew) {
  KeyframePolicy policy({}, {});
  EXPECT_TRUE(wanted(policy, scene()));
}

TEST(KeyframePolicy, WaitsForASharperFrameThanABlurredOne) {
  KeyframePolicy policy({}, {});
  for (int i = 0; i < 10; ++i) wanted(policy, scene());
  EXPECT_FALSE(wanted(policy, blurred(scene())));
  EXPECT_TRUE(wanted(policy, scene()));
}

TEST(KeyframePolicy, DoesNotWaitForEver) {
  KeyframePolicy policy({}, {});
  for (int i = 0; i < 15; ++i) wanted(policy, scene());
  for (int i = 0; i < KeyframePolicy::kMaxWait; ++i)
    EXPECT_FALSE(wanted(policy, blurred(scene()))) << i;
  EXPECT_TRUE(wanted(policy, blurred(scene())));
}

}  // namespace
}  // namespace stillmap
