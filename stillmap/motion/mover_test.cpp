// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/statistics.hpp"
#include "stillmap/motion/mover_tracker.hpp"
#include "stillmap/motion/test_frames.hpp"
#include "stillmap/motion/true_frame_test.hpp"

#include <cmath>
#include <limits>
#include <set>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using ::testing::IsEmpty;
using ::testing::SizeIs;

constexpr float kNan = std::numeric_limits<float>::quiet_NaN();

/// A camera of 320 x 240 pixels with a wall at 5 m and upright slabs in front of it.
struct Stage {
  Camera camera = test::small_camera();
  std::shared_ptr<RgbdFrame> image = std::make_shared<RgbdFrame>();
  cv::Mat moving;
  std::shared_ptr<SegmentedFrame> instances = std::make_shared<SegmentedFrame>();

  Stage() {
    image->depth = cv::Mat(240, 320, CV_32FC1, cv::Scalar(5));
    image->gray = cv::Mat(240, 320, CV_8UC1, cv::Scalar(0));
    moving = cv::Mat(240, 320, CV_8UC1, cv::Scalar(0));
  }
  void put(const cv::Rect& box, float depth, bool moves = true) {
    image->depth(box).setTo(depth);
    moving(box).setTo(moves ? 255 : 0);
  }
  void name(const cv::Rect& box, const std::string& class_name, float confidence = 0.8F) {
    Instance instance;
    instance.class_name = class_name;
    instance.confidence = confidence;
    instance.box = box;
    instance.mask = cv::Mat(box.size(), CV_8UC1, cv::Scalar(255));
    instances->instances.push_back(instance);
  }
  Frame frame() const {
    Frame frame;
    frame.image = image;
    frame.cells = std::make_shared<CellGrid>(image->depth, camera);
    frame.evidence.moving_pixels = moving;
    frame.instances = instances;
    frame.instance_cells = instance_cells(frame.instances, *frame.cells);
    return frame;
  }
  MoverDetections find(const Pose& T_world_camera = Pose()) const {
    MoverDetector detector;
    return detector.detect(frame(), T_world_camera);
  }
};

TEST(MoverDetector, EstimatesTheCentroidOfASlabBehindItsSurface) {
  Stage stage;
  stage.put({140, 60, 40, 120}, 2);  // 0.30 m wide, 0.91 m high
  const Pose T_world_camera(so3_exp({0.1, -0.4, 0.2}), {1, 2, 3});
  const auto found = stage.find(T_world_camera).movers;
  ASSERT_THAT(found, SizeIs(1));
  const Eigen::Vector3d p = T_world_camera.inverse() * found[0].surface_mean;
  EXPECT_LT((p - Eigen::Vector3d(0, 0, 2)).norm(), 0.02);
  const Eigen::Vector3d behind = T_world_camera.inverse() * found[0].centroid - p;
  EXPECT_NEAR(behind.z(), 0.785 * 0.15, 0.02) << "pi/4 of half the width";
  EXPECT_TRUE(found[0].box.contains(found[0].centroid));
  EXPECT_TRUE(found[0].box.contains(found[0].surface));
  EXPECT_EQ(found[0].class_name, "unknown");
  EXPECT_FALSE(found[0].cut_off);
}

TEST(MoverDetector, SplitsAtDepthJumpsAndBetweenInstances) {
  Stage stage;
  stage.put({40, 60, 40, 120}, 2);
  stage.put({80, 60, 40, 120}, 3);   // next to it in the image, but behind it
  stage.put({200, 60, 40, 120}, 2);  // two slabs side by side
  stage.put({240, 60, 40, 120}, 2.05F);
  EXPECT_THAT(stage.find().movers, SizeIs(3));
  stage.name({200, 60, 40, 120}, "person");
  stage.name({240, 60, 40, 120}, "chair");  // divided by its instance although it is near
  MoverDetector detector;
  const auto found = detector.detect(stage.frame(), Pose()).movers;
  ASSERT_THAT(found, SizeIs(4));
  std::multiset<std::string> names;
  for (const auto& mover : found) names.insert(mover.class_name);
  EXPECT_EQ(names, (std::multiset<std::string>{"chair", "person", "unknown", "unknown"}));
}

