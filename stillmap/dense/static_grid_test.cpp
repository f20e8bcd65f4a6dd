// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/static_grid.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>
#include <cmath>
#include <random>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

constexpr double kWallDepth = 2.5, kObjectDepth = 1.5;

DenseView view_of_frame(const RgbdFrame& frame, const cv::Mat1b& movers = {}) {
  return make_dense_view(small_camera(), frame, movers, {}, {}).view;
}

// Returns a wall with an object 20 pixels wide in front of it around column `at`; none if negative.
DenseView wall_with_object(int at) {
  return view_of_frame(frame_of(small_camera(), [=](int u, int v) {
    return at >= 0 && std::abs(u - at) <= 10 && v > 30 ? kObjectDepth : kWallDepth;
  }));
}

std::vector<Eigen::Vector3f> static_points(const StaticGrid& grid) {
  std::vector<Eigen::Vector3f> points;
  for (const std::uint32_t i : grid.index().sorted()) {
    if (grid.is_static(i)) points.push_back(grid.mean(i));
  }
  return points;
}

std::size_t nearer_than_wall(const StaticGrid& grid) {
  const auto points = static_points(grid);
  return static_cast<std::size_t>(std::count_if(
      points.begin(), points.end(), [](const auto& p) { return p.z() < kWallDepth - 0.1; }));
}

TEST(StaticGrid, KeepsTheWeightedMeanOfAVoxel) {
  // Two depths in one voxel of 10 m have weights 1 / sigma^2 of their depths.
  const auto at = [](double z) {
    return view_of_frame(frame_of(small_camera(), [=](int, int) { return z; }));
  };
  const DenseView near = at(1.2), far = at(1.8);
  StaticGrid grid(10, {.remove_ghosts = false});
  grid.add(near, Pose());
  grid.add(far, Pose());
  const std::uint32_t cell = grid.index().find(voxel_at({0.1, 0.1, 1}, 10).value());
  ASSERT_NE(cell, VoxelIndex::kNone);
  const DepthSensor& sensor = small_camera().depth_sensor;
  const double ratio = std::pow(sensor.sigma(1.8) / sensor.sigma(1.2), 2);
  EXPECT_NEAR(grid.mean(cell).z(), (ratio * 1.2 + 1.8) / (ratio + 1), 2e-4);
  EXPECT_EQ(grid.cell(cell).views, 2);
}

TEST(StaticGrid, ContinuesASurfaceBetweenItsPixelsButNotAcrossAnEdge) {
  // Neighboring pixels are 3.8 cm apart on the wall and 2.3 cm on the object: 3 and 2 voxels.
  const DenseView view = wall_with_object(80);
  StaticGrid pixels(0.01, {.interpolate = false}), surface(0.01);
  pixels.add(view, Pose());
  surface.add(view, Pose());
  const std::size_t objects = nearer_than_wall(pixels);
  const std::size_t walls = static_points(pixels).size() - objects;
  EXPECT_GT(nearer_than_wall(surface), 3 * objects);
  EXPECT_LE(nearer_than_wall(surface), 4 * objects);
  EXPECT_GT(static_points(surface).size() - nearer_than_wall(surface), 7 * walls);
  for (const Eigen::Vector3f& p : static_points(surface)) {
    EXPECT_TRUE(std::abs(p.z() - kWallDepth) < 0.01 || std::abs(p.z() - kObjectDepth) < 0.01) << p;
  }
}

TEST(StaticGrid, RemovesSurfacesThatLaterViewsSeeThrough) {
  const DenseView with = wall_with_object(80), without = wall_with_object(-1);
  StaticGrid grid(0.01);
  grid.add(with, Pose());
  EXPECT_GT(nearer_than_wall(grid), 200U);
  grid.add(without, Pose());
  grid.add(without, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U);
}

TEST(StaticGrid, RemovesSurfacesThatEarlierViewsSawThrough) {
  const DenseView with = wall_with_object(80), without = wall_with_object(-1);
  StaticGrid grid(0.01);
  grid.add(without, Pose());
  grid.add(without, Pose());
  grid.add(with, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U);
}

TEST(StaticGrid, AddsSurfacesThatWereOccluded) {
  const DenseView with = wall_with_object(80), without = wall_with_object(-1);
  StaticGrid once(0.01), filled(0.01);
  once.add(without, Pose());
  filled.add(with, Pose());
  filled.add(without, Pose());
  filled.add(without, Pose());
  // The wall is complete without the object.
  EXPECT_EQ(static_points(filled).size(), static_points(once).size());
}

