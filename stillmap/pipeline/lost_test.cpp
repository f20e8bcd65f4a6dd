// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/recording_test.hpp"
#include "stillmap/simulate/board.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using recorded::Recording, recorded::recording, recorded::small_options, recorded::black;

RgbdFramePtr darkened(const RgbdFramePtr& frame) {
  auto dark = std::make_shared<RgbdFrame>(*frame);
  dark->gray = black(dark->gray);
  dark->color = black(dark->color);
  return dark;
}

/// Returns the frame with another index and timestamp.
RgbdFramePtr numbered(const RgbdFramePtr& frame, std::size_t index) {
  auto copy = std::make_shared<RgbdFrame>(*frame);
  copy->index = index;
  copy->timestamp = static_cast<double>(index) / 30;
  return copy;
}

/// Returns frames of another corner of the room, which the usual motions do not show.
std::vector<RgbdFramePtr> elsewhere(const Recording& recording, int frames) {
  auto scene = std::make_shared<Scene>(recording.sequence->scene());
  scene->viewpoint.position = {5.2, 1.0, 1.45};
  scene->viewpoint.target = {3.0, 0.1, 0.9};
  SimulationOptions options = recording.sequence->options();
  options.frames = frames;
  const SimulatedSequence sequence(options, recording.sequence->camera(), scene);
  std::vector<RgbdFramePtr> made;
  for (std::size_t i = 0; i < sequence.frames(); ++i) made.push_back(sequence.frame(i));
  return made;
}

/// Returns the distance between the pose of frame `frame` and the true pose of frame `shown`, in
/// the world of frame 0 [m].
double error_at(const SlamResult& result, const Recording& recording, std::size_t frame,
                std::size_t shown) {
  const double stamp = static_cast<double>(frame) / 30;
  const auto found =
      std::find_if(result.trajectory.begin(), result.trajectory.end(),
                   [&](const StampedPose& p) { return std::abs(p.timestamp - stamp) < 1e-3; });
  if (found == result.trajectory.end()) return 1e9;
  const Pose truth =
      recording.sequence->T_world_camera(0).inverse() * recording.sequence->T_world_camera(shown);
  const Pose estimate = result.trajectory.front().T_world_camera.inverse() * found->T_world_camera;
  return (truth.inverse() * estimate).translation().norm();
}

TEST(Lost, PointsOfThePreviousFrameConstrainThePoseIfLandmarksAreTooFew) {
  const Recording& rec = recording(0, "xyz");
  SlamParameters options = small_options("static");
  options.tracker.min_inliers = options.orb.keypoints + 1;  // more than a frame can have
  SlamSystem slam(rec.sequence->camera(), options);
  for (std::size_t i = 0; i < 60; ++i) EXPECT_TRUE(slam.push(rec.frames[i])) << "frame " << i;
  const SlamResult result = slam.finish();
  for (std::size_t i = 10; i < 60; i += 10) EXPECT_LT(error_at(result, rec, i, i), 0.02);
}

TEST(Lost, SecondsOfBlacknessAreBridged) {
  const Recording& rec = recording(0, "xyz");
  SlamSystem slam(rec.sequence->camera(), small_options("static"));
  for (std::size_t i = 0; i < 90; ++i) {
    const bool dark = i >= 20 && i < 70;
    const auto pose = slam.push(dark ? darkened(rec.frames[i]) : rec.frames[i]);
    EXPECT_EQ(pose.has_value(), !dark) << "frame " << i;
  }
  const SlamResult result = slam.finish();
  EXPECT_EQ(result.maps, 1U);
  EXPECT_FALSE(result.frames[35].reason.empty());
  for (std::size_t i = 70; i < 90; ++i) EXPECT_LT(error_at(result, rec, i, i), 0.02) << i;
}

TEST(Lost, PeopleInTheViewDoNotPreventRelocalization) {
  const Recording& empty = recording(0, "xyz");
  const Recording& rec = recording(3, "xyz");
  SlamParameters options = small_options("fused");
  SlamSystem slam(rec.sequence->camera(), options);
  int with_pose = 0;
  for (std::size_t i = 0; i < 90; ++i) {
    const bool dark = i >= 20 && i < 60;
    const auto& frame = i < 20 ? empty.frames[i] : rec.frames[i];
    with_pose += slam.push(dark ? darkened(frame) : frame).has_value() && i >= 60;
  }
  EXPECT_GE(with_pose, 25);
  const SlamResult result = slam.finish();
  for (std::size_t i = 66; i < 90; ++i) EXPECT_LT(error_at(result, rec, i, i), 0.03) << i;
}

