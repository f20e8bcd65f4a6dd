// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/evaluate/mover_error.hpp"
#include "stillmap/motion/true_frame_test.hpp"
#include "stillmap/pipeline/mover_files.hpp"
#include "stillmap/pipeline/slam_system.hpp"

#include <filesystem>
#include <sstream>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

MoverSample sample(std::size_t frame, bool observed, bool moves) {
  MoverSample s;
  s.frame_index = frame;
  s.timestamp = 1311868164 + static_cast<double>(frame) / 32;
  s.observed = observed;
  s.moves = moves;
  s.centroid = {1.25, -0.5, 3 + 0.01 * static_cast<double>(frame)};
  s.velocity = {0, 0.125, 0.32};
  s.surface = {s.centroid - Eigen::Vector3d(0.2, 0.8, 0.1),
               s.centroid + Eigen::Vector3d(0.2, 0.8, 0.1)};
  s.box = {s.surface.min(), s.surface.max() + Eigen::Vector3d(0, 0, 0.2)};
  return s;
}

std::vector<MoverTrack> two_tracks() {
  MoverTrack a{1, "person", 0.75, 0, 0, {sample(0, true, true), sample(1, false, false)}};
  MoverTrack b{2, "unknown", 0, 0, 0, {sample(1, true, false)}};
  for (MoverTrack* track : {&a, &b}) {
    track->first_seen = track->samples.front().timestamp;
    track->last_seen = track->samples.back().timestamp;
  }
  return {a, b};
}

TEST(MoverFiles, TheTableIsReadBackAsItWasWritten) {
  const std::filesystem::path file = test::own_path("movers_roundtrip.csv");
  const std::vector<MoverTrack> tracks = two_tracks();
  write_file(file, movers_csv(tracks));
  const std::vector<MoverPosition> read = read_movers(file);
  std::filesystem::remove(file);
  ASSERT_EQ(read.size(), 3U);
  const MoverSample& first = tracks[0].samples[0];
  EXPECT_EQ(read[0].id, 1);
  EXPECT_EQ(read[0].class_name, "person");
  EXPECT_NEAR(read[0].timestamp, first.timestamp, 1e-6);
  EXPECT_LT((read[0].centroid - first.centroid).norm(), 1e-4);
  EXPECT_LT((read[0].velocity - first.velocity).norm(), 1e-4);
  EXPECT_LT((read[0].box.max() - first.box.max()).norm(), 1e-4);
  EXPECT_TRUE(read[0].observed);
  EXPECT_FALSE(read[1].observed) << "predicted";
  EXPECT_TRUE(read[2].observed) << "standing";
}

TEST(MoverFiles, EachLineIsAFrame) {
  std::istringstream lines(movers_jsonl(two_tracks()));
  std::vector<nlohmann::json> frames;
  for (std::string line; std::getline(lines, line);) frames.push_back(nlohmann::json::parse(line));
  ASSERT_EQ(frames.size(), 2U);
  ASSERT_EQ(frames[1]["movers"].size(), 2U);
  const nlohmann::json& mover = frames[1]["movers"][1];
  EXPECT_EQ(mover["id"], 2);
  EXPECT_EQ(mover["class"], "unknown");
  EXPECT_EQ(mover["state"], "standing");
  EXPECT_EQ(mover["velocity"][2], 0.32);
  EXPECT_EQ(mover["box"][1].size(), 3U);
}

TEST(MoverFiles, NothingMovesNoLines) {
  EXPECT_EQ(movers_jsonl({}), "");
  const std::filesystem::path file = test::own_path("no_movers.csv");
  write_file(file, movers_csv({}));
  EXPECT_TRUE(read_movers(file).empty());
  std::filesystem::remove(file);
}

struct Outcome {
  SlamResult result;
  MoverErrors errors;
};

/// The whole system without a network on a rendered scene.
Outcome run(const SimulationOptions& scene) {
  const SimulatedSequence sequence(scene);
  SlamOptions options;
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
  const std::filesystem::path file = test::own_path("movers_run.csv");
  write_file(file, movers_csv(outcome.result.movers));
  const Pose T_truth_estimate = align_poses(sequence.trajectory(), outcome.result.trajectory);
  outcome.errors = compare_movers(truth, read_movers(file), T_truth_estimate, 0, 1e9);
  std::filesystem::remove(file);
  return outcome;
}

TEST(Movers, ThingsOfNoClassAreTrackedWithoutANetwork) {
  const Outcome done = run(test::near_movers(0, 3));
  ASSERT_GT(done.errors.matches, 100U);
  EXPECT_LT(done.errors.position_shown.median, 0.12);
  EXPECT_LT(done.errors.position.median, 0.2) << "parts of them are hidden or out of the picture";
  EXPECT_LT(done.errors.velocity.median, 0.5);
  EXPECT_LE(done.errors.switches, 3U);
  EXPECT_LE(done.errors.false_tracks, 1U);
  for (const MoverTrack& track : done.result.movers) EXPECT_EQ(track.class_name, "unknown");
}

TEST(Movers, NothingMovesNoMovers) {
  EXPECT_TRUE(run(test::near_movers(0, 0)).result.movers.empty());
}

/// A frame of which the truth is known: what moves, and where the camera is.
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
