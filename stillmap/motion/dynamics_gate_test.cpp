// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/dynamics_gate.hpp"

#include "stillmap/motion/test_frames.hpp"
#include "stillmap/motion/test_two_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kMarked = 0.5, kUnmarked = 0.05;

/// Returns the gate's labels (H high, l low) of a text with one character per frame: x marked,
/// . unmarked, - without a share.
std::string labels(const std::string& frames) {
  DynamicsGate gate({});
  std::string result;
  for (const char frame : frames) {
    std::optional<double> share;
    if (frame != '-') share = frame == 'x' ? kMarked : kUnmarked;
    result += gate.push(share) ? 'H' : 'l';
  }
  return result;
}

TEST(DynamicsGate, TheFirstNineFramesAreHighAndTheTenthDecides) {
  EXPECT_EQ(labels(".........."), "HHHHHHHHHl");
  EXPECT_EQ(labels("xxxxxxxxxx"), "HHHHHHHHHH");
  EXPECT_EQ(labels("xxxxx....."), "HHHHHHHHHl");  // half is not more than half
  EXPECT_EQ(labels("xxxxxx...."), "HHHHHHHHHH");
}

TEST(DynamicsGate, MoreThanHalfOfTheLastTenFramesMakeItHigh) {
  EXPECT_EQ(labels("..........xxxxxxx"), "HHHHHHHHHllllllHH");
  EXPECT_EQ(labels("xxxxxxxxxx......."), "HHHHHHHHHHHHHHlll");
}

TEST(DynamicsGate, FramesWithoutAShareHaveNoVote) {
  EXPECT_EQ(labels("-.........."), "HHHHHHHHHll");
  EXPECT_EQ(labels("xxxxxxxxxx-------"), "HHHHHHHHHHHHHHHHH");
  EXPECT_EQ(labels("..........----"), "HHHHHHHHHlllll");
}

TEST(DynamicsGate, ATenthOfTheKeypointsDoesNotMarkAFrame) {
  const auto label_of_ten = [](double marked_share) {
    DynamicsGate gate({});
    for (int frame = 0; frame < 9; ++frame) gate.push(marked_share);
    return gate.push(marked_share);
  };
  EXPECT_FALSE(label_of_ten(0.1));
  EXPECT_TRUE(label_of_ten(0.1001));
}

/// Returns the flow of 100 points of a plane, of which the first `off` are moved by `by` pixels.
KeypointFlow plane_flow(std::size_t off, float by) {
  const test::TwoViews views;
  const auto plane = views.plane(100, 3);
  std::vector<cv::Point2f> before, now;
  for (std::size_t i = 0; i < plane.size(); ++i) {
    before.push_back(views.in_first(plane[i]));
    const float sign = i % 2 == 0 ? 1.0F : -1.0F;  // so that no homography fits them
    now.push_back(views.in_second(plane[i]) + cv::Point2f(0, i < off ? sign * by : 0));
  }
  return test::flow_between(before, now);
}

/// Returns the share of marked keypoints among 100, by the homography itself.
double share_of(const KeypointFlow& flow, double warp_error = DynamicsGateOptions().warp_error) {
  return marked_share(flow, 100, {.in_se2 = false, .warp_error = warp_error}).value();
}

TEST(MarkedShare, CountsPointsFurtherOffThanTheLimit) {
  EXPECT_EQ(share_of(plane_flow(0, 0)), 0.0);
  EXPECT_EQ(share_of(plane_flow(20, 8)), 0.2);
  EXPECT_EQ(share_of(plane_flow(11, 5)), 0.11);
}

TEST(MarkedShare, TheLimitIsOnePointSevenPixels) {
  EXPECT_EQ(share_of(plane_flow(10, 1.9F)), 0.1);
  EXPECT_EQ(share_of(plane_flow(10, 1.5F)), 0.0);
}

TEST(MarkedShare, IsThatOfAllKeypointsOfTheFrame) {
  KeypointFlow flow = plane_flow(20, 8);
  for (std::size_t i = 0; i < 10; ++i) flow.found[i] = 0;
  EXPECT_NEAR(share_of(flow), 0.1, 1e-12) << "10 of the 20 were lost";
  EXPECT_NEAR(marked_share(flow, 200, {.in_se2 = false}).value(), 0.05, 1e-12);
}

TEST(MarkedShare, NeedsTwentyTrackedKeypoints) {
  KeypointFlow flow = plane_flow(20, 8);
  for (std::size_t i = 0; i < 81; ++i) flow.found[i] = 0;
  EXPECT_FALSE(marked_share(flow, 100, {}));
}

/// A homography explains an image that grows by a tenth; a rotation and a translation do not.
TEST(MarkedShare, InSe2NoScaleIsExplained) {
  KeypointFlow flow;
  for (const cv::Point2f& p : test::lattice({0, 0, 320, 240}, 20)) {
    flow.before.push_back(p);
    flow.now.push_back(1.1F * p);
    flow.found.push_back(1);
  }
  EXPECT_EQ(marked_share(flow, flow.size(), {.in_se2 = false}), 0.0);
  EXPECT_GT(marked_share(flow, flow.size(), {.in_se2 = true}).value(), 0.9);
}

/// A cue with evidence for motion of every keypoint.
struct Alarm : MotionCue {
  std::string_view name() const override { return "alarm"; }
  std::set<std::string> classes() const override { return {"dog"}; }
  void add_to(MotionEvidence& evidence, const MotionInput&) override {
    for (float& x : evidence.static_log_odds) x -= 1;
  }
};

/// A wall that moves by (4, 1) pixels a frame, and an object in front of it with a third of the
/// keypoints that moves by `own` pixels more.
struct Film {
  cv::Point2d own;
  cv::Size size{320, 240};
  std::vector<cv::Point2f> points = test::lattice({0, 0, 320, 240}, 14, 12);

  RgbdFramePtr image(int i) const {
    cv::Mat1b gray = test::moved_texture(size, 1, 4 * (i % 8), i % 8);
    const cv::Rect object(100, 20, 120, 200);
    test::moved_texture(size, 2, (4 + own.x) * (i % 8), (1 + own.y) * (i % 8))(object).copyTo(
        gray(object));
    return test::image_of(static_cast<std::size_t>(i), gray);
  }
  /// Returns the frames in which the gate applied the cue (H) or not (l).
  std::string applied(int frames) const {
    GatedCue cue({}, std::make_unique<Alarm>());
    FramePtr previous;
    std::string result;
    for (int i = 0; i < frames; ++i) {
      const auto features = test::keypoints_at(points);
      const auto frame = image(i);
      MotionEvidence evidence = test::no_evidence(points.size());
      cue.add_to(evidence, test::input_of(frame, features, nullptr, previous));
      result += evidence.static_log_odds[0] < 0 ? 'H' : 'l';
      previous = test::frame_of(frame, features);
    }
    return result;
  }
};

TEST(GatedCue, IsAppliedWhileAThirdOfTheImageMovesOnItsOwn) {
  EXPECT_EQ(Film({{-6, 2}}).applied(14), "HHHHHHHHHHHHHH");
}

TEST(GatedCue, IsNotAppliedIfEverythingMovesAlikeAfterTenFrames) {
  EXPECT_EQ(Film({{0, 0}}).applied(14), "HHHHHHHHHlllll");
}

TEST(GatedCue, UsesTheClassesOfItsCue) {
  const GatedCue cue({}, std::make_unique<Alarm>());
  EXPECT_THAT(cue.classes(), ::testing::ElementsAre("dog"));
  EXPECT_EQ(cue.name(), "gated-alarm");
}

}  // namespace
}  // namespace stillmap