TEST(StaticGrid, RemovesAWalkerWithoutAnyMask) {
  std::vector<DenseView> views;
  for (const int at : {10, 40, 70, 100, 130}) views.push_back(wall_with_object(at));
  StaticGrid voting(0.01), plain(0.01, {.remove_ghosts = false});
  for (const DenseView& view : views) {
    voting.add(view, Pose());
    plain.add(view, Pose());
  }
  EXPECT_GT(nearer_than_wall(plain), 1500U);
  EXPECT_EQ(nearer_than_wall(voting), 0U);
}

TEST(StaticGrid, KeepsAThinStaticObject) {
  // The object is two pixels wide in five views with 0.5 mm of pose error and the noise of a
  // Kinect.
  std::vector<DenseView> views;
  std::vector<Pose> poses;
  std::mt19937 random(3);
  std::normal_distribution<double> gauss;
  for (int i = 0; i < 5; ++i) {
    const double x = 0.05 * i;
    views.push_back(view_of_frame(frame_of(small_camera(), [&](int u, int) {
      const double column = 79.5 + 132 * (0.1 - x) / kObjectDepth;
      const double z = std::abs(u - column) <= 1.5 ? kObjectDepth : kWallDepth;
      return z + 1.4e-3 * z * z * gauss(random);
    })));
    poses.emplace_back(Eigen::Quaterniond::Identity(),
                       Eigen::Vector3d(x + 5e-4 * gauss(random), 0, 0));
  }
  // Back-projection finds depth jumps at each pixel of so thin an object, so its kind is set here.
  for (DenseView& view : views) {
    for (int row = 0; row < view.kind.rows; ++row) {
      for (int col = 0; col < view.kind.cols; ++col) {
        if (view.depth(row, col) * DenseView::kDepthUnit < 1.8)
          view.kind(row, col) = kStaticSurface;
      }
    }
  }
  StaticGrid voting(0.01), plain(0.01, {.remove_ghosts = false});
  for (std::size_t i = 0; i < views.size(); ++i) {
    voting.add(views[i], poses[i]);
    plain.add(views[i], poses[i]);
  }
  EXPECT_GT(nearer_than_wall(plain), 100U);
  EXPECT_GT(nearer_than_wall(voting), 0.95 * static_cast<double>(nearer_than_wall(plain)));
}

TEST(StaticGrid, RemovesAMaskedPersonDespiteASingleMissingMask) {
  // A person sits still all the time; the network misses the person in one of four keyframes.
  const RgbdFrame frame = frame_of(small_camera(), [](int u, int) {
    return std::abs(u - 80) <= 15 ? kObjectDepth : kWallDepth;
  });
  const cv::Mat1b mask = cv::Mat(frame.depth < 2);
  const DenseView masked = view_of_frame(frame, mask), missed = view_of_frame(frame);
  StaticGrid grid(0.01);
  for (const DenseView* view : {&masked, &missed, &masked, &masked}) grid.add(*view, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U);
}

TEST(StaticGrid, KeepsAFloorOnWhichPeopleStoodInHalfOfTheViews) {
  const RgbdFrame floor = frame_of(small_camera(), [](int, int) { return kWallDepth; });
  const RgbdFrame foot = frame_of(small_camera(), [](int u, int) {
    return std::abs(u - 80) <= 15 ? kWallDepth - 0.03 : kWallDepth;
  });
  const cv::Mat1b mask = cv::Mat(foot.depth < kWallDepth - 0.01);
  const DenseView empty = view_of_frame(floor), stood_on = view_of_frame(foot, mask);
  StaticGrid grid(0.01), once(0.01);
  once.add(empty, Pose());
  for (const DenseView* view : {&empty, &stood_on, &empty, &stood_on}) grid.add(*view, Pose());
  EXPECT_EQ(static_points(grid).size(), static_points(once).size());
  grid.add(stood_on, Pose());
  EXPECT_LT(static_points(grid).size(), 0.9 * static_cast<double>(static_points(once).size()));
}

