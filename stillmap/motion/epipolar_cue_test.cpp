// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/epipolar_cue.hpp"

#include "stillmap/motion/test_frames.hpp"
#include "stillmap/motion/test_two_view.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Keypoints of a scene in two views; some move on their own between them.
struct Scene {
  test::TwoViews views;
  std::vector<Keypoint> keypoints;  // of the second view
  KeypointFlow flow;

  Scene() {
    for (const auto& p : views.cloud(150, 4)) add(p, 0);
  }
  /// @param across distance that it has moved across its epipolar line [pixels]
  std::size_t add(const Eigen::Vector3d& p, float across) {
    const cv::Point2f before = views.in_first(p);
    const cv::Vec3d line = views.F() * cv::Vec3d(before.x, before.y, 1);
    const double length = std::hypot(line[0], line[1]);
    const cv::Point2f now =
        views.in_second(p) + across * cv::Point2f(static_cast<float>(line[0] / length),
                                                  static_cast<float>(line[1] / length));
    keypoints.push_back({.u = now.x, .v = now.y});
    flow.before.push_back(before);
    flow.now.push_back(now);
    flow.found.push_back(1);
    return keypoints.size() - 1;
  }
  std::size_t add_at(double u, double v, float across) { return add(views.ahead(u, v, 2), across); }
  EpipolarLabels labels(const std::vector<Instance>& instances, bool everywhere = false) const {
    return labels_by_epipolar_lines(keypoints, test::segmented(instances), flow,
                                    {.everywhere = everywhere});
  }
};

/// Returns the keypoints that were labeled as moving.
std::vector<std::size_t> moving(const EpipolarLabels& labels) {
  std::vector<std::size_t> result;
  for (std::size_t i = 0; i < labels.moving.size(); ++i) {
    if (labels.moving[i] != 0) result.push_back(i);
  }
  return result;
}

/// Returns the box around keypoints first..last.
cv::Rect box_around(const Scene& scene, std::size_t first, std::size_t last) {
  cv::Rect box;
  for (std::size_t i = first; i <= last; ++i) {
    const Keypoint& k = scene.keypoints[i];
    box |= cv::Rect(cvRound(k.u) - 1, cvRound(k.v) - 1, 3, 3);
  }
  return box;
}

TEST(EpipolarTest, ExcludesExactlyTheKeypointsBeyondTheThreshold) {
  Scene scene;
  const auto fast = scene.add_at(100, 100, 8);
  scene.add_at(200, 300, 1.6F);
  const auto slow = scene.add_at(500, 200, -2.4F);
  const auto labels = scene.labels({}, true);
  EXPECT_TRUE(labels.tested);
  EXPECT_THAT(moving(labels), ::testing::ElementsAre(fast, slow));
}

TEST(EpipolarTest, KeepsStaticObjectsAndUnrecognizedSurroundings) {
  Scene scene;
  const auto on_tv = scene.add_at(100, 100, 8), on_nothing = scene.add_at(500, 200, 8);
  const Instance tv = test::box_of("tv", box_around(scene, on_tv, on_tv));
  EXPECT_TRUE(scene.labels({tv}).tested);
  EXPECT_THAT(moving(scene.labels({tv})), ::testing::IsEmpty());
  EXPECT_THAT(moving(scene.labels({tv}, true)), ::testing::ElementsAre(on_tv, on_nothing));
}

TEST(EpipolarTest, DynamicObjectsAreExcludedAtOnce) {
  Scene scene;
  const auto resting = scene.add_at(320, 240, 0);
  const cv::Rect box = box_around(scene, resting, resting);
  EXPECT_THAT(moving(scene.labels({test::box_of("person", box)})), ::testing::Contains(resting));
  EXPECT_THAT(moving(scene.labels({test::box_of("chair", box)})), ::testing::IsEmpty());
}

TEST(EpipolarTest, PotentiallyMovingObjectsAreExcludedIfTheyMove) {
  Scene scene;
  const auto pushed = scene.add_at(320, 240, 6);
  const cv::Rect box = box_around(scene, pushed, pushed);
  EXPECT_THAT(moving(scene.labels({test::box_of("chair", box)})), ::testing::ElementsAre(pushed));
}

TEST(EpipolarTest, AMoverThatOutnumbersTheRestDoesNotBendTheGeometry) {
  for (const char* name : {"person", "chair"}) {
    Scene scene;
    const std::size_t still = scene.keypoints.size();
    std::size_t last = 0;
    for (int i = 0; i < 300; ++i) {  // All of it moves up by 12 pixels.
      const double u = 250 + i % 20 * 5, v = 150 + i / 20 * 8.0;
      last = scene.add_at(u, v, 0);
      scene.keypoints[last].v -= 12;
      scene.flow.now[last].y -= 12;
    }
    const cv::Rect box = box_around(scene, still, last);
    const auto labels = scene.labels({test::box_of(name, box)}, true);
    ASSERT_TRUE(labels.tested);
    for (std::size_t i = 0; i < still; ++i) {
      if (in_any_box({box}, scene.keypoints[i].u, scene.keypoints[i].v)) continue;
      EXPECT_EQ(labels.moving[i], 0) << name << " " << i;
    }
    const auto dropped = std::count(labels.moving.begin() + static_cast<std::ptrdiff_t>(still),
                                    labels.moving.end(), 1);
    EXPECT_GT(dropped, 285) << name;
  }
}

TEST(EpipolarTest, PointsOnChairsAreUsedIfFewOthersAreVisible) {
  Scene scene;
  const cv::Rect everywhere(0, 0, 640, 480);
  EXPECT_TRUE(scene.labels({test::box_of("chair", everywhere)}).tested);
  EXPECT_FALSE(scene.labels({test::box_of("person", everywhere)}).tested);
}

TEST(EpipolarTest, PointsWithoutFlowAreKept) {
  Scene scene;
  const auto lost = scene.add_at(320, 240, 30);
  scene.flow.found[lost] = 0;
  EXPECT_THAT(moving(scene.labels({}, true)), ::testing::IsEmpty());
}

TEST(EpipolarCue, ExcludesOnlyBoxesInTheFirstFrame) {
  EpipolarCue cue({});
  const cv::Rect box(50, 50, 40, 40);
  MotionEvidence evidence = test::no_evidence(2);
  cue.add_to(evidence, test::input_of(test::image_of(0, test::texture({320, 240}, 1)),
                                      test::keypoints_at({{60, 60}, {200, 100}}),
                                      test::segmented({test::box_of("person", box)})));
  EXPECT_LT(evidence.static_log_odds[0], 0);
  EXPECT_EQ(evidence.static_log_odds[1], 0);
  EXPECT_EQ(cv::countNonZero(evidence.moving_pixels), box.area());
}

}  // namespace
}  // namespace stillmap
