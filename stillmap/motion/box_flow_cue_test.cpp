// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/box_flow_cue.hpp"

#include "stillmap/motion/test_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::Each;
using ::testing::ElementsAre;
constexpr FlowSet kS = FlowSet::kStatic, kF = FlowSet::kDoubtful, kD = FlowSet::kDynamic;

/// The sets of some points by their boxes, and the flow of each.
struct Points {
  std::vector<FlowSet> sets;
  KeypointFlow flow;
  void add(FlowSet set, cv::Point2f moved, bool found = true) {
    sets.push_back(set);
    flow.before.emplace_back(50.0F, 60.0F);
    flow.now.push_back(flow.before.back() + moved);
    flow.found.push_back(found ? 1 : 0);
  }
  std::vector<FlowSet> divided(double factor = 0.5) {
    divide_by_flow(sets, flow, factor);
    return sets;
  }
};

TEST(FlowSets, InsideABoxIsDoubtfulOutsideStatic) {
  const auto features = test::keypoints_at({{5, 5}, {15, 15}, {25, 25}, {35, 35}});
  EXPECT_THAT(divide_by_boxes(features->keypoints, {{10, 10, 10, 10}, {30, 30, 10, 10}}),
              ElementsAre(kS, kF, kS, kF));
}

TEST(FlowSets, HalfTheMeanFlowOfTheBackgroundIsTheLimit) {
  Points points;
  points.add(kS, {5, 4});  // mean (6, 8): 10 pixels long, so l = 5
  points.add(kS, {7, 12});
  points.add(kF, {6, 8});
  points.add(kF, {6, 12.9F});
  points.add(kF, {6, 13.1F});
  points.add(kF, {9, 12});  // 3, 4 off: exactly l, which does not exceed it
  points.add(kF, {0, 0});
  EXPECT_THAT(points.divided(), ElementsAre(kS, kS, kS, kS, kD, kS, kD));
}

TEST(FlowSets, TheFactorIsAnOption) {
  Points points;
  points.add(kS, {10, 0});
  points.add(kF, {13, 0});
  EXPECT_THAT(Points(points).divided(0.5), ElementsAre(kS, kS));
  EXPECT_THAT(Points(points).divided(0.2), ElementsAre(kS, kD));
}

TEST(FlowSets, PointsWithoutFlowDoNotEnterTheMeanAndStayWhereTheyAre) {
  Points points;
  points.add(kS, {4, 0});
  points.add(kS, {100, 0}, false);
  points.add(kF, {5, 0});
  points.add(kF, {4, 0}, false);  // inside a person's box and without evidence for being static
  EXPECT_THAT(points.divided(), ElementsAre(kS, kS, kS, kD));
}

TEST(FlowSets, WithoutABackgroundTheWholeBoxMoves) {
  Points points;
  points.add(kS, {0, 0}, false);
  points.add(kF, {0, 0});
  EXPECT_THAT(points.divided(), ElementsAre(kS, kD));
}

TEST(FlowSets, ACameraAtRestExcludesAllPointsWithAnyFlow) {
  Points points;
  points.add(kS, {0.02F, 0});
  points.add(kS, {-0.02F, 0});
  points.add(kF, {0.1F, 0});
  points.add(kF, {0, 0});
  EXPECT_THAT(points.divided(), ElementsAre(kS, kS, kD, kS));
}

/// A keypoint on a body that moved in frame 0 and pauses from frame 1 on, in F of every frame.
std::vector<bool> in_body_while_pausing(int memory, int frames, cv::Point2f step = {0, 0}) {
  MovedKeypoints moved(memory);
  std::vector<bool> in_body;
  cv::Point2f at(50, 60);
  for (int i = 0; i < frames; ++i) {
    Points points;
    points.add(kF, step);
    points.flow.before[0] = at;
    points.flow.now[0] = at = at + step;
    moved.divide(points.sets, points.flow, {1});
    in_body.push_back(points.sets[0] == kD);
    moved.add(points.flow, {i == 0 ? char{1} : char{0}});
  }
  return in_body;
}

TEST(MovedKeypoints, ShowTheBodyForSomeFramesAfterItMoved) {
  EXPECT_THAT(in_body_while_pausing(2, 5), ElementsAre(false, true, true, false, false));
  EXPECT_THAT(in_body_while_pausing(2, 5, {7, 0}), ElementsAre(false, true, true, false, false))
      << "with the flow";
  EXPECT_THAT(in_body_while_pausing(0, 3), Each(false));
}

TEST(MovedKeypoints, ShowTheBodyWithinThreePixelsAndInTheBoxesOfMovingClasses) {
  MovedKeypoints moved(10);
  Points first;
  first.add(kF, {0, 0});
  moved.divide(first.sets, first.flow, {1});
  moved.add(first.flow, {1});
  Points second;
  for (const float x : {50.0F, 52.9F, 53.1F, 50.0F}) {
    second.add(kF, {0, 0});
    second.flow.before.back().x = x;
  }
  moved.divide(second.sets, second.flow, {1, 1, 1, 0});
  EXPECT_THAT(second.sets, ElementsAre(kD, kD, kF, kF));
}