TEST(MoverDetector, JoinsAPersonCutInTwoByATable) {
  Stage stage;
  stage.put({140, 20, 40, 90}, 2.5F);
  stage.put({140, 125, 40, 90}, 2.5F);
  stage.put({80, 110, 160, 15}, 1.5F, false);
  EXPECT_THAT(stage.find().movers, SizeIs(1));
}

TEST(MoverDetector, FindsTheEndsAtWhichAnObjectIsHidden) {
  Stage stage;
  stage.image->depth(cv::Rect(80, 140, 160, 40)).setTo(1.5F);  // a table in front of the object
  stage.image->depth(cv::Rect(140, 80, 40, 60)).setTo(2.5F);
  Frame frame = stage.frame();
  frame.evidence.moving_pixels = stage.image->depth == 2.5F;
  frame.evidence.surface_log_odds = cv::Mat1f(frame.cells->size(), 1.0F);
  MoverDetector detector;
  const auto found = detector.detect(frame, Pose(so3_exp({0, 0, 0.5}), {0, 0, 0})).movers;
  ASSERT_THAT(found, SizeIs(1));
  const VisibleSpan &across = found[0].spans[0], &down = found[0].spans[1];
  EXPECT_FALSE(across.low_hidden || across.high_hidden || down.low_hidden);
  EXPECT_TRUE(down.high_hidden);
  EXPECT_TRUE(found[0].cut_off);
  EXPECT_NEAR(across.extent, 40 * 2.5 / 262.5, 0.05);
  EXPECT_NEAR(down.extent, 60 * 2.5 / 262.5, 0.05);
  EXPECT_LT((down.axis - so3_exp({0, 0, 0.5}) * Eigen::Vector3d::UnitY()).norm(), 1e-12);
}

TEST(MoverDetector, LeavesOutOfAMovingInstanceWhatIsMeasuredStatic) {
  Stage stage;
  stage.put({140, 60, 40, 120}, 2);
  stage.image->depth(cv::Rect(180, 60, 20, 120))
      .setTo(2.05F);  // static, next to the person in its mask
  stage.name({140, 60, 60, 120}, "person");
  Frame frame = stage.frame();
  frame.evidence.surface_measured = cv::Mat1f(frame.cells->size(), 2.0F);
  frame.evidence
      .surface_measured(cv::Rect(140 / kCellSide, 60 / kCellSide, 40 / kCellSide, 120 / kCellSide))
      .setTo(-2);
  frame.evidence.surface_log_odds = frame.evidence.surface_measured;
  MoverDetector detector;
  const auto found = detector.detect(frame, Pose()).movers;
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_NEAR(found[0].surface_mean.x(), 0, 0.03);
  frame.evidence.surface_measured.setTo(2);  // No part of it moves: a person who stands still.
  frame.evidence.surface_log_odds = frame.evidence.surface_measured;
  MoverDetector again;
  const auto resting = again.detect(frame, Pose()).movers;
  ASSERT_THAT(resting, SizeIs(1));
  EXPECT_NEAR(resting[0].surface.sizes().x(), 60 * 2 / 262.5, 0.06);
}

TEST(MoverDetector, TakesTheClassAndConfidenceOfTheInstance) {
  Stage stage;
  stage.put({140, 60, 40, 120}, 2);
  stage.name({130, 50, 60, 140}, "person", 0.8F);
  const auto found = stage.find().movers;
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_EQ(found[0].class_name, "person");
  EXPECT_NEAR(found[0].class_confidence, 0.8, 0.01);
}

TEST(MoverDetector, LeavesOutSpecksRimsAndRegionsWithoutDepth) {
  Stage stage;
  stage.put({20, 20, 10, 10}, 2);
  stage.put({100, 60, 40, 120}, 0);
  stage.put({200, 60, 40, 120}, kNan);
  const MoverDetections found = stage.find();
  EXPECT_TRUE(found.movers.empty());
  EXPECT_EQ(found.without_depth, 2);

  Stage ring;  // a mask grown by 5 pixels: the background around the slab moves too
  ring.moving(cv::Rect(95, 55, 50, 130)).setTo(255);
  ring.put({100, 60, 40, 120}, 2);
  const auto one = ring.find().movers;
  ASSERT_THAT(one, SizeIs(1));
  EXPECT_NEAR(one[0].surface_mean.z(), 2, 0.01);
}