TEST(StaticGrid, ConfirmsSurfacesNextToAMoverByASecondView) {
  // A mask covers half of a person who is in one view only, at the border of the known surface.
  const Camera camera = camera_of_width(640);
  const auto frame_with = [&](bool person) {
    return frame_of(camera, [=](int u, int) {
      if (u > 400) return person && u <= 440 ? kObjectDepth : 0.0;  // no depth behind the person
      return kWallDepth;
    });
  };
  cv::Mat1b half = cv::Mat1b::zeros(480, 640);
  half(cv::Rect(400, 0, 22, 480)).setTo(255);
  const auto view_of = [&](bool person, const cv::Mat1b& movers) {
    return make_dense_view(camera, frame_with(person), movers, {}, {}).view;
  };
  const DenseView with = view_of(true, half), without = view_of(false, {});
  StaticGrid grid(0.01);
  for (const DenseView* view : {&without, &with, &without}) grid.add(*view, Pose());
  std::size_t ghosts = 0, confirmed = 0;
  for (std::uint32_t i = 0; i < grid.index().size(); ++i) {
    const bool ghost = grid.mean(i).z() < kWallDepth - 0.1;
    ghosts += ghost;
    confirmed += ghost && grid.is_static(i) && grid.is_confirmed(i);
  }
  EXPECT_GT(ghosts, 200U);
  EXPECT_EQ(confirmed, 0U);
  // A second view with the same surface confirms it.
  grid.add(with, Pose(Eigen::Quaterniond::Identity(), {0.004, 0, 0}));
  for (std::uint32_t i = 0; i < grid.index().size(); ++i) {
    if (grid.mean(i).z() < kWallDepth - 0.1 && grid.cell(i).views > 1)
      confirmed += grid.is_confirmed(i);
  }
  EXPECT_GT(confirmed, 50U);
}

TEST(StaticGrid, RemovesAnObjectThatHasLeft) {
  const DenseView with = wall_with_object(80), without = wall_with_object(-1);
  StaticGrid grid(0.01);
  for (int i = 0; i < 20; ++i) grid.add(with, Pose());
  EXPECT_GT(nearer_than_wall(grid), 200U);
  for (int i = 0; i < 4; ++i) grid.add(without, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U);
}

DenseView of_visit(std::uint16_t visit, DenseView view) {
  view.visit = visit;
  return view;
}

TEST(StaticGrid, KeepsWhatHasAppearedSinceAnEarlierVisit) {
  const DenseView before = of_visit(0, wall_with_object(-1));
  const DenseView after = of_visit(1, wall_with_object(80));
  StaticGrid grid(0.01);
  for (int i = 0; i < 10; ++i) grid.add(before, Pose());
  grid.add(after, Pose());
  EXPECT_GT(nearer_than_wall(grid), 200U);
}

TEST(StaticGrid, KeepsWhatHasReturnedUntilItLeavesAgain) {
  const auto with = [](std::uint16_t visit) { return of_visit(visit, wall_with_object(80)); };
  const auto without = [](std::uint16_t visit) { return of_visit(visit, wall_with_object(-1)); };
  const DenseView first = with(0), gone = without(1), returned = with(2), gone_again = without(2);
  StaticGrid grid(0.01);
  for (int i = 0; i < 10; ++i) grid.add(first, Pose());
  for (int i = 0; i < 10; ++i) grid.add(gone, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U);
  grid.add(returned, Pose());
  EXPECT_GT(nearer_than_wall(grid), 200U);
  for (int i = 0; i < 2; ++i) grid.add(gone_again, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U) << "the first visit no longer counts";
}

TEST(StaticGrid, RemovesWhatTheSameVisitSawThroughBefore) {
  const DenseView first = of_visit(0, wall_with_object(80));
  const DenseView through = of_visit(1, wall_with_object(-1));
  const DenseView ghost = of_visit(1, wall_with_object(80));
  StaticGrid grid(0.01);
  grid.add(first, Pose());
  for (int i = 0; i < 3; ++i) grid.add(through, Pose());
  grid.add(ghost, Pose());
  EXPECT_EQ(nearer_than_wall(grid), 0U);
}

TEST(StaticGrid, ScalesColorsToThoseOfTheGrid) {
  RgbdFrame frame = frame_of(small_camera(), [](int, int) { return kWallDepth; });
  frame.color.setTo(cv::Scalar(80, 120, 160));
  const DenseView first = view_of_frame(frame);
  frame.color.setTo(cv::Scalar(100, 108, 160));  // another white balance
  const DenseView second = view_of_frame(frame);
  StaticGrid grid(0.01);
  grid.add(first, Pose());
  grid.add(second, Pose());
  EXPECT_LT((grid.gains()[0] - Eigen::Vector3f::Ones()).norm(), 1e-6);
  EXPECT_LT((grid.gains()[1] - Eigen::Vector3f(1, 120 / 108.F, 0.8F)).norm(), 1e-3);
  for (std::uint32_t i = 0; i < grid.index().size(); ++i) {
    EXPECT_EQ(grid.color(i), (Rgb{160, 120, 80}));
  }
}

