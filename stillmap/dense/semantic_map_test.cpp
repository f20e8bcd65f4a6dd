// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/semantic_map.hpp"

#include "stillmap/dense/live_map.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <map>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

// A wall at 2.5 m and two boxes half a meter wide in front of it, one meter apart.
struct Box {
  double left, right, front;  // x from, x to, z [m]
};
constexpr Box kLeft{-0.75, -0.25, 2.0}, kRight{0.25, 0.75, 2.0};
constexpr double kWallDepth = 2.5, kBottom = 0.1, kTop = -0.4;

bool hits(const Box& box, const Eigen::Vector3d& ray, const Eigen::Vector3d& eye) {
  const Eigen::Vector3d p = eye + ray * (box.front - eye.z());
  return p.x() >= box.left && p.x() <= box.right && p.y() >= kTop && p.y() <= kBottom;
}

RgbdFrame frame_at(const Eigen::Vector3d& eye) {
  const Camera camera = small_camera();
  return frame_of(camera, [&](int u, int v) {
    const Eigen::Vector3d ray = camera.unproject(u, v, 1);
    const bool on_box = hits(kLeft, ray, eye) || hits(kRight, ray, eye);
    return (on_box ? kLeft.front : kWallDepth) - eye.z();
  });
}

Instance instance_of(const Box& box, const Eigen::Vector3d& eye, const std::string& name,
                     float confidence, bool with_mask = true) {
  const Camera camera = small_camera();
  const Eigen::Vector2d a = camera.project(Eigen::Vector3d(box.left, kTop, box.front) - eye);
  const Eigen::Vector2d b = camera.project(Eigen::Vector3d(box.right, kBottom, box.front) - eye);
  Instance instance{.class_name = name, .confidence = confidence, .box = {}, .mask = {}};
  instance.box = cv::Rect(cv::Point(static_cast<int>(a.x()) - 3, static_cast<int>(a.y()) - 3),
                          cv::Point(static_cast<int>(b.x()) + 3, static_cast<int>(b.y()) + 3)) &
                 cv::Rect(0, 0, camera.width, camera.height);
  if (with_mask) {
    instance.mask = cv::Mat1b::zeros(instance.box.size());
    instance.mask(cv::Rect(3, 3, instance.box.width - 6, instance.box.height - 6)).setTo(255);
  }
  return instance;
}

struct World {
  std::vector<DenseView> views;
  std::vector<Pose> poses;

  void add(double x, const std::vector<Instance>& instances) {
    const Eigen::Vector3d eye(x, 0, 0);
    const SegmentedFrame segmented{.instances = instances};
    views.push_back(
        make_dense_view(small_camera(), frame_at(eye), {}, {.stride = 1}, {}, {}, &segmented).view);
    poses.emplace_back(Eigen::Quaterniond::Identity(), eye);
  }
};

struct Result {
  std::vector<Eigen::Vector3f> points;
  SemanticMap semantics;
};

Result map_of(const World& world) {
  StaticGrid grid(0.02);
  std::vector<PosedView> places;
  for (std::size_t i = 0; i < world.views.size(); ++i) {
    grid.add(world.views[i], world.poses[i]);
    places.push_back({&world.views[i], world.poses[i]});
  }
  const std::vector<std::uint32_t> cells = grid.index().sorted();
  Result result;
  for (const std::uint32_t cell : cells) result.points.push_back(grid.mean(cell));
  result.semantics = make_semantic_map(grid, places, cells);
  return result;
}

Eigen::Vector3d eye_at(double x) { return {x, 0, 0}; }

TEST(SemanticMap, FindsEachObjectOnceWithItsPoints) {
  World world;
  for (const double x : {-0.3, -0.15, 0.0, 0.15, 0.3}) {
    world.add(x, {instance_of(kLeft, eye_at(x), "tv", 0.8F),
                  instance_of(kRight, eye_at(x), "chair", 0.6F)});
  }
  const Result result = map_of(world);
  ASSERT_EQ(result.semantics.objects.size(), 2U);
  for (const StaticObject& object : result.semantics.objects) {
    const Box& truth = object.class_name == "tv" ? kLeft : kRight;
    EXPECT_NEAR(object.confidence, object.class_name == "tv" ? 0.8 : 0.6, 1e-4);
    EXPECT_EQ(object.views, 5);
    // Three pixels between the borders of the mask and of the surface are 3.5 cm.
    EXPECT_LT((object.center -
               Eigen::Vector3d((truth.left + truth.right) / 2, (kTop + kBottom) / 2, truth.front))
                  .norm(),
              0.03);
    EXPECT_NEAR(object.box.sizes().x(), truth.right - truth.left, 0.1);
    EXPECT_LT(object.box.sizes().z(), 0.03);
  }
  EXPECT_NE(result.semantics.objects[0].class_name, result.semantics.objects[1].class_name);
  std::size_t wrong = 0, labeled = 0;
  for (std::size_t i = 0; i < result.points.size(); ++i) {
    if (result.semantics.object[i] == 0) continue;
    ++labeled;
    const auto& object = result.semantics.objects[result.semantics.object[i] - 1U];
    const Box& truth = object.class_name == "tv" ? kLeft : kRight;
    wrong += result.points[i].z() > 2.1 || result.points[i].x() < truth.left - 0.02 ||
             result.points[i].x() > truth.right + 0.02;
  }
  EXPECT_GT(labeled, 600U);  // of 25 x 25 voxels each
  EXPECT_EQ(wrong, 0U);
}

