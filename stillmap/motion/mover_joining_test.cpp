// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/mover_joining.hpp"

#include "stillmap/motion/true_frame_test.hpp"

#include <cmath>
#include <functional>
#include <map>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr double kInterval = 1 / 30.0;

const cv::Vec3b kRed(40, 40, 180), kBlue(170, 60, 40), kGreen(50, 160, 60);

Appearance person(const cv::Vec3b& shirt, const cv::Vec3b& trousers) {
  Appearance appearance;
  for (int i = 0; i < 500; ++i) {
    appearance.add(Appearance::Part::kUpper, shirt);
    appearance.add(Appearance::Part::kLower, trousers);
  }
  return appearance;
}

const Appearance kAnna = person(kRed, kBlue), kBert = person(kGreen, kRed);

/// Returns a position per time [s].
using Path = std::function<Eigen::Vector3d(double)>;

Path walk(const Eigen::Vector3d& start, const Eigen::Vector3d& velocity) {
  return [=](double time) -> Eigen::Vector3d { return start + time * velocity; };
}

const Path kWalk = walk({-2, 0, 3}, {0.8, 0, 0});

/// Returns the track of a person who is detected in each frame of a time.
MoverTrack track(int id, double from, double to, const Path& path, const Appearance& appearance) {
  MoverTrack made;
  made.id = id;
  made.class_name = "person";
  made.class_confidence = 0.9;
  made.appearance = appearance;
  for (int i = static_cast<int>(std::lround(from / kInterval)); i * kInterval < to; ++i) {
    MoverSample sample;
    sample.frame_index = static_cast<std::size_t>(i);
    sample.timestamp = i * kInterval;
    sample.observed = sample.moves = true;
    sample.centroid = path(sample.timestamp);
    const Eigen::Vector3d half(0.2, 0.8, 0.2);
    sample.box = sample.surface = {sample.centroid - half, sample.centroid + half};
    made.samples.push_back(sample);
  }
  made.first_seen = made.samples.front().timestamp;
  made.last_seen = made.samples.back().timestamp;
  return made;
}

std::vector<int> ids(const std::vector<MoverTrack>& tracks) {
  std::vector<int> result;
  for (const MoverTrack& track : tracks) result.push_back(track.id);
  return result;
}

TEST(JoinedMovers, APersonHiddenForThreeSecondsIsOneTrack) {
  const MoverTrack before = track(1, 0, 2, kWalk, kAnna), after = track(2, 5, 7, kWalk, kAnna);
  const auto joined = joined_movers({before, after});
  ASSERT_THAT(ids(joined), ElementsAre(1));
  EXPECT_THAT(joined[0].samples, SizeIs(before.samples.size() + after.samples.size()))
      << "none while the person was hidden";
  EXPECT_EQ(joined[0].first_seen, before.first_seen);
  EXPECT_EQ(joined[0].last_seen, after.last_seen);
}

TEST(JoinedMovers, APersonWithOtherClothesIsAnother) {
  const auto joined = joined_movers({track(1, 0, 2, kWalk, kAnna), track(2, 5, 7, kWalk, kBert)});
  EXPECT_THAT(ids(joined), ElementsAre(1, 2));
}

TEST(JoinedMovers, TracksAtTwoPlacesAtTheSameTimeAreDifferentPeople) {
  const Path elsewhere = walk({-2, 0, 5}, {0.8, 0, 0});
  const auto joined =
      joined_movers({track(1, 0, 3, kWalk, kAnna), track(2, 2, 5, elsewhere, kAnna)});
  EXPECT_THAT(ids(joined), ElementsAre(1, 2));
}

TEST(JoinedMovers, APersonTooFarAwayIsAnother) {
  const Path far = walk({6, 0, 3}, {0.8, 0, 0});
  EXPECT_THAT(ids(joined_movers({track(1, 0, 2, kWalk, kAnna), track(2, 2.5, 5, far, kAnna)})),
              ElementsAre(1, 2));
}

TEST(JoinedMovers, AFewDetectionsElsewhereAreNoPartOfALaterTrack) {
  const Path still = walk({0, 0, 3}, {0, 0, 0});
  const MoverTrack few = track(1, 0, 0.1, walk({3, 0, 3}, {0, 0, 0}), kAnna);
  const auto joined = joined_movers({few, track(2, 3, 5, still, kAnna)});
  ASSERT_THAT(ids(joined), ElementsAre(2));
  EXPECT_THAT(ids(joined_movers({track(1, 0, 0.1, still, kAnna), track(2, 1, 3, still, kAnna)})),
              ElementsAre(1))
      << "seen again while a track lives";
}

TEST(JoinedMovers, AfterALongAbsenceItIsANewTrack) {
  EXPECT_THAT(ids(joined_movers({track(1, 0, 2, kWalk, kAnna), track(2, 14, 16, kWalk, kAnna)})),
              ElementsAre(1, 2));
}

TEST(JoinedMovers, AMapStartedAnewJoinsNothing) {
  MoverTrack after = track(2, 3, 5, kWalk, kAnna);
  after.world = 1;
  EXPECT_THAT(ids(joined_movers({track(1, 0, 2, kWalk, kAnna), after})), ElementsAre(1, 2));
}

