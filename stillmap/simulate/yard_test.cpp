// Tests of the yard: what its scene contains, and the way of the camera below the trolley.
#include "stillmap/base/error.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// A round of the trolley in 36 small images.
SimulationOptions yard(int people, int things) {
  SimulationOptions options;
  options.scene = "yard";
  options.camera = "trolley";
  options.people = people;
  options.things = things;
  options.camera_model = "realsense_d435i";
  options.width = 160;
  options.fps = 1;
  options.frames = 36;
  options.shake = 0;
  return options;
}

const SimulatedSequence& dynamic_yard() {
  static const SimulatedSequence sequence(yard(3, 3));
  return sequence;
}

TEST(Trolley, DrivesARectangleOutAndBackAndRests) {
  const Trolley trolley{.start = {1, 2, 3}, .bridge = 3, .rails = 4, .speed = 0.5};
  EXPECT_DOUBLE_EQ(trolley.round(), 28);
  const auto near = [&](double seconds, const Eigen::Vector3d& position) {
    EXPECT_NEAR((trolley.at(seconds) - position).norm(), 0, 1e-12) << seconds;
  };
  near(-1, {1, 2, 3});
  near(3, {2.5, 2, 3});
  near(6, {4, 2, 3});
  near(10, {4, 4, 3});
  near(14, {4, 6, 3});
  near(20, {1, 6, 3});
  near(28, {1, 2, 3});
  near(100, {1, 2, 3});
}

TEST(Trolley, StartsAndStopsGentlyOnEverySide) {
  const Trolley trolley{.start = {0, 0, 0}, .bridge = 3, .rails = 4, .speed = 0.5};
  for (const double corner : {0.0, 6.0, 14.0, 20.0, 28.0})
    EXPECT_LT((trolley.at(corner + 0.01) - trolley.at(corner)).norm() / 0.01, 0.01) << corner;
}

TEST(Yard, HasWorkersAHookAndVehiclesIfDynamicAndNoMoversIfStatic) {
  std::vector<std::string> names;
  for (const MoverTruth& mover : dynamic_yard().movers(0)) names.push_back(mover.name);
  EXPECT_EQ(names,
            (std::vector<std::string>{"person", "person", "person", "hook", "vehicle", "vehicle"}));
  EXPECT_TRUE(make_scene({.scene = "yard", .people = 0}).movers.empty());
}

TEST(Yard, ShowsTheHookInEveryFrameAndWorkersAndVehiclesInMany) {
  int people = 0, vehicles = 0;
  constexpr int kEnough = 60;  // pixels of 160 x 90
  for (std::size_t i = 0; i < dynamic_yard().frames(); ++i) {
    int seen_people = 0, seen_vehicles = 0;
    for (const MoverTruth& mover : dynamic_yard().truth(i).movers) {
      if (mover.name == "hook") {
        EXPECT_GT(mover.pixels, kEnough) << i;
      }
      if (mover.name == "person") seen_people += mover.pixels;
      if (mover.name == "vehicle") seen_vehicles += mover.pixels;
    }
    people += seen_people > kEnough;
    vehicles += seen_vehicles > kEnough;
  }
  EXPECT_GT(people, 18);
  EXPECT_GT(vehicles, 12);
}

TEST(Yard, ALoadedHookFillsAThirdOfEveryImageAndHangsAboveTheContainers) {
  SimulationOptions options = yard(0, 1);
  options.near_things = true;
  const SimulatedSequence loaded(options);
  constexpr double kPixels = 160 * 90, kContainer = 1.1;  // height [m]
  for (std::size_t i = 0; i < loaded.frames(); ++i) {
    const MoverTruth hook = loaded.truth(i).movers.front();
    EXPECT_GT(hook.pixels / kPixels, 0.25) << i;
    EXPECT_LT(hook.pixels / kPixels, 0.45) << i;
    EXPECT_GT(loaded.movers(i).front().box.min().z(), kContainer) << i;
  }
}

/// Returns the smallest length of the overlap of two boxes along an axis [m]; negative without one.
double overlap(const Eigen::AlignedBox3d& a, const Eigen::AlignedBox3d& b) {
  return (a.max().cwiseMin(b.max()) - a.min().cwiseMax(b.min())).minCoeff();
}

TEST(Yard, VehiclesHitNeitherEachOtherNorWorkers) {
  constexpr double kTouch = 0.05;  // boxes of swinging arms may touch [m]
  for (std::size_t i = 0; i < dynamic_yard().frames(); ++i) {
    const auto movers = dynamic_yard().movers(i);
    for (const MoverTruth& vehicle : movers) {
      if (vehicle.name != "vehicle") continue;
      for (const MoverTruth& other : movers) {
        if (other.id == vehicle.id || other.name == "hook") continue;
        EXPECT_LT(overlap(vehicle.box, other.box), kTouch) << i << " " << other.name;
      }
    }
  }
}

TEST(Yard, HookSwingsBelowTheTrolley) {
  const Trolley& trolley = *dynamic_yard().scene().trolley;
  double least = 10, most = -10;
  for (std::size_t i = 0; i < dynamic_yard().frames(); ++i) {
    const MoverTruth hook = dynamic_yard().movers(i)[3];
    const Eigen::Vector3d offset = hook.centroid - trolley.at(static_cast<double>(i));
    EXPECT_LT(offset.z(), 0) << i;
    EXPECT_LT((offset.head<2>() - Eigen::Vector2d(-0.25, 1.75)).norm(), 0.4) << i;
    least = std::min(least, offset.x());
    most = std::max(most, offset.x());
  }
  EXPECT_GT(most - least, 0.2);
}

TEST(TrolleyCamera, LooksAheadAndDownAndReturnsToItsStart) {
  const Trajectory path = dynamic_yard().trajectory();
  const Eigen::Vector3d down_and_ahead(0, std::cos(0.73), -std::sin(0.73));
  for (const auto& [stamp, T] : path) {
    const Eigen::Vector3d axis = T.quaternion() * Eigen::Vector3d::UnitZ();
    EXPECT_NEAR((axis - down_and_ahead).norm(), 0, 1e-9) << stamp;
    EXPECT_NEAR(T.translation().z(), 2.7, 1e-9) << stamp;
  }
  // One round takes 35 s.
  EXPECT_NEAR((path[35].T_world_camera.translation() - path[0].T_world_camera.translation()).norm(),
              0, 1e-9);
  EXPECT_NEAR((path[17].T_world_camera.translation() - path[0].T_world_camera.translation()).norm(),
              5, 0.05);
}

TEST(TrolleyCamera, NeedsASceneWithACrane) {
  SimulationOptions options = yard(0, 0);
  options.scene = "office";
  EXPECT_THROW(SimulatedSequence{options}, Error);
}

TEST(CameraModel, IsScaledToTheWidth) {
  const Camera& camera = dynamic_yard().camera();
  EXPECT_EQ(camera.width, 160);
  EXPECT_EQ(camera.height, 90);
  EXPECT_NEAR(camera.fx, 924.3 / 8, 1e-9);
  EXPECT_NEAR(camera.cx, 79.5, 1e-9);
  EXPECT_EQ(camera.depth_sensor.name, "realsense_d435i");
}

TEST(CameraModel, MeasuresDepthUpTo10Meters) {
  const RgbdFramePtr frame = dynamic_yard().frame(17);
  double least = 0, most = 0;
  cv::minMaxLoc(frame->depth, &least, &most, nullptr, nullptr, frame->depth > 0);
  EXPECT_GT(least, 0.1);
  EXPECT_GT(most, 4);
  EXPECT_LT(most, 10);
}

}  // namespace
}  // namespace stillmap
