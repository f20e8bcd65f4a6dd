// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/mover_error.hpp"
#include "stillmap/evaluate/world_alignment.hpp"
#include "stillmap/motion/true_frame_test.hpp"
#include "stillmap/pipeline/slam_system.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns all samples of the tracks in the form of the evaluation.
std::vector<MoverPosition> positions_of(const std::vector<MoverTrack>& tracks) {
  std::vector<MoverPosition> positions;
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& s : track.samples) {
      positions.push_back({.timestamp = s.timestamp,
                           .id = track.id,
                           .class_name = track.class_name,
                           .centroid = s.centroid,
                           .velocity = s.velocity,
                           .observed = s.observed,
                           .box = s.box});
    }
  }
  return positions;
}

struct Outcome {
  SlamResult result;
  MoverErrors errors;
};

/// Runs the whole system without a network on a rendered scene.
Outcome run(const SimulationOptions& scene) {
  const SimulatedSequence sequence(scene);
  SlamParameters options;
  options.orb.keypoints = 600;
  options.dense_cloud = false;
  SlamSystem slam(sequence.camera(), options);
  std::vector<MoverPosition> truth;
  for (std::size_t i = 0; i < sequence.frames(); ++i) {
    const SimulatedFrame made = sequence.at(i);
    slam.push(made.frame);
    for (const MoverTruth& m : made.truth.movers) {
      truth.push_back({made.truth.timestamp, m.id, m.class_name, m.centroid, m.velocity, true,
                       m.pixels * 4, m.shown, m.box});  // pixels as of 640 x 480
    }
  }
  Outcome outcome{slam.finish(), {}};
  const Pose T_truth_estimate = align_poses(sequence.trajectory(), outcome.result.trajectory);
  outcome.errors =
      compare_movers(truth, positions_of(outcome.result.movers), T_truth_estimate, 0, 1e9);
  return outcome;
}

TEST(Movers, ObjectsOfUnknownClassAreTrackedWithoutANetwork) {
  const Outcome done = run(test::near_movers(0, 3));
  ASSERT_GT(done.errors.matches, 100U);
  EXPECT_LT(done.errors.position_shown.median, 0.12);
  EXPECT_LT(done.errors.position.median, 0.2) << "parts of them are occluded or out of the image";
  EXPECT_LT(done.errors.velocity.median, 0.5);
  EXPECT_LE(done.errors.switches, 3U);
  EXPECT_LE(done.errors.false_tracks, 1U);
  for (const MoverTrack& track : done.result.movers) EXPECT_EQ(track.class_name, "unknown");
}

TEST(Movers, AStaticSceneHasNoMovers) {
  EXPECT_TRUE(run(test::near_movers(0, 0)).result.movers.empty());
}

/// Returns a tracked frame with the true pose and the true motion labels.
TrackedFramePtr true_frame(const SimulatedSequence& sequence, std::size_t index, TrackState state) {
  const TruthFrame truth = sequence.truth(index);
  auto tracked = std::make_shared<TrackedFrame>();
  tracked->frame = test::true_frame(sequence, truth);
  tracked->state = state;
  tracked->T_world_camera = truth.T_world_camera;
  return tracked;
}

TEST(MoverStream, TheTracksEndWhereANewMapBegins) {
  const SimulatedSequence sequence(test::near_movers(0, 3));
  MoverStream movers(MoverOptions{}, false);
  constexpr std::size_t kNewMap = 30;
  for (std::size_t i = 0; i < 60; ++i) {
    const TrackState state = i == kNewMap ? TrackState::kStarted : TrackState::kTracking;
    movers.push(true_frame(sequence, i, state));
  }
  movers.finish();
  const auto tracks = movers.tracks([&](std::size_t i) { return sequence.T_world_camera(i); });
  const double begun = sequence.truth(kNewMap).timestamp;
  std::size_t before = 0, after = 0;
  for (const MoverTrack& track : tracks) {
    before += track.last_seen < begun;
    after += track.first_seen >= begun;
  }
  EXPECT_GT(before, 0U);
  EXPECT_GT(after, 0U);
  EXPECT_EQ(before + after, tracks.size()) << "none goes on";
}

}  // namespace
}  // namespace stillmap