/// A printed board is carried past in front of the camera, in frames [kComes, kGoes).
class BehindABoard : public ::testing::Test {
 protected:
  static constexpr std::size_t kComes = 20, kGoes = 65;
  static SlamResult run(const Board& board, const SlamParameters& options) {
    const Recording& rec = recording(0, "xyz");
    const Camera& camera = rec.sequence->camera();
    SlamSystem slam(camera, options);
    for (std::size_t i = 0; i < rec.frames.size(); ++i) {
      const bool there = i >= kComes && i < kGoes;
      const double since = (static_cast<double>(i) - kComes) / 30;
      slam.push(there ? behind(board, *rec.frames[i], camera, since) : rec.frames[i]);
    }
    return slam.finish();
  }
  static std::ptrdiff_t maps_begun(const SlamResult& result) {
    return std::count_if(result.frames.begin(), result.frames.end(),
                         [](const FrameRecord& f) { return f.state == TrackState::kStarted; });
  }
  static void expect_true_poses(const SlamResult& result) {
    constexpr double kMaxError = 0.03;  // [m]
    for (const FrameRecord& f : result.frames) {
      if (!f.has_pose()) continue;
      EXPECT_LT(error_at(result, recording(0, "xyz"), f.index, f.index), kMaxError) << f.index;
    }
  }
};

TEST_F(BehindABoard, TheRestOfTheViewIsEnough) {
  const SlamResult result = run({.share = 0.6}, small_options("fused"));
  EXPECT_EQ(result.tracked(), 90U);
  EXPECT_EQ(maps_begun(result), 1);
  expect_true_poses(result);
}

TEST_F(BehindABoard, NoMapIsBegunOnABoardThatCoversTheWholeView) {
  const SlamResult result = run({.share = 1}, small_options("fused"));
  EXPECT_EQ(maps_begun(result), 1) << "the board has enough keypoints for a map";
  EXPECT_EQ(result.maps, 1U);
  for (const FrameRecord& f : result.frames) {
    const bool covered = f.index >= kComes && f.index < kGoes;
    EXPECT_EQ(f.has_pose(), !covered) << f.index << ' ' << f.reason;
  }
  expect_true_poses(result);
}

TEST_F(BehindABoard, ABoardThatStaysBeginsAMap) {
  SlamParameters options = small_options("fused");
  options.tracker.new_map.occluded_patience = 15;
  options.tracker.new_map.patience = 5;
  const SlamResult result = run({.share = 1, .speed = 0}, options);
  const FrameRecord& last_lost = result.frames[kComes + 15 + 5 - 1];
  EXPECT_TRUE(last_lost.state == TrackState::kLost || last_lost.tracked_late);
  EXPECT_EQ(result.frames[kComes + 15 + 5].state, TrackState::kStarted);
}

/// The camera is carried to an unknown place in the dark, and back again.
TEST(Lost, ANewMapIsBegunAtAnUnknownPlaceAndTheOldPlaceIsRecognized) {
  const Recording& rec = recording(0, "xyz");
  const auto other = elsewhere(rec, 30);
  SlamSystem slam(rec.sequence->camera(), small_options("static"));
  std::size_t n = 0;
  for (std::size_t i = 0; i < 40; ++i) slam.push(numbered(rec.frames[i], n++));
  for (std::size_t i = 0; i < 30; ++i) {
    const bool pose = slam.push(numbered(other[i], n++)).has_value();
    EXPECT_EQ(pose, i >= 10) << i << ": a map begins after ten frames without recognition";
  }
  for (std::size_t i = 60; i < 90; ++i) slam.push(numbered(rec.frames[i], n++));
  const SlamResult result = slam.finish();
  EXPECT_EQ(result.maps, 2U);
  int relocalizations = 0;
  for (const FrameRecord& f : result.frames) {
    relocalizations += f.relocalized;
    EXPECT_TRUE(f.index >= 70 || !f.relocalized) << f.index;
  }
  EXPECT_EQ(relocalizations, 1);
  for (std::size_t i = 71; i < 100; ++i) EXPECT_LT(error_at(result, rec, i, i - 10), 0.02) << i;
}

}  // namespace
}  // namespace stillmap