TEST(SemanticMap, MergesDetectionsOfDifferentClasses) {
  World world;
  for (const double x : {-0.3, -0.1, 0.1, 0.3}) {
    const bool doubtful = x > 0.2;
    world.add(x, {instance_of(kLeft, eye_at(x), doubtful ? "laptop" : "tv", 0.5F)});
  }
  const SemanticMap semantics = map_of(world).semantics;
  ASSERT_EQ(semantics.objects.size(), 1U);
  EXPECT_EQ(semantics.objects[0].class_name, "tv");
  EXPECT_EQ(semantics.objects[0].views, 4);
}

TEST(SemanticMap, KeepsTwoObjectsOfOneClassApart) {
  World world;
  for (const double x : {-0.2, 0.0, 0.2}) {
    world.add(x, {instance_of(kLeft, eye_at(x), "chair", 0.7F),
                  instance_of(kRight, eye_at(x), "chair", 0.7F)});
  }
  EXPECT_EQ(map_of(world).semantics.objects.size(), 2U);
}

TEST(SemanticMap, IgnoresASingleDetection) {
  World world;
  world.add(0, {instance_of(kLeft, eye_at(0), "toilet", 0.4F),
                instance_of(kRight, eye_at(0), "chair", 0.7F)});
  for (const double x : {-0.2, -0.1, 0.1, 0.2, 0.3}) {
    world.add(x, {instance_of(kRight, eye_at(x), "chair", 0.7F)});
  }
  const SemanticMap semantics = map_of(world).semantics;
  ASSERT_EQ(semantics.objects.size(), 1U);
  EXPECT_EQ(semantics.objects[0].class_name, "chair");
}

TEST(SemanticMap, FindsTheObjectInABox) {
  // Detections without masks, in boxes widened so that they include much of the wall.
  World world;
  for (const double x : {-0.2, 0.0, 0.2}) {
    Instance boxed = instance_of(kLeft, eye_at(x), "tv", 0.8F, false);
    boxed.box =
        cv::Rect(boxed.box.x - 4, boxed.box.y - 4, boxed.box.width + 8, boxed.box.height + 8) &
        cv::Rect(0, 0, 160, 120);
    world.add(x, {boxed});
  }
  const Result result = map_of(world);
  ASSERT_EQ(result.semantics.objects.size(), 1U);
  EXPECT_LT(result.semantics.objects[0].box.max().z(), kLeft.front + 0.05);
  EXPECT_GT(result.semantics.objects[0].points, 400U);
}

TEST(SemanticMap, IsEmptyWithoutDetections) {
  World world;
  world.add(0, {});
  EXPECT_TRUE(map_of(world).semantics.empty());
  EXPECT_TRUE(map_of(world).semantics.object.empty());
}

/// Returns the points of a live map by the names of their classes; "" for none.
std::map<std::string, std::vector<Eigen::Vector3f>> points_by_class(const LiveMap& live) {
  std::map<std::string, std::vector<Eigen::Vector3f>> points;
  for (std::uint32_t cell = 0; cell < live.grid().index().size(); ++cell) {
    const std::uint16_t number = live.class_of(cell);
    points[number > 0 ? live.classes().at(number - 1U) : ""].push_back(live.grid().mean(cell));
  }
  return points;
}

TEST(LiveMap, EachClassKeepsItsNumberAsMoreAreDetected) {
  const std::vector<std::string> names{"tv",   "chair", "cup",  "book",  "bottle",
                                       "vase", "sink",  "oven", "table", "couch"};
  LiveMap live(0.01, {}, 1000000);
  for (std::size_t i = 0; i < names.size(); ++i) {
    World world;  // each class is detected once, in a place of its own
    world.add(0, {instance_of(kLeft, {0, 0, 0}, names[i], 0.8F)});
    live.add(i, std::make_shared<DenseView>(world.views[0]),
             Pose(world.poses[0].quaternion(), {10.0 * static_cast<double>(i), 0, 0}));
    auto points = points_by_class(live);
    for (std::size_t k = 0; k <= i; ++k) EXPECT_GT(points[names[k]].size(), 100U) << names[k];
  }
}

TEST(LiveMap, HasTheClassesOfMostVotesAndMovesThemWithThePoses) {
  World world;
  for (int i = 0; i < 4; ++i) {
    const Eigen::Vector3d eye(0.05 * i, 0, 0);
    // One of four views takes the left box for something else.
    world.add(eye.x(), {instance_of(kLeft, eye, i == 1 ? "tv" : "chair", 0.8F),
                        instance_of(kRight, eye, "table", 0.6F)});
  }
  LiveMap live(0.01, {}, 1000000);
  std::map<std::uint64_t, std::shared_ptr<DenseView>> views;
  for (std::uint64_t i = 0; i < world.views.size(); ++i) {
    views[i] = std::make_shared<DenseView>(world.views[i]);
    live.add(i, views[i], world.poses[i]);
  }
  auto points = points_by_class(live);
  EXPECT_GT(points["chair"].size(), 100U);
  EXPECT_GT(points["table"].size(), 100U);
  EXPECT_GT(points[""].size(), 1000U);
  EXPECT_LT(points["tv"].size(), points["chair"].size());  // in voxels that one view sees only
  for (const Eigen::Vector3f& p : points["chair"]) EXPECT_NEAR(p.x(), -0.5, 0.3);

  const Eigen::Vector3d shift(1, 0, 0);
  live.update_poses(views, [&](std::uint64_t i) {
    return Pose(world.poses[i].quaternion(), world.poses[i].translation() + shift);
  });
  points = points_by_class(live);
  EXPECT_GT(points["chair"].size(), 100U);
  for (const Eigen::Vector3f& p : points["chair"]) EXPECT_NEAR(p.x(), 0.5, 0.3);
}

}  // namespace
}  // namespace stillmap