TEST(JoinedMovers, TwoPeopleHiddenTogetherGetTheirOwnTracksByTheirColors) {
  // Both disappear at the same place, and the one who comes out first is the one who went in last.
  const Path back = walk({2.5, 0, 3}, {-0.5, 0, 0});
  const Path also_back = walk({2.3, 0, 3.6}, {-0.5, 0, 0});
  const auto joined =
      joined_movers({track(1, 0, 2, kWalk, kAnna), track(2, 0, 2.2, back, kBert),
                     track(3, 4, 6, kWalk, kBert), track(4, 4.2, 6, also_back, kAnna)});
  ASSERT_THAT(ids(joined), ElementsAre(1, 2));
  EXPECT_NEAR(joined[0].samples.back().centroid.z(), 3.6, 1e-9);
  EXPECT_NEAR(joined[1].samples.back().centroid.z(), 3, 1e-9);
}

TEST(JoinedMovers, PeopleInTheSameClothesAreNotMixedUp) {
  // Two people in the same clothes are visible at the same time, so that their colors tell nothing.
  const Path elsewhere = walk({-2, 0, 5}, {0, 0, 0.1});
  const auto joined = joined_movers({track(1, 0, 2, kWalk, kAnna), track(2, 0, 9, elsewhere, kAnna),
                                     track(3, 7, 9, walk({-4, 0, 3}, {0.1, 0, 0}), kAnna)});
  EXPECT_THAT(ids(joined), ElementsAre(1, 2, 3));
}

TEST(JoinedMovers, AnObjectDetectedTwiceIsOneTrack) {
  const Path arm = [](double time) -> Eigen::Vector3d {
    return kWalk(time) + Eigen::Vector3d(0.1, 0, 0);
  };
  const auto joined = joined_movers({track(1, 0, 3, kWalk, kAnna), track(2, 1, 4, arm, kBert)});
  ASSERT_THAT(ids(joined), ElementsAre(1));
  EXPECT_THAT(joined[0].samples, SizeIs(120)) << "one sample per frame";
  EXPECT_LT((joined[0].samples[50].centroid - kWalk(50 * kInterval)).norm(), 1e-9);
}

TEST(JoinedMovers, TracksThatTakeTurnsAreOne) {
  MoverTrack first = track(1, 0, 3, kWalk, kAnna);
  for (std::size_t i = 30; i < 60; ++i) first.samples[i].observed = false;
  const auto joined = joined_movers({first, track(2, 1.01, 1.99, kWalk, kAnna)});
  ASSERT_THAT(ids(joined), ElementsAre(1));
  EXPECT_THAT(joined[0].samples, SizeIs(90));
}

TEST(JoinedMovers, FragmentsAreLeftOutUnlessTheyAreFast) {
  const Path thrown = walk({-2, -1, 3}, {5, 0, 0});
  EXPECT_THAT(joined_movers({track(1, 0, 0.3, kWalk, kAnna)}), IsEmpty());
  EXPECT_THAT(ids(joined_movers({track(1, 0, 0.3, thrown, kAnna)})), ElementsAre(1));
}

/// Returns the ids of the tracks that are detected within 0.4 m of a person.
std::set<int> ids_near(int person, const SimulatedSequence& sequence,
                       const std::vector<MoverTrack>& tracks) {
  std::set<int> result;
  for (const MoverTrack& track : tracks) {
    for (const MoverSample& sample : track.samples) {
      if (!sample.observed) continue;
      for (const MoverTruth& truth : sequence.movers(sample.frame_index)) {
        if (truth.id == person && (sample.centroid - truth.centroid).norm() < 0.4)
          result.insert(track.id);
      }
    }
  }
  return result;
}

TEST(JoinedMovers, ARenderedPersonOutOfViewForTwoSecondsKeepsOneId) {
  SimulationOptions options = test::near_movers(3, 0);
  options.fps = 30;
  options.frames = 120;
  options.noise = false;
  const SimulatedSequence sequence(options);
  MoverDetector detector;
  MoverTracker tracker;
  std::map<int, std::vector<double>> seen;  // times at which each person is visible [s]
  for (std::size_t i = 0; i < sequence.frames(); ++i) {
    const SimulatedFrame made = sequence.at(i);
    const auto frame = test::true_frame(sequence, made.truth);
    frame->image = made.frame;
    tracker.update(i, made.truth.timestamp, made.truth.T_world_camera,
                   detector.detect(*frame, made.truth.T_world_camera).movers);
    for (const MoverTruth& person : made.truth.movers)
      if (person.pixels > 150) seen[person.id].push_back(made.truth.timestamp);
  }
  constexpr int kLeaving = 1;
  double absence = 0;
  for (std::size_t i = 1; i < seen[kLeaving].size(); ++i)
    absence = std::max(absence, seen[kLeaving][i] - seen[kLeaving][i - 1]);
  ASSERT_GT(absence, 1.9);
  const auto tracks = tracker.tracks([&](std::size_t i) { return sequence.T_world_camera(i); });
  ASSERT_THAT(ids_near(kLeaving, sequence, tracks), SizeIs(2)) << "before and after";
  const auto joined = joined_movers(tracks);
  EXPECT_THAT(ids_near(kLeaving, sequence, joined), SizeIs(1));
  EXPECT_THAT(joined, SizeIs(3));
}

}  // namespace
}  // namespace stillmap