// Depth beyond the surfaces of certain depth [m].
constexpr double kFarWall = 4.7;

DenseView far_wall(unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> gauss;
  return view_of_frame(frame_of(small_camera(), [&](int, int) {
    return kFarWall + find_depth_sensor("kinect_v1").sigma(kFarWall) * gauss(random);
  }));
}

// Returns the root mean square distance of the static cells from the wall [m].
double thickness(const StaticGrid& grid) {
  double squares = 0;
  const auto points = static_points(grid);
  for (const auto& p : points) squares += (p.z() - kFarWall) * (p.z() - kFarWall);
  return std::sqrt(squares / static_cast<double>(points.size()));
}

TEST(StaticGrid, FusesTheFarSurfacesOfManyViews) {
  std::vector<DenseView> views;
  for (unsigned seed = 1; seed <= 12; ++seed) views.push_back(far_wall(seed));
  StaticGrid one(0.01), many(0.01);
  one.add(views.front(), Pose());
  one.fill_far();
  for (const DenseView& view : views) many.add(view, Pose());
  EXPECT_TRUE(static_points(many).empty());  // There are no surfaces of certain depth.
  many.fill_far();
  EXPECT_LT(static_points(many).size(), 1.2 * static_cast<double>(static_points(one).size()));
  EXPECT_LT(thickness(many), 0.5 * thickness(one));
  EXPECT_TRUE(many.is_far(many.index().sorted().front()));
}

TEST(StaticGrid, PrefersTheNearerView) {
  const DenseView far = far_wall(1);
  const DenseView near = view_of_frame(frame_of(small_camera(), [](int, int) { return 2.0; }));
  const Pose nearer(Eigen::Quaterniond::Identity(), {0, 0, kFarWall - 2});
  StaticGrid alone(0.01), both(0.01);
  alone.add(near, nearer);
  both.add(far, Pose());
  both.add(near, nearer);
  both.fill_far();
  // Nothing has changed in the nearer view, which covers two fifths of the other one.
  const auto certain = static_points(alone), all = static_points(both);
  EXPECT_GT(all.size(), certain.size() + 1000);
  const auto in_its_view = std::count_if(all.begin(), all.end(), [](const auto& p) {
    return std::abs(p.x()) < 1.1F && std::abs(p.y()) < 0.8F;
  });
  const auto seen_by_it = std::count_if(certain.begin(), certain.end(), [](const auto& p) {
    return std::abs(p.x()) < 1.1F && std::abs(p.y()) < 0.8F;
  });
  EXPECT_EQ(in_its_view, seen_by_it);
}

TEST(StaticGrid, RemovesFarSurfacesThatOthersSeeThrough) {
  const auto at = [](double z) {
    return view_of_frame(frame_of(small_camera(), [=](int u, int v) {
      return std::abs(u - 80) <= 10 && std::abs(v - 60) < 40 ? z : 4.9;
    }));
  };
  const DenseView with = at(4.2), without = at(4.9);
  const auto in_front_of_wall = [](const StaticGrid& grid) {
    const auto points = static_points(grid);
    return std::count_if(points.begin(), points.end(), [](const auto& p) { return p.z() < 4.5; });
  };
  StaticGrid alone(0.01), voted(0.01);
  alone.add(with, Pose());
  alone.fill_far();
  EXPECT_GT(in_front_of_wall(alone), 100);
  for (const DenseView* view : {&without, &with, &without}) voted.add(*view, Pose());
  voted.fill_far();
  EXPECT_EQ(in_front_of_wall(voted), 0);
}

TEST(StaticGrid, IsTheSameWithSeveralThreads) {
  const DenseView with = wall_with_object(40), without = wall_with_object(-1), far = far_wall(1);
  StaticGrid one(0.01), several(0.01, {}, StaticGrid::kAll, 3);
  for (StaticGrid* grid : {&one, &several}) {
    for (const DenseView* view : {&with, &far, &without, &without, &without})
      grid->add(*view, Pose());
    grid->fill_far();
  }
  EXPECT_LT(static_points(one).size(), one.index().size()) << "there are votes";
  EXPECT_EQ(static_points(one), static_points(several));
}

TEST(StaticGrid, RefusesVoxelsWithoutSize) { EXPECT_THROW(StaticGrid(0), Error); }

}  // namespace
}  // namespace stillmap