TEST(MoverDetector, FindsNothingIfNothingMoves) {
  Stage stage;
  EXPECT_TRUE(stage.find().movers.empty());
  stage.moving = cv::Mat();
  stage.instances = nullptr;
  EXPECT_TRUE(stage.find().movers.empty());
  stage.image->depth.setTo(kNan);
  stage.moving = cv::Mat(240, 320, CV_8UC1, cv::Scalar(255));
  EXPECT_TRUE(stage.find().movers.empty());
}

TEST(MoverDetector, RecognizesBackgroundInAMaskByEarlierViews) {
  Stage stage;
  MoverDetector detector;
  detector.detect(stage.frame(), Pose());  // the wall alone
  stage.put({140, 60, 40, 120}, 2);
  stage.moving(cv::Rect(180, 60, 60, 120)).setTo(255);  // a mask that is far behind the slab
  const auto shifted = std::make_shared<RgbdFrame>(*stage.image);
  shifted->timestamp = 1;
  stage.image = shifted;
  const auto found = detector.detect(stage.frame(), Pose()).movers;
  ASSERT_THAT(found, SizeIs(1));
  EXPECT_NEAR(found[0].surface_mean.z(), 2, 0.01);
}

/// Returns a frame with surface evidence, as in the preset fused.
Frame frame_with_surfaces(const Stage& stage, double seconds) {
  Frame frame = stage.frame();
  const auto image = std::make_shared<RgbdFrame>(*frame.image);
  image->timestamp = seconds;
  frame.image = image;
  frame.evidence.surface_log_odds = cv::Mat1f(frame.cells->size(), 1.0F);
  return frame;
}

TEST(MoverDetector, ItsViewsMoveAlongWithACorrectedWorld) {
  const Pose T_corrected_world(so3_exp({0, 0.3, 0}), {0.5, 0, -1});
  for (const bool told : {false, true}) {
    Stage stage;
    MoverDetector detector;
    detector.detect(frame_with_surfaces(stage, 0), Pose());  // the wall alone
    stage.put({140, 60, 40, 120}, 2);
    if (told) detector.move(T_corrected_world);
    const auto found = detector.detect(frame_with_surfaces(stage, 1), T_corrected_world).movers;
    ASSERT_THAT(found, SizeIs(1));
    EXPECT_EQ(found[0].moves, told) << "seen through where the wall was";
  }
}

TEST(MoverDetector, ARegionOnAnEarlierSurfaceDoesNotMoveDespiteTheEvidence) {
  Stage stage;
  stage.put({140, 60, 40, 120}, 2);
  MoverDetector detector;
  for (int i = 0; i < 10; ++i) detector.detect(frame_with_surfaces(stage, 0.1 * i), Pose());
  const auto resting = detector.detect(frame_with_surfaces(stage, 1), Pose()).movers;
  ASSERT_THAT(resting, SizeIs(1));
  EXPECT_FALSE(resting[0].moves);
  Stage later;
  later.put({200, 60, 40, 120}, 2);  // It has moved to a place where the wall was visible.
  const auto moved = detector.detect(frame_with_surfaces(later, 1.1), Pose()).movers;
  ASSERT_THAT(moved, SizeIs(1));
  EXPECT_TRUE(moved[0].moves);
}

TEST(MoverDetector, AnInstanceIsAsLargeAsItsMaskAndMayStandStill) {
  Stage stage;
  stage.put({140, 60, 40, 120}, 2, false);
  stage.name({140, 60, 40, 120}, "person");
  stage.moving(cv::Rect(140, 60, 40, 60)).setTo(255);  // Only the upper half moves.
  const auto half = MoverDetector().detect(frame_with_surfaces(stage, 0), Pose()).movers;
  ASSERT_THAT(half, SizeIs(1));
  EXPECT_TRUE(half[0].moves);
  EXPECT_NEAR(half[0].surface.sizes().y(), 120 * 2 / 262.5, 0.05);
  stage.moving.setTo(0);
  const auto still = MoverDetector().detect(frame_with_surfaces(stage, 0), Pose()).movers;
  ASSERT_THAT(still, SizeIs(1));
  EXPECT_FALSE(still[0].moves);
}

