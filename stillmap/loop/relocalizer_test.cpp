// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/relocalizer.hpp"

#include "stillmap/loop/rendered_map_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using rendered::MapBuilder;
using rendered::small_images;

/// An office mapped along a short path at the desks, and frames of other paths.
class Relocalize : public ::testing::Test {
 protected:
  struct World {
    std::shared_ptr<const Scene> scene;
    Camera camera;
    MapBuilder built;
  };

  static SimulatedSequence sequence(const std::shared_ptr<const Scene>& scene, int seed = 5) {
    SimulationOptions options;
    options.camera = "xyz";
    options.frames = 40;
    options.speed = 10;
    options.seed = seed;
    return {options, SimulatedSequence(small_images({.people = 0, .frames = 1})).camera(), scene};
  }

  static const World& world() {
    static const auto scene =
        std::make_shared<const Scene>(make_scene({.people = 0, .seed = 1001}));
    static const World made = [] {
      const SimulatedSequence path = sequence(scene);
      World w{scene, path.camera(), MapBuilder(path.camera())};
      for (std::size_t i = 0; i < 12; ++i) {
        const auto f = path.at(i);
        w.built.add(*f.frame, f.truth.T_world_camera);
      }
      return w;
    }();
    return made;
  }

  static RelocalizationVerification find(const Features& features,
                                         std::vector<float> weights = {}) {
    if (weights.empty()) weights.assign(features.size(), 1);
    return relocalize(world().built.map, world().built.index, {features, weights});
  }

  /// Landmark errors are a few millimeters (depth noise), averaged over many.
  static void expect_correct(const RelocalizationVerification& verification, const Pose& truth,
                             double meters = 0.015, double radians = 0.006) {
    ASSERT_TRUE(verification.result) << verification.reason;
    const Pose error = truth.inverse() * verification.result->T_world_camera;
    EXPECT_LT(error.translation().norm(), meters);
    EXPECT_LT(error.angle(), radians);
  }
};

TEST_F(Relocalize, FindsTheCameraOnAnotherPath) {
  const SimulatedSequence path = sequence(world().scene, 77);
  for (std::size_t i = 20; i < 40; i += 3) {
    SCOPED_TRACE(i);
    const auto f = path.at(i);
    expect_correct(find(rendered::extract(*f.frame)), f.truth.T_world_camera);
  }
}

TEST_F(Relocalize, NeedsNoDepth) {
  const SimulatedSequence path = sequence(world().scene, 77);
  for (std::size_t i = 20; i < 40; i += 5) {
    SCOPED_TRACE(i);
    const auto f = path.at(i);
    Features features = rendered::extract(*f.frame);
    for (Keypoint& k : features.keypoints) k.depth = 0;
    expect_correct(find(features), f.truth.T_world_camera, 0.03, 0.01);
  }
}

TEST_F(Relocalize, ThePoseIsRelativeToItsKeyframe) {
  const auto f = sequence(world().scene, 77).at(22);
  const auto found = find(rendered::extract(*f.frame));
  ASSERT_TRUE(found.result);
  const Map& map = world().built.map;
  const Pose again = map.resolve(found.result->reference, found.result->T_reference_camera);
  EXPECT_LT((again.inverse() * found.result->T_world_camera).log().norm(), 1e-9);
}

/// The assigned landmarks must project to their keypoints.
TEST_F(Relocalize, AssignsLandmarksToKeypoints) {
  const auto f = sequence(world().scene, 77).at(25);
  const Features features = rendered::extract(*f.frame);
  const auto found = find(features);
  ASSERT_TRUE(found.result);
  int shown = 0;
  for (std::size_t i = 0; i < features.size(); ++i) {
    const Landmark* landmark = world().built.map.find(found.result->landmarks[i]);
    if (landmark == nullptr) continue;
    ++shown;
    const Eigen::Vector2d uv =
        world().camera.project(f.truth.T_world_camera.inverse() * landmark->p_world);
    const Keypoint& k = features.keypoints[i];
    EXPECT_LT((uv - Eigen::Vector2d(k.u, k.v)).norm(), 4 * std::pow(1.2, k.level));
  }
  EXPECT_EQ(shown, found.result->inliers);
  EXPECT_GT(shown, 100);
}

/// Half of the image is labeled moving: it must not be used, and the rest suffices.
TEST_F(Relocalize, ToleratesPeopleInTheView) {
  const auto f = sequence(world().scene, 77).at(25);
  const Features features = rendered::extract(*f.frame);
  std::vector<float> weights;
  for (const Keypoint& k : features.keypoints) weights.push_back(k.u < 160 ? 0 : 1);
  const auto found = find(features, weights);
  ASSERT_TRUE(found.result) << found.reason;
  expect_correct(found, f.truth.T_world_camera, 0.03, 0.01);
  for (std::size_t i = 0; i < features.size(); ++i) {
    if (weights[i] == 0) {
      EXPECT_FALSE(found.result->landmarks[i].valid());
    }
  }
}

/// An office with the same furniture at the same places, and other wood, posters and books.
TEST_F(Relocalize, FailsInARoomOfEqualFurniture) {
  int told_by_texture = 0;
  for (const int seed : {1002, 1003, 1004}) {
    const auto twin = std::make_shared<const Scene>(make_scene({.people = 0, .seed = seed}));
    const SimulatedSequence path = sequence(twin);
    for (std::size_t i = 0; i < 12; ++i) {
      const auto found = find(rendered::extract(*path.at(i).frame));
      EXPECT_FALSE(found.result) << seed << ", " << i;
      told_by_texture += found.reason.find("texture") != std::string::npos;
    }
  }
  EXPECT_GT(told_by_texture, 2);
}

TEST_F(Relocalize, FailsInAnUnknownPlace) {
  auto elsewhere = std::make_shared<Scene>(*world().scene);
  elsewhere->viewpoint.position = {5.2, 1.0, 1.45};
  elsewhere->viewpoint.target = {3.0, 0.1, 0.9};
  const SimulatedSequence path = sequence(elsewhere, 77);
  for (std::size_t i = 20; i < 40; i += 3) {
    const auto found = find(rendered::extract(*path.at(i).frame));
    EXPECT_FALSE(found.result);
    EXPECT_FALSE(found.reason.empty());
  }
  EXPECT_FALSE(find(Features{}).result);
}

}  // namespace
}  // namespace stillmap
