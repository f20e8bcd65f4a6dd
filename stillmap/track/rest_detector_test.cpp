// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/rest_detector.hpp"

#include "stillmap/track/rendered_track_test.hpp"

#include <algorithm>
#include <memory>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace rendered;  // NOLINT(google-build-using-namespace)

/// Returns a frame of a camera on a tripod, with the noise of its moment.
FramePtr at_rest(std::size_t index) {
  static const SimulatedSequence tripod({.people = 0,
                                         .camera = "static",
                                         .frames = 20,
                                         .width = 320,
                                         .height = 240,
                                         .seed = 3,
                                         .shake = 0});
  static std::vector<FramePtr> frames(tripod.frames());
  if (!frames.at(index)) frames.at(index) = frame_of(tripod.frame(index));
  return frames.at(index);
}

/// Returns the features left of a column, as if somebody covered the rest.
Features left_of(const Features& features, float column) {
  Features left;
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (features.keypoints[i].u >= column) continue;
    left.keypoints.push_back(features.keypoints[i]);
    left.descriptors.push_back(features.descriptors[i]);
  }
  left.grid = KeypointGrid(left.keypoints, model().camera.width, model().camera.height);
  return left;
}

bool one_pose(const Features& a, const Features& b, bool all_over = true) {
  return compare_poses(model(), a, b, all_over) == PoseComparison::kSame;
}

TEST(RestDetector, TellsATripodFromAHandThatMoves) {
  EXPECT_TRUE(one_pose(*at_rest(0)->features, *at_rest(12)->features));
  for (std::size_t i = 1; i < 12; ++i)
    EXPECT_FALSE(one_pose(*frame(i)->features, *frame(0)->features)) << i;
}

TEST(RestDetector, WhatCoversMostOfTheViewHidesThatItIsOnePose) {
  const Features left = left_of(*at_rest(5)->features, 100);
  EXPECT_FALSE(one_pose(left_of(*at_rest(5)->features, 2), *at_rest(0)->features, false));
  EXPECT_TRUE(one_pose(left, *at_rest(0)->features, false));
  Features shifted = *at_rest(5)->features;  // all but the left move
  for (Keypoint& k : shifted.keypoints) k.u += k.u < 100 ? 0.0F : 20.0F;
  shifted.grid = KeypointGrid(shifted.keypoints, 320, 240);
  EXPECT_FALSE(one_pose(shifted, *at_rest(0)->features)) << "as a part that the camera carries";
  EXPECT_TRUE(one_pose(shifted, *at_rest(0)->features, false));
}

/// Returns the frame as tracked with this pose relative to the reference keyframe.
TrackedFrame tracked(const FramePtr& frame, const Pose& T_reference_camera) {
  TrackedFrame result;
  result.frame = frame;
  result.state = TrackState::kTracking;
  result.reference = local_map()->reference;
  result.T_reference_camera = T_reference_camera;
  return result;
}

double distance_from(const Pose& expected, const std::optional<PosePrior>& rest) {
  return (rest.value().T_world_camera.translation() - expected.translation()).norm();
}

TEST(RestDetector, ThePoseStaysThatOfTheFirstFrameAtRest) {
  RestDetector detector;
  const auto pose_of = [&](const Features& features) {
    return detector.pose(model(), features, *local_map());
  };
  EXPECT_FALSE(pose_of(*at_rest(0)->features));
  const Pose first(Eigen::Quaterniond::Identity(), {0.1, 0, 0});
  detector.add(tracked(at_rest(0), first));
  const Pose T_world_first = local_map()->keyframes.front().T_world_camera * first;
  for (std::size_t i = 1; i < 20; ++i) {
    EXPECT_LT(distance_from(T_world_first, pose_of(*at_rest(i)->features)), 1e-9) << i;
    const Pose drifted(Eigen::Quaterniond::Identity(), {0.1, 0, 0.01 * static_cast<double>(i)});
    detector.add(tracked(at_rest(i), drifted));
  }
  EXPECT_FALSE(pose_of(*blank(0)->features)) << "the view is covered";
  EXPECT_LT(distance_from(T_world_first, pose_of(left_of(*at_rest(3)->features, 100))), 1e-9);
  EXPECT_FALSE(pose_of(*frame(5)->features));
}

/// 0.02 pixels in ten frames are within the noise, and half a pixel in 250 are not.
TEST(RestDetector, ACameraThatCreepsDoesNotStayWhereItWas) {
  RestDetector detector;
  for (std::size_t i = 0; i < 250; ++i) {
    auto shifted = std::make_shared<Features>(*at_rest(0)->features);
    const double meters = 2e-5 * static_cast<double>(i);
    for (Keypoint& k : shifted->keypoints) k.u += static_cast<float>(100 * meters);
    const Pose true_motion(Eigen::Quaterniond::Identity(), {meters, 0, 0});
    if (const auto rest = detector.pose(model(), *shifted, *local_map())) {
      const Pose truth = local_map()->keyframes.front().T_world_camera * true_motion;
      EXPECT_LT(distance_from(truth, rest), 5e-4) << i;
    }
    auto frame = std::make_shared<Frame>(*at_rest(0));
    frame->features = shifted;
    detector.add(tracked(frame, true_motion));
  }
}

TEST(RestDetector, RestMayLastWhileTheViewIsCoveredForThreeSeconds) {
  RestDetector detector;
  EXPECT_FALSE(detector.may_last(0));
  for (std::size_t i = 0; i < 3; ++i) {
    detector.pose(model(), *at_rest(i)->features, *local_map());
    detector.add(tracked(at_rest(i), Pose()));
  }
  const double newest = at_rest(2)->timestamp();
  EXPECT_TRUE(detector.may_last(newest + 2.9));
  EXPECT_FALSE(detector.may_last(newest + 3.1));
  TrackedFrame start = tracked(at_rest(3), Pose());
  start.state = TrackState::kStarted;
  detector.add(start);
  EXPECT_FALSE(detector.may_last(newest + 0.1)) << "in another map";
}

}  // namespace
}  // namespace stillmap
