// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/orb_extractor.hpp"
#include "stillmap/map/local_map.hpp"
#include "stillmap/map/map.hpp"
#include "stillmap/map/relocalization_result.hpp"
#include "stillmap/motion/frame.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/track/pose_estimate.hpp"
#include "stillmap/track/tracker_state.hpp"

#include <memory>
#include <vector>

#include <gtest/gtest.h>

/// Rendered frames of a static office with known poses, and a local map made of one of them, for
/// the tests of this module.
namespace stillmap::rendered {

inline constexpr std::size_t kReference = 0;  ///< index of the frame that the map is made of

inline const SimulatedSequence& sequence() {
  static const SimulatedSequence made(
      {.people = 0, .camera = "xyz", .frames = 40, .width = 320, .height = 240, .seed = 3});
  return made;
}

inline Pose true_pose(std::size_t index) { return sequence().T_world_camera(index); }

inline TrackingModel model() { return {sequence().camera(), PyramidShape{}}; }

/// Returns a frame whose keypoints are all taken for static.
inline std::shared_ptr<Frame> frame_of(const RgbdFramePtr& image) {
  auto frame = std::make_shared<Frame>();
  frame->image = image;
  frame->cells = std::make_shared<CellGrid>(image->depth, sequence().camera());
  OrbExtractor orb({.keypoints = 600});
  frame->features = std::make_shared<Features>(orb.extract(image->gray, image->depth));
  frame->evidence.weight.assign(frame->features->size(), 1);
  frame->evidence.static_log_odds.assign(frame->features->size(), 1);
  return frame;
}

/// Returns frame `index` of the sequence, rendered once.
inline FramePtr frame(std::size_t index) {
  static std::vector<FramePtr> frames(sequence().frames());
  if (!frames.at(index)) frames.at(index) = frame_of(sequence().frame(index));
  return frames.at(index);
}

/// Returns a copy of frame `index` to be changed.
inline std::shared_ptr<Frame> changeable(std::size_t index) {
  return std::make_shared<Frame>(*frame(index));
}

/// Returns a frame that shows nothing, with the index of frame `index`.
inline FramePtr blank(std::size_t index) {
  auto image = std::make_shared<RgbdFrame>(*frame(index)->image);
  image->gray = cv::Mat(image->gray.size(), CV_8UC1, cv::Scalar(128));
  image->depth = cv::Mat(image->depth.size(), CV_32FC1, cv::Scalar(0));
  return frame_of(image);
}

/// Returns a frame of another place, with the index of frame `index`.
inline FramePtr elsewhere(std::size_t index) {
  static const SimulatedSequence other({.scene = "flat",
                                        .people = 0,
                                        .camera = "xyz",
                                        .frames = 40,
                                        .width = 320,
                                        .height = 240,
                                        .seed = 77});
  auto image = std::make_shared<RgbdFrame>(*other.frame(index));
  return frame_of(image);
}

/// Returns a local map of one keyframe at its true pose, with a landmark for each keypoint with
/// depth.
inline LocalMapPtr map_of(const FramePtr& keyframe, const Pose& T_world_camera) {
  Map map(sequence().camera(), PyramidShape{});
  Keyframe made;
  made.frame_index = keyframe->index();
  made.T_world_camera = T_world_camera;
  made.features = keyframe->features;
  made.static_weight.assign(keyframe->features->size(), 1);
  const KeyframeId id = map.add_keyframe(std::move(made)).id;
  for (std::uint32_t i = 0; i < keyframe->features->size(); ++i) {
    const Keypoint& k = keyframe->features->keypoints[i];
    if (k.depth <= 0) continue;
    map.add_landmark(T_world_camera * map.camera().unproject(k.u, k.v, k.depth), {id, i});
  }
  return make_local_map(map, id, {});
}

inline LocalMapPtr local_map() {
  static const LocalMapPtr made = map_of(frame(kReference), true_pose(kReference));
  return made;
}

/// Returns the state after the reference frame was tracked. Its landmarks are known.
inline TrackerState state_at_reference() {
  auto tracked = std::make_shared<TrackedFrame>();
  tracked->frame = frame(kReference);
  tracked->state = TrackState::kTracking;
  tracked->T_world_camera = true_pose(kReference);
  tracked->reference = local_map()->reference;
  tracked->landmarks = local_map()->keyframes.front().landmarks;
  TrackerState state;
  state.local_map = local_map();
  state.previous = tracked;
  state.T_world_previous = true_pose(kReference);
  return state;
}

/// Returns the relocalization of frame `index` in the map, at its true pose. Only the reference
/// frame knows its landmarks.
inline RelocalizationResult relocalization(std::size_t index) {
  RelocalizationResult result;
  result.frame = frame(index);
  result.local_map = local_map();
  result.T_reference_camera = true_pose(kReference).inverse() * true_pose(index);
  result.landmarks = index == kReference ? local_map()->keyframes.front().landmarks
                                         : std::vector<LandmarkId>(result.frame->features->size());
  return result;
}

/// Landmarks of one keyframe have the noise of a single depth image, some millimeters at 2 m.
inline void expect_pose(const Pose& estimate, std::size_t index, double meters = 0.015,
                        double radians = 0.006) {
  const Pose error = true_pose(index).inverse() * estimate;
  EXPECT_LT(error.translation().norm(), meters) << index;
  EXPECT_LT(error.angle(), radians) << index;
}

}  // namespace stillmap::rendered