TEST(MoverDetector, LeavesOutTheSurfacesAroundAFragmentOfAMask) {
  Stage before;  // A foot seen beside the leg of a desk.
  before.image->depth(cv::Rect(140, 100, 8, 24)).setTo(4);
  before.image->depth(cv::Rect(148, 40, 12, 140)).setTo(2);
  before.name({140, 100, 12, 24}, "person");
  EXPECT_TRUE(MoverDetector().detect(frame_with_surfaces(before, 0), Pose()).movers.empty())
      << "the leg of the desk, in front of the person";

  Stage behind;  // A foot without depth before the wall.
  behind.image->depth(cv::Rect(140, 100, 8, 16)).setTo(0);
  behind.name({140, 100, 12, 16}, "person");
  EXPECT_TRUE(MoverDetector().detect(frame_with_surfaces(behind, 0), Pose()).movers.empty())
      << "the wall behind the person";
}

TEST(MoverDetector, GrowsOverTheUndecidedPartsOfAnObject) {
  Stage stage;
  stage.put({140, 60, 40, 120}, 2, false);
  stage.moving(cv::Rect(140, 60, 40, 60)).setTo(255);
  Frame frame = frame_with_surfaces(stage, 0);
  EXPECT_NEAR(MoverDetector().detect(frame, Pose()).movers.at(0).surface.sizes().y(),
              60 * 2 / 262.5, 0.05);
  frame.evidence.surface_log_odds(cv::Rect(35, 15, 10, 30)) = -0.5F;
  EXPECT_NEAR(MoverDetector().detect(frame, Pose()).movers.at(0).surface.sizes().y(),
              120 * 2 / 262.5, 0.05);
}

/// Returns a detection of an object of 0.4 m x 1.6 m x 0.4 m.
MoverDetection detection(const Eigen::Vector3d& p, const std::string& name = "person") {
  MoverDetection made;
  made.class_name = name;
  made.class_confidence = name == "unknown" ? 0 : 0.9;
  made.centroid = made.surface_mean = p;
  const Eigen::Vector3d half(0.2, 0.8, 0.2);
  made.box = made.surface = {p - half, p + half};
  return made;
}

constexpr double kInterval = 1 / 30.0;

void step(MoverTracker& tracker, std::size_t frame, const std::vector<MoverDetection>& seen) {
  tracker.update(frame, static_cast<double>(frame) * kInterval, Pose(), seen);
}

std::optional<Pose> same_pose(std::size_t) { return Pose(); }

TEST(MoverTracker, ATrackIsBornOfThreeDetectionsAndLearnsTheVelocity) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 60; ++i) {
    step(tracker, i, {detection({-1 + 0.03 * static_cast<double>(i), 0, 3})});
    EXPECT_THAT(tracker.current(), SizeIs(i < 2 ? 0U : 1U)) << i;
  }
  const Mover mover = tracker.current()[0];
  EXPECT_EQ(mover.id, 1);
  EXPECT_EQ(mover.class_name, "person");
  EXPECT_NEAR(mover.class_confidence, 0.9, 1e-9);
  EXPECT_LT((mover.now.velocity - Eigen::Vector3d(0.9, 0, 0)).norm(), 0.02);
  EXPECT_LT((mover.now.centroid - Eigen::Vector3d(0.77, 0, 3)).norm(), 0.01);
  EXPECT_EQ(mover.first_seen, 0);
  EXPECT_NEAR(mover.last_seen, 59 * kInterval, 1e-12);
}

TEST(MoverTracker, AnObjectHiddenForASecondIsFoundAgain) {
  MoverTracker tracker;
  const auto at = [](std::size_t i) {
    return detection({-1 + 0.02 * static_cast<double>(i), 0, 3});
  };
  for (std::size_t i = 0; i < 90; ++i) {
    const bool hidden = i >= 40 && i < 70;
    step(tracker, i, hidden ? std::vector<MoverDetection>{} : std::vector{at(i)});
    if (hidden) {
      ASSERT_THAT(tracker.current(), SizeIs(1));
      EXPECT_FALSE(tracker.current()[0].now.observed);
    }
  }
  const auto tracks = tracker.tracks(same_pose);
  ASSERT_THAT(tracks, SizeIs(1));
  EXPECT_THAT(tracks[0].samples, SizeIs(90));
  EXPECT_LT((tracks[0].samples[50].centroid - at(50).centroid).norm(), 0.1);
}