/// A background that moves by (8, 0) pixels, and in front of it a person who moves by (-6, 0)
/// pixels in the left half of its box.
struct WalkingPerson : testing::Test {
  const cv::Size size{320, 240};
  const cv::Rect box{120, 60, 100, 120}, person{120, 60, 50, 120};
  RgbdFramePtr first, second;
  std::vector<cv::Point2f> outside, on_person, in_box;
  MotionInput input;

  WalkingPerson() {
    cv::Mat1b before = test::moved_texture(size, 1, 0, 0), now = test::moved_texture(size, 1, 8, 0);
    const cv::Mat1b shirt = test::texture(person.size(), 2);
    shirt.copyTo(before(person + cv::Point(6, 0)));
    shirt.copyTo(now(person));
    first = test::image_of(0, before);
    second = test::image_of(1, now);
    outside = test::lattice({10, 10, 90, 200}, 12);
    on_person = test::lattice(person, 9, 10);
    in_box = test::lattice({192, 70, 28, 100},
                           9);  // right of the background that the person has just uncovered
    std::vector<cv::Point2f> all = outside;
    all.insert(all.end(), on_person.begin(), on_person.end());
    all.insert(all.end(), in_box.begin(), in_box.end());
    input = test::input_of(second, test::keypoints_at(all),
                           test::segmented({test::box_of("person", box)}),
                           test::frame_of(first, test::keypoints_at({})));
  }
  MotionEvidence evidence_of_cue() const {
    BoxFlowCue cue({});
    MotionEvidence evidence = test::no_evidence(input.features->size());
    cue.add_to(evidence, input);
    return evidence;
  }
  /// Returns the share of points first..first + count - 1 that were excluded.
  static double excluded(const MotionEvidence& evidence, std::size_t first, std::size_t count) {
    const auto begin = evidence.static_log_odds.begin() + static_cast<std::ptrdiff_t>(first);
    const auto n = std::count_if(begin, begin + static_cast<std::ptrdiff_t>(count),
                                 [](float x) { return x < 0; });
    return static_cast<double>(n) / static_cast<double>(count);
  }
};

TEST_F(WalkingPerson, IsExcludedAndTheWallInItsBoxIsNot) {
  const MotionEvidence evidence = evidence_of_cue();
  EXPECT_EQ(excluded(evidence, 0, outside.size()), 0);
  EXPECT_GT(excluded(evidence, outside.size(), on_person.size()), 0.95);
  EXPECT_LT(excluded(evidence, outside.size() + on_person.size(), in_box.size()), 0.1);
  EXPECT_EQ(cv::countNonZero(evidence.moving_pixels), box.area());
}

TEST_F(WalkingPerson, IsExcludedWithItsBoxInTheFirstFrame) {
  input.previous = nullptr;
  const MotionEvidence evidence = evidence_of_cue();
  EXPECT_EQ(excluded(evidence, 0, outside.size()), 0);
  EXPECT_EQ(excluded(evidence, outside.size(), on_person.size() + in_box.size()), 1);
}

TEST_F(WalkingPerson, IsTestedAlikeWithTheBoxOfAPotentiallyMovingObject) {
  const MotionEvidence person_evidence = evidence_of_cue();
  input.instances = test::segmented({test::box_of("chair", box)});
  const MotionEvidence evidence = evidence_of_cue();
  EXPECT_EQ(evidence.static_log_odds, person_evidence.static_log_odds);
  EXPECT_TRUE(evidence.moving_pixels.empty()) << "chairs belong to the map";
}

TEST_F(WalkingPerson, OfAnotherClassIsNotTested) {
  input.instances = test::segmented({test::box_of("tv", box)});
  const MotionEvidence evidence = evidence_of_cue();
  EXPECT_THAT(evidence.static_log_odds, Each(0.0F));
  EXPECT_TRUE(evidence.moving_pixels.empty());
}

TEST_F(WalkingPerson, HasItsMaskIgnored) {
  Instance masked = test::box_of("person", box);
  masked.mask = cv::Mat::zeros(box.size(), CV_8UC1);
  masked.mask(cv::Rect(90, 0, 10, 120)).setTo(255);  // the background of the box
  const MotionEvidence with_box = evidence_of_cue();
  input.instances = test::segmented({masked});
  EXPECT_EQ(evidence_of_cue().static_log_odds, with_box.static_log_odds);
}

TEST_F(WalkingPerson, MovingWithTheBackgroundKeepsPointsAndPixels) {
  cv::Mat1b now = test::moved_texture(size, 1, 8, 0);
  test::texture(person.size(), 2).copyTo(now(person + cv::Point(6 + 8, 0)));
  input.image = test::image_of(1, now);
  const MotionEvidence evidence = evidence_of_cue();
  EXPECT_LT(excluded(evidence, outside.size(), on_person.size() + in_box.size()), 0.3);
  EXPECT_TRUE(evidence.moving_pixels.empty());
}

}  // namespace
}  // namespace stillmap
