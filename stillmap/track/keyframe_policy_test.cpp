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

/// Returns whether a frame at the pose of the reference is wanted as a keyframe. It observes
/// `shown` of the reference's 100 landmarks, each of which has `observations` observations.
bool wanted_of_landmarks(int observations, int shown, int min_views) {
  LocalMap map;
  map.keyframes.resize(3);
  for (std::uint32_t i = 0; i < 100; ++i) {
    const Eigen::Vector3d p(0, 0, 4);
    map.landmarks.push_back({LandmarkId{i, 1}, p, p, 0, 0, {}, observations, 0});
    map.keyframes.front().landmarks.push_back(LandmarkId{i, 1});
  }
  auto image = std::make_shared<RgbdFrame>();
  image->gray = scene();
  auto features = std::make_shared<Features>();
  features->keypoints.resize(100, {.u = 80, .v = 60, .depth = 4});
  Frame frame;
  frame.image = image;
  frame.features = features;
  frame.evidence.weight.assign(100, 1);
  std::vector<LandmarkId> landmarks(100);
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(shown); ++i)
    landmarks[i] = LandmarkId{i, 1};
  KeyframePolicyOptions options;
  options.min_views = min_views;
  return KeyframePolicy(options, {}).wants_keyframe(frame, Pose(), landmarks, map, 100);
}

TEST(KeyframePolicy, KeepsAFrameThatShowsFewOfTheReferencesLandmarks) {
  EXPECT_TRUE(wanted_of_landmarks(2, 70, 2));
  EXPECT_FALSE(wanted_of_landmarks(2, 80, 2));
  EXPECT_TRUE(wanted_of_landmarks(3, 70, 3));
}

TEST(KeyframePolicy, LandmarksOfFewKeyframesMayFail) {
  EXPECT_FALSE(wanted_of_landmarks(1, 70, 2)) << "nothing has confirmed them";
  EXPECT_FALSE(wanted_of_landmarks(2, 70, 3));
}

}  // namespace
}  // namespace stillmap
