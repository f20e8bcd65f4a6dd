// Tests of the scenarios against the truth of their own images.
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

SimulationOptions tiny(const std::string& activity, const std::string& camera, int people) {
  SimulationOptions options;
  options.activity = activity;
  options.camera = camera;
  options.people = people;
  options.width = 160;
  options.height = 120;
  options.fps = 10;
  options.frames = 100;
  options.noise = false;
  return options;
}

double share(const cv::Mat& mask, const cv::Mat& of) {
  return static_cast<double>(cv::countNonZero(mask & of)) / std::max(1, cv::countNonZero(of));
}

double covered(const TruthFrame& truth) {
  return static_cast<double>(cv::countNonZero(truth.instances)) /
         static_cast<double>(truth.instances.total());
}

TEST(Speed, IsThatOfTheVisibleMoverAndZeroElsewhere) {
  SimulationOptions options = tiny("walk", "xyz", 0);
  options.things = 3;
  options.near_things = true;
  const SimulatedSequence sequence(options);
  constexpr std::size_t kFrame = 14;  // The chair is halfway and fast.
  const TruthFrame truth = sequence.truth(kFrame);
  const cv::Mat speed = sequence.speed(kFrame);
  EXPECT_EQ(cv::countNonZero((speed > 0) & (truth.instances == 0)), 0);
  const MoverTruth& chair = truth.movers[1];
  ASSERT_EQ(chair.name, "chair");
  const cv::Mat seen = truth.instances == chair.id;
  ASSERT_GT(cv::countNonZero(seen), 200);
  ASSERT_GT(chair.velocity.norm(), 0.3);
  // It rotates by at most 0.56 rad/s, and all of it is within 0.5 m of its center.
  cv::Mat difference = cv::abs(speed - chair.velocity.norm());
  double most = 0;
  cv::minMaxLoc(difference, nullptr, &most, nullptr, nullptr, seen);
  EXPECT_LT(most, 0.28);
}

TEST(Speed, SeparatesThePlantedFootFromTheRest) {
  const SimulatedSequence sequence(tiny("walk", "static", 1));
  bool planted = false;
  for (std::size_t i = 0; i < 40 && !planted; ++i) {
    const cv::Mat people = sequence.truth(i).instances > 0, speed = sequence.speed(i);
    planted = share(speed > 0.4, people) > 0.6 && cv::countNonZero(people & (speed < 0.05)) > 5;
  }
  EXPECT_TRUE(planted);
}

TEST(Scenario, ACompanionStaysInTheMiddleAndFillsHalfTheView) {
  const SimulatedSequence sequence(tiny("companion", "follow", 1));
  for (std::size_t i = 0; i < sequence.frames(); i += 9) {
    const TruthFrame truth = sequence.truth(i);
    EXPECT_GT(covered(truth), 0.4) << i;
    EXPECT_LT(covered(truth), 0.6) << i;
    const cv::Moments m = cv::moments(truth.instances > 0, true);
    EXPECT_NEAR(m.m10 / m.m00 / 160, 0.5, 0.1) << i;
    EXPECT_GT(share(sequence.speed(i) > 0.02, truth.instances > 0), 0.95) << i;
  }
  const double way =
      (sequence.T_world_camera(99).translation() - sequence.T_world_camera(0).translation()).norm();
  EXPECT_GT(way, 1.5);
}

TEST(Scenario, ACompanionKeepsUpWithAFasterCamera) {
  SimulationOptions options = tiny("companion", "follow", 1);
  options.speed = 2;
  const SimulatedSequence sequence(options);
  EXPECT_NEAR(covered(sequence.truth(0)), covered(sequence.truth(99)), 0.1);
}

TEST(Scenario, ARisingPersonSitsStillAndThenWalksAway) {
  const SimulatedSequence sequence(tiny("rise", "static", 2));
  for (const std::size_t i : {0U, 13U, 26U, 39U}) {
    EXPECT_LT(share(sequence.speed(i) > 0.02, sequence.truth(i).instances == 1), 0.1) << i;
  }
  for (const std::size_t i : {50U, 70U}) {
    EXPECT_GT(share(sequence.speed(i) > 0.02, sequence.truth(i).instances == 1), 0.9) << i;
  }
  for (std::size_t i = 1; i < sequence.frames(); ++i) {  // No discontinuity between postures.
    const auto before = sequence.movers(i - 1), now = sequence.movers(i);
    EXPECT_LT((now[0].centroid - before[0].centroid).norm(), 0.15) << i;
    EXPECT_LT((now[1].centroid - before[1].centroid).norm(), 0.01) << i;
  }
  const auto first = sequence.movers(0), last = sequence.movers(99);
  EXPECT_GT((last[0].centroid - first[0].centroid).norm(), 1.5);
  EXPECT_GT(last[0].box.max().z(), first[0].box.max().z() + 0.3);
}

TEST(Scenario, ACrowdCoversNearlyEverythingForASecond) {
  for (const auto& [camera, people] : {std::pair{"xyz", 6}, {"static", 4}}) {
    const SimulatedSequence sequence(tiny("crowd", camera, people));
    int longest = 0, run = 0;
    for (std::size_t i = 0; i < 70; ++i) {
      run = covered(sequence.truth(i)) > 0.8 ? run + 1 : 0;
      longest = std::max(longest, run);
    }
    EXPECT_GE(longest, 10) << camera;  // at 10 Hz
    EXPECT_LT(covered(sequence.truth(0)), 0.2) << camera;
    EXPECT_LT(covered(sequence.truth(65)), 0.2) << camera;
  }
}

TEST(Scenario, NearObjectsAreWellVisible) {
  for (const char* camera : {"static", "xyz"}) {
    SimulationOptions options = tiny("walk", camera, 0);
    options.things = 3;
    options.near_things = true;
    const SimulatedSequence sequence(options);
    int ball_seen = 0, frames = 0;
    for (std::size_t i = 0; i < sequence.frames(); i += 5, ++frames) {
      const TruthFrame truth = sequence.truth(i);
      EXPECT_GT(cv::countNonZero(truth.instances == 1), 0.02 * 160 * 120) << camera << ' ' << i;
      EXPECT_GT(cv::countNonZero(truth.instances == 2), 0.015 * 160 * 120) << camera << ' ' << i;
      ball_seen += cv::countNonZero(truth.instances == 3) > 20;
    }
    EXPECT_GT(ball_seen, frames / 2) << camera;
  }
}

/// The camera moves once around, 60 m, through four rooms, never into a wall, and back to the
/// start.
TEST(Flat, ThePathLeadsThroughAllRoomsAndBack) {
  SimulationOptions options = tiny("walk", "loop", 0);
  options.scene = "flat";
  options.fps = 1;
  options.frames = 160;
  const SimulatedSequence sequence(options);
  double way = 0, back = 1e9;
  for (std::size_t i = 1; i < 160; ++i) {
    const Eigen::Vector3d p = sequence.T_world_camera(i).translation();
    way += (p - sequence.T_world_camera(i - 1).translation()).norm();
    if (i > 100) back = std::min(back, (p - sequence.T_world_camera(0).translation()).norm());
  }
  EXPECT_NEAR(way, 64, 2);
  EXPECT_LT(back, 0.3);
  for (std::size_t i = 0; i < 160; i += 4) {
    const cv::Mat depth = sequence.truth(i).depth;
    EXPECT_EQ(cv::countNonZero(depth), static_cast<int>(depth.total())) << i << ": no hole";
    EXPECT_EQ(cv::countNonZero(depth < 0.3), 0) << i;
  }
}

}  // namespace
}  // namespace stillmap