TEST(MoverTracker, APersonWalkingBehindATableDoesNotRise) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 90; ++i) {
    const Eigen::Vector3d p(0.02 * static_cast<double>(i), 0, 3);
    MoverDetection seen = detection(p);
    seen.spans[0] = {Eigen::Vector3d::UnitX(), 0.4, false, false};
    seen.spans[1] = {Eigen::Vector3d::UnitY(), 1.6, false, false};
    if (i >= 45) {  // y is down: the lower 0.8 m of 1.6 m are hidden
      seen.spans[1] = {Eigen::Vector3d::UnitY(), 0.8, false, true};
      seen.cut_off = true;
      seen.centroid.y() -= 0.4;
      seen.box.max().y() -= 0.8;
      seen.surface = seen.box;
    }
    step(tracker, i, {seen});
    if (i < 10) continue;
    const std::vector<Mover> movers = tracker.current();
    ASSERT_THAT(movers, SizeIs(1));
    const MoverSample& now = movers[0].now;
    EXPECT_LT((now.centroid - p).norm(), 0.05) << i;
    EXPECT_NEAR(now.box.max().y(), 0.8, 0.05) << i;
  }
}

TEST(MoverTracker, ATrackEndsAtItsLastDetection) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 100; ++i) {
    step(tracker, i, i < 20 ? std::vector{detection({0, 0, 3})} : std::vector<MoverDetection>{});
  }
  EXPECT_TRUE(tracker.current().empty());
  const auto tracks = tracker.tracks(same_pose);
  ASSERT_THAT(tracks, SizeIs(1));
  EXPECT_THAT(tracks[0].samples, SizeIs(20));
  EXPECT_NEAR(tracks[0].last_seen, 19 * kInterval, 1e-12);
}

TEST(MoverTracker, TwoPassingEachOtherKeepTheirIds) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 90; ++i) {
    const double x = 0.03 * (static_cast<double>(i) - 45);
    std::vector<MoverDetection> seen{detection({x, 0, 3}), detection({-x, 0, 3.6})};
    if (i >= 40 && i < 50) seen.pop_back();  // hidden behind the first
    if (i % 2 == 0) std::reverse(seen.begin(), seen.end());
    step(tracker, i, seen);
  }
  const auto movers = tracker.current();
  ASSERT_THAT(movers, SizeIs(2));
  for (const MoverTrack& track : tracker.tracks(same_pose)) {
    const double distance = track.samples.back().centroid.x() - track.samples.front().centroid.x();
    EXPECT_NEAR(std::abs(distance), 89 * 0.03, 0.05) << "the id went back with the other one";
  }
}

TEST(MoverTracker, APersonWhoStopsKeepsItsTrackAndNoTrackIsBornAtRest) {
  MoverTracker tracker;
  MoverDetection other = detection({2, 0, 3});
  other.moves = false;
  for (std::size_t i = 0; i < 150; ++i) {
    MoverDetection seen =
        detection({0.03 * static_cast<double>(std::min<std::size_t>(i, 30)), 0, 3});
    seen.moves = i < 30;
    step(tracker, i, {seen, other});
  }
  const auto movers = tracker.current();
  ASSERT_THAT(movers, SizeIs(1));
  EXPECT_LT(movers[0].now.velocity.norm(), 0.02);
  EXPECT_TRUE(movers[0].now.observed);
  EXPECT_FALSE(movers[0].now.moves);
}

// A surface that has motion evidence but was in the same place before, such as the wall behind.
TEST(MoverTracker, AStillSurfaceOfNoClassDoesNotContinueAPerson) {
  MoverTracker tracker;
  MoverDetection wall = detection({0.9, 0, 3.3}, "unknown");
  wall.moves = false;
  for (std::size_t i = 0; i < 150; ++i) {
    std::vector<MoverDetection> seen{wall};
    if (i < 30) seen.push_back(detection({0.03 * static_cast<double>(i), 0, 3}));
    step(tracker, i, seen);
  }
  EXPECT_THAT(tracker.current(), IsEmpty()) << "the person left four seconds ago";
  ASSERT_THAT(tracker.tracks(same_pose), SizeIs(1));
  EXPECT_NEAR(tracker.tracks(same_pose)[0].last_seen, 29 * kInterval, 1e-9);
}

