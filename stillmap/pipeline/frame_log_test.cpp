// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/frame_log.hpp"

#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// A tracked frame of ten keypoints, some of which move.
TrackedFrame frame_with_moving(std::size_t index, std::size_t moving) {
  constexpr std::size_t kKeypoints = 10;
  auto image = std::make_shared<RgbdFrame>();
  image->index = index;
  image->timestamp = 0.1 * static_cast<double>(index);
  auto features = std::make_shared<Features>();
  features->keypoints.resize(kKeypoints);
  auto frame = std::make_shared<Frame>();
  frame->image = image;
  frame->features = features;
  frame->evidence.weight.assign(kKeypoints, 1);
  std::fill_n(frame->evidence.weight.begin(), moving, 0.0F);
  TrackedFrame tracked;
  tracked.frame = frame;
  tracked.state = TrackState::kTracking;
  return tracked;
}

TEST(FrameLog, APoseIsUncertainIfNearlyAllKeypointsMove) {
  FrameLog log(true);
  for (const std::size_t moving : {0U, 5U, 7U, 8U, 10U})
    log.add(frame_with_moving(log.records().size(), moving), {});
  std::vector<bool> uncertain;
  for (const FrameRecord& record : log.records()) uncertain.push_back(record.uncertain());
  EXPECT_EQ(uncertain, (std::vector<bool>{false, false, false, true, true}));
}

TEST(FrameLog, TheNewestFrameThatKnowsItGivesTheUpwardDirection) {
  FrameLog log(true);
  const std::vector<std::optional<Eigen::Vector3d>> ups{Eigen::Vector3d::UnitX(),
                                                        -Eigen::Vector3d::UnitY(), std::nullopt};
  Trajectory poses;
  for (std::size_t i = 0; i < ups.size(); ++i) {
    TrackedFrame tracked = frame_with_moving(i, 0);
    tracked.up = ups[i];
    log.add(tracked, {});
    poses.push_back({tracked.frame->timestamp(), Pose(so3_exp({0, 0, 0.1}), {1, 2, 3})});
  }
  const auto up = upward(log.records(), poses);
  ASSERT_TRUE(up.has_value());
  EXPECT_LT((*up - so3_exp({0, 0, 0.1}) * -Eigen::Vector3d::UnitY()).norm(), 1e-12);
  poses.erase(poses.begin() + 1);
  EXPECT_FALSE(upward(log.records(), poses).has_value()) << "that frame has no pose";
  EXPECT_FALSE(upward({}, poses).has_value());
}

TEST(FrameLog, DetectedObjectsThatFillTheImageDoNotMakeAPoseUncertain) {
  constexpr std::size_t kKeypoints = 1000, kInBox = 850;
  auto features = std::make_shared<Features>();
  features->keypoints.resize(kKeypoints);
  for (std::size_t i = kInBox; i < kKeypoints; ++i) features->keypoints[i].u = 500;
  const auto with = [&](const cv::Rect& box, std::size_t moving) {
    TrackedFrame tracked = frame_with_moving(0, 0);
    auto frame = std::make_shared<Frame>(*tracked.frame);
    frame->features = features;
    frame->evidence.weight.assign(kKeypoints, 1);
    std::fill_n(frame->evidence.weight.begin(), moving, 0.0F);
    SegmentedFrame detected;
    detected.instances.emplace_back().box = box;
    frame->instances = std::make_shared<const SegmentedFrame>(detected);
    tracked.frame = frame;
    return uncertainty_of(tracked);
  };
  const cv::Rect person(0, 0, 400, 480), elsewhere(600, 0, 40, 480);
  EXPECT_EQ(with(person, kInBox), Uncertainty::kNone);
  EXPECT_EQ(with(elsewhere, kInBox), Uncertainty::kMinority);
  EXPECT_EQ(with(person, 980), Uncertainty::kMinority)
      << "most keypoints outside detected objects move";
}

}  // namespace
}  // namespace stillmap
