// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/mover_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/evaluate/mover_error.hpp"

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

TEST(MoverFiles, TracksAreReadBackAsTheyWereWritten) {
  const std::filesystem::path file = test::own_path("mover_tracks.csv");
  const std::vector<MoverTrack> written = two_tracks();
  write_file(file, movers_csv(written));
  const std::vector<MoverTrack> read = read_mover_tracks(file);
  std::filesystem::remove(file);
  ASSERT_EQ(read.size(), 2U);
  ASSERT_EQ(read[0].samples.size(), 2U);
  EXPECT_EQ(read[1].id, 2);
  EXPECT_EQ(read[1].class_name, "unknown");
  EXPECT_FALSE(read[0].samples[1].observed);
  EXPECT_LT((read[0].samples[1].centroid - written[0].samples[1].centroid).norm(), 1e-4);
  EXPECT_LT((read[0].samples[1].box.min() - written[0].samples[1].box.min()).norm(), 1e-4);
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

TEST(MoverFiles, WithoutMoversThereAreNoLines) {
  EXPECT_EQ(movers_jsonl({}), "");
  const std::filesystem::path file = test::own_path("no_movers.csv");
  write_file(file, movers_csv({}));
  EXPECT_TRUE(read_movers(file).empty());
  std::filesystem::remove(file);
}

}  // namespace
}  // namespace stillmap