TEST(MoverTracker, AReturningPersonKeepsItsIdOnlyForAShortTime) {
  for (const std::size_t away : {20U, 120U}) {  // frames; the track lives for 45
    MoverTracker tracker;
    for (std::size_t i = 0; i < 30; ++i)
      step(tracker, i, {detection({0.02 * static_cast<double>(i), 0, 3})});
    for (std::size_t i = 30; i < 30 + away; ++i) step(tracker, i, {});
    for (std::size_t i = 30 + away; i < 60 + away; ++i)
      step(tracker, i, {detection({0.9 - 0.02 * static_cast<double>(i - 30 - away), 0, 3})});
    ASSERT_THAT(tracker.current(), SizeIs(1)) << away;
    EXPECT_EQ(tracker.current()[0].id, away < 45 ? 1 : 2) << away;
  }
}

TEST(MoverTracker, ClassesDoNotMixButAnUnknownObjectMayGetAClass) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 10; ++i) {
    step(tracker, i, {detection({0, 0, 3}, i < 5 ? "unknown" : "person")});
  }
  ASSERT_THAT(tracker.current(), SizeIs(1));
  EXPECT_EQ(tracker.current()[0].class_name, "person");
  for (std::size_t i = 10; i < 20; ++i) step(tracker, i, {detection({0.6, 0, 3}, "dog")});
  ASSERT_THAT(tracker.current(), SizeIs(2));
  EXPECT_EQ(tracker.current()[1].class_name, "dog");
}

TEST(MoverTracker, AFragmentStartsNoTrackAndDoubledTracksBecomeOne) {
  MoverTracker fragments;
  for (std::size_t i = 0; i < 30; ++i) {
    std::vector<MoverDetection> seen{detection({0, 0, 3})};
    if (i > 10) seen.push_back(detection({0, 0.6, 3}));
    step(fragments, i, seen);
  }
  EXPECT_THAT(fragments.tracks(same_pose), SizeIs(1));

  MoverTracker doubled;  // Both are detected from the start, so both are born.
  for (std::size_t i = 0; i < 30; ++i)
    step(doubled, i, {detection({0, 0, 3}), detection({0, 0.6, 3})});
  EXPECT_THAT(doubled.current(), SizeIs(1));
  EXPECT_EQ(doubled.current()[0].id, 1);
}

TEST(MoverTracker, TracksFollowTheFinalPoses) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 10; ++i) {
    tracker.update(i, static_cast<double>(i) * kInterval, Pose(so3_exp({0, 0.2, 0}), {1, 0, 0}),
                   {detection({0, 0, 3})});
  }
  const Pose correction(so3_exp({0, 1.5707963267948966, 0}), {0, 0, 7});
  const auto tracks = tracker.tracks([&](std::size_t i) -> std::optional<Pose> {
    if (i == 4) return std::nullopt;  // a frame that has lost its pose
    return correction * Pose(so3_exp({0, 0.2, 0}), {1, 0, 0});
  });
  ASSERT_THAT(tracks, SizeIs(1));
  EXPECT_THAT(tracks[0].samples, SizeIs(9));
  EXPECT_LT((tracks[0].samples.back().centroid - Eigen::Vector3d(3, 0, 7)).norm(), 1e-6);
  EXPECT_LT((tracks[0].samples.back().box.sizes() - Eigen::Vector3d(0.4, 1.6, 0.4)).norm(), 1e-6);
}

TEST(MoverTracker, FollowsACorrectionOfTheWorld) {
  const Pose T_corrected_world(so3_exp({0, 1.5707963267948966, 0}), {0, 0, 7});
  MoverTracker tracker;
  for (std::size_t i = 0; i < 60; ++i) {
    const bool corrected = i >= 30;
    if (i == 30) tracker.move(T_corrected_world);
    const Eigen::Vector3d p(-1 + 0.03 * static_cast<double>(i), 0, 3);
    step(tracker, i, {detection(corrected ? T_corrected_world * p : p)});
  }
  ASSERT_THAT(tracker.current(), SizeIs(1));
  const Mover mover = tracker.current()[0];
  EXPECT_EQ(mover.id, 1);
  EXPECT_LT((mover.now.velocity - Eigen::Vector3d(0, 0, -0.9)).norm(), 0.02);
}

TEST(MoverTracker, ANewWorldEndsAllTracks) {
  MoverTracker tracker;
  for (std::size_t i = 0; i < 5; ++i) step(tracker, i, {detection({0, 0, 3})});
  tracker.restart();
  EXPECT_TRUE(tracker.current().empty());
  for (std::size_t i = 50; i < 55; ++i) step(tracker, i, {detection({0, 0, 3})});
  EXPECT_THAT(tracker.tracks(same_pose), SizeIs(2));
  EXPECT_EQ(tracker.current()[0].id, 2);
}

TEST(MoverTracker, AcceptsFramesWithoutDetections) {
  MoverTracker tracker;
  step(tracker, 0, {});
  step(tracker, 1, {});
  EXPECT_TRUE(tracker.current().empty());
  EXPECT_TRUE(tracker.tracks(same_pose).empty());
}

/// Errors of tracks from true masks as surface evidence, true depth and true poses.
struct Evaluation {
  std::vector<double> position, velocity;  // errors [m] and [m/s]
  std::map<int, int> id;                   // last track id by the true id
  int switches = 0;                        // number of changes of the id within a second
  std::vector<MoverTrack> tracks;
};

Evaluation evaluate(const SimulatedSequence& sequence) {
  MoverDetector detector;
  MoverTracker tracker;
  Evaluation result;
  std::map<int, double> seen;
  for (std::size_t i = 0; i < sequence.frames(); ++i) {
    const TruthFrame truth = sequence.truth(i);
    const MoverDetections found =
        detector.detect(*test::true_frame(sequence, truth), truth.T_world_camera);
    tracker.update(i, truth.timestamp, truth.T_world_camera, found.movers);
    for (const MoverTruth& truth_mover : truth.movers) {
      if (truth_mover.shown < 0.8) continue;
      for (const Mover& mover : tracker.current()) {
        const double error = (mover.now.centroid - truth_mover.centroid).norm();
        if (!mover.now.observed || error > 0.5) continue;
        result.position.push_back(error);
        result.velocity.push_back((mover.now.velocity - truth_mover.velocity).norm());
        if (seen.contains(truth_mover.id) && truth.timestamp - seen[truth_mover.id] < 1) {
          result.switches += result.id[truth_mover.id] != mover.id;
        }
        result.id[truth_mover.id] = mover.id;
        seen[truth_mover.id] = truth.timestamp;
      }
    }
  }
  result.tracks = tracker.tracks([&](std::size_t i) { return sequence.T_world_camera(i); });
  return result;
}

/// Returns a sequence without noise.
SimulatedSequence scene(int people, int objects) {
  SimulationOptions options = test::near_movers(people, objects);
  options.noise = false;
  return SimulatedSequence(options);
}

TEST(MoversOfASimulatedScene, WalkersAreTrackedWithOneIdEach) {
  Evaluation result = evaluate(scene(2, 0));
  ASSERT_GT(result.position.size(), 20U);
  EXPECT_LT(upper_median(result.position), 0.12);
  EXPECT_LT(upper_median(result.velocity), 0.4) << "limbs swing faster";
  EXPECT_EQ(result.id.size(), 2U);
  EXPECT_EQ(result.switches, 0);
}

TEST(MoversOfASimulatedScene, ObjectsOfUnknownClassAreTrackedWithOneIdEach) {
  Evaluation result = evaluate(scene(0, 3));
  ASSERT_GT(result.position.size(), 50U);
  EXPECT_LT(upper_median(result.position), 0.12);
  EXPECT_LT(upper_median(result.velocity), 0.4) << "the crate swings, and turns at its ends";
  EXPECT_EQ(result.id.size(), 2U) << "the third object is rarely fully in the image";
  EXPECT_EQ(result.switches, 0);
  for (const MoverTrack& track : result.tracks) EXPECT_EQ(track.class_name, "unknown");
}

TEST(MoversOfASimulatedScene, NoTrackIsMadeIfNothingMoves) {
  EXPECT_TRUE(evaluate(scene(0, 0)).tracks.empty());
}

TEST(MoversOfASimulatedScene, TwoRunsAreIdenticalToTheLastBit) {
  const Evaluation a = evaluate(scene(2, 1)), b = evaluate(scene(2, 1));
  EXPECT_EQ(a.position, b.position);
  EXPECT_EQ(a.velocity, b.velocity);
  ASSERT_EQ(a.tracks.size(), b.tracks.size());
}

}  // namespace
}  // namespace stillmap
