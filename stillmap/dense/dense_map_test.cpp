// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/dense_map.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_memory.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/dense/map_mesh.hpp"
#include "stillmap/dense/occupancy.hpp"
#include "stillmap/dense/surfels.hpp"
#include "stillmap/dense/synthetic_frame.hpp"

#include <algorithm>
#include <limits>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <opencv2/core/utility.hpp>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

const Plane kWall{Eigen::Vector3d(0.1, -0.2, 1).normalized(), 2.5};

// Returns five camera poses that see the wall.
std::vector<Pose> five_poses() {
  std::vector<Pose> poses;
  for (int i = 0; i < 5; ++i) {
    poses.emplace_back(so3_exp({0.03 * i, -0.05 * i, 0.02}),
                       Eigen::Vector3d(0.2 * i, 0.05 * i, 0.1 * i));
  }
  return poses;
}

PoseLookup lookup_in(const std::vector<Pose>& poses) {
  return [&poses](std::uint64_t id) -> std::optional<Pose> {
    if (id >= poses.size()) return std::nullopt;
    return poses[id];
  };
}

// Returns the static cloud of a map with given poses.
ComposedCloud compose(const DenseMap& map, const PoseLookup& T_world_camera) {
  return cloud_of(map.place(T_world_camera));
}

DenseMap map_of_wall(const std::vector<Pose>& poses, const DenseOptions& options = {}) {
  DenseMap map(small_camera(), options);
  for (std::uint64_t id = 0; id < poses.size(); ++id) {
    map.add(id, view_of(small_camera(), poses[id], kWall), {});
  }
  return map;
}

TEST(DenseMap, FusesTheViewsOfAWallIntoTheWall) {
  const std::vector<Pose> poses = five_poses();
  const DenseMap map = map_of_wall(poses);
  const ComposedCloud composed = compose(map, lookup_in(poses));
  EXPECT_EQ(composed.keyframes, 5U);
  EXPECT_EQ(composed.keyframes_left_out, 0U);
  EXPECT_GT(composed.cloud.size(), 10000U);
  for (const Eigen::Vector3f& p : composed.cloud.points) {
    EXPECT_LT(kWall.distance(p.cast<double>()), 2e-4);
  }
}

TEST(DenseMap, UsesPosesThatChangeAfterwards) {
  const std::vector<Pose> poses = five_poses();
  const DenseMap map = map_of_wall(poses);
  const Pose correction(so3_exp({0.2, 0.1, -0.3}), {1, -2, 3});
  std::vector<Pose> corrected;
  for (const Pose& pose : poses) corrected.push_back(correction * pose);
  const Pose back = correction.inverse();
  const ComposedCloud composed = compose(map, lookup_in(corrected));
  EXPECT_GT(composed.cloud.size(), 10000U);
  for (const Eigen::Vector3f& p : composed.cloud.points) {
    EXPECT_LT(kWall.distance(back * p.cast<double>()), 2e-4);
  }
}

TEST(DenseMap, LeavesOutAndCountsKeyframesWithoutAPose) {
  std::vector<Pose> poses = five_poses();
  const DenseMap map = map_of_wall(poses);
  const double nan = std::numeric_limits<double>::quiet_NaN();
  poses[1] = Pose(Eigen::Quaterniond::Identity(), {0, nan, 0});
  poses.resize(3);
  const ComposedCloud composed = compose(map, lookup_in(poses));
  EXPECT_EQ(composed.keyframes, 2U);
  EXPECT_EQ(composed.keyframes_left_out, 3U);
  for (const Eigen::Vector3f& p : composed.cloud.points) ASSERT_TRUE(p.allFinite());
}

TEST(DenseMap, LeavesNoGhostOfAMaskedWalker) {
  const Camera camera = small_camera();
  const auto with_walker = [&](int step) {
    return frame_of(camera, [&](int u, int) { return std::abs(u - 20 * step) < 10 ? 1.0 : 2.0; });
  };
  DenseOptions plain;
  plain.evidence.remove_ghosts = false;  // masks alone, as in the papers
  DenseMap masked(camera, plain), unmasked(camera, plain);
  for (int step = 1; step < 8; ++step) {
    const RgbdFrame frame = with_walker(step);
    const cv::Mat1b mask = frame.depth < 1.5;
    masked.add(static_cast<std::uint64_t>(step), frame, mask);
    unmasked.add(static_cast<std::uint64_t>(step), frame, {});
  }
  const auto still = [](std::uint64_t) { return Pose(); };
  const auto ghosts = [&](const Cloud& cloud) {
    return std::count_if(cloud.points.begin(), cloud.points.end(),
                         [](const Eigen::Vector3f& p) { return p.z() < 1.9F; });
  };
  EXPECT_EQ(ghosts(compose(masked, still).cloud), 0);
  EXPECT_GT(ghosts(compose(unmasked, still).cloud), 1000);
  EXPECT_GT(ghosts(raw_cloud(masked.place(still))), 1000) << "includes the masked surfaces";
  // The wall behind the walker is complete, as other keyframes saw it.
  EXPECT_GT(compose(masked, still).cloud.size(), 0.9 * 80 * 60);
}

TEST(DenseMap, RemovesAndReplacesKeyframes) {
  const std::vector<Pose> poses = five_poses();
  DenseMap map = map_of_wall(poses);
  const DenseStatistics before = map.statistics();
  map.add(3, view_of(small_camera(), poses[3], kWall), {});
  EXPECT_EQ(map.statistics().pixels, before.pixels);
  EXPECT_EQ(map.statistics().keyframes, 5U);
  map.remove(3);
  map.remove(77);
  EXPECT_EQ(map.statistics().keyframes, 4U);
  EXPECT_EQ(compose(map, lookup_in(poses)).keyframes, 4U);
  for (const std::uint64_t id : {0U, 1U, 2U, 4U}) map.remove(id);
  EXPECT_EQ(map.statistics().pixels, 0U);
  EXPECT_TRUE(compose(map, lookup_in(poses)).cloud.empty());
}

TEST(DenseMap, WithManyPixelsReplacesViewsOfTheSameViewpoint) {
  const Pose here, elsewhere(Eigen::Quaterniond::Identity(), {0.5, 0, 0}),
      turned(so3_exp({0, 0.3, 0}), {0, 0, 0});
  DenseOptions options;
  options.many_pixels = 2 * static_cast<int>(map_of_wall({here}, {}).statistics().pixels);
  DenseMap map(small_camera(), options);
  const auto add = [&](std::uint64_t id, const Pose& pose) {
    map.add(id, view_of(small_camera(), pose, kWall), {}, pose);
  };
  std::uint64_t id = 0;
  for (const Pose& pose : {elsewhere, turned, here}) add(id++, pose);
  EXPECT_EQ(map.views().size(), 3U) << "no two are alike";
  for (; id < 100; ++id) {
    add(id, Pose(Eigen::Quaterniond::Identity(), {0.01 * static_cast<double>(id % 10), 0, 0}));
    EXPECT_EQ(map.views().size(), 3U);
  }
  EXPECT_EQ(map.statistics().superseded, 97U);
  EXPECT_TRUE(map.views().contains(0) && map.views().contains(1) && map.views().contains(99));
}

TEST(DenseMap, ReplacesWhatAnEarlierVisitSawToo) {
  constexpr std::uint64_t kFirst = 2, kEnd = kFirst + NewerViews::kEnough;
  std::vector<Pose> poses{Pose(), Pose(so3_exp({0, 3, 0}), {0, 0, 5})};
  for (std::uint64_t id = kFirst; id < kEnd; ++id)
    poses.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.002 * id, 0.1, -0.3));
  DenseMap map(small_camera());
  const auto add = [&](std::uint64_t id) {
    map.add(id, view_of(small_camera(), poses[id], id == 1 ? Plane{-kWall.n, -1} : kWall), {});
  };
  for (std::uint64_t id = 0; id < kFirst; ++id) add(id);
  map.replace_seen_again(kFirst, lookup_in(poses));
  EXPECT_EQ(map.views().size(), 2U) << "there is no newer view";
  for (std::uint64_t id = kFirst; id < kEnd; ++id) add(id);
  const auto visible = compose(map, lookup_in(poses)).cloud.size();
  map.replace_seen_again(kFirst, lookup_in(poses));
  EXPECT_EQ(map.statistics().superseded, 1U);
  EXPECT_FALSE(map.views().contains(0));
  EXPECT_EQ(map.views().size(), kEnd - 1) << "others show what nobody saw again";
  EXPECT_EQ(map.statistics().pixels, map.views().size() * map.views().at(1)->depth.total());
  EXPECT_GT(10 * compose(map, lookup_in(poses)).cloud.size(), 9 * visible);
}

// Options for a map of the wall whose views, all but the newest one or two, are kept in a file.
DenseOptions with_little_memory() {
  DenseMap one = map_of_wall({Pose()});
  one.close_view();
  DenseOptions options;
  options.memory = {2 * one.statistics().bytes_in_memory, test::own_path("views")};
  return options;
}

TEST(DenseMap, HasTheSameSurfacesWithAnyMemory) {
  const std::vector<Pose> poses = five_poses();
  const DenseOptions little = with_little_memory();
  const DenseMap in_memory = map_of_wall(poses), on_disk = map_of_wall(poses, little);
  EXPECT_EQ(in_memory.statistics().views_on_disk, 0U);
  EXPECT_EQ(on_disk.statistics().views_on_disk, 3U);
  EXPECT_EQ(on_disk.statistics().pixels, in_memory.statistics().pixels);
  const PlacedMap expected = in_memory.place(lookup_in(poses));
  const PlacedMap placed = on_disk.place(lookup_in(poses));
  EXPECT_EQ(cloud_of(placed).cloud, cloud_of(expected).cloud);
  EXPECT_EQ(raw_cloud(placed), raw_cloud(expected));
  EXPECT_EQ(make_mesh(placed), make_mesh(expected));
  std::filesystem::remove_all(little.memory.folder);
}

TEST(DenseMap, NeverHoldsMorePixelsThanItsMemory) {
  const std::vector<Pose> poses = five_poses();
  const DenseOptions options = with_little_memory();
  DenseMap map(small_camera(), options);
  for (std::uint64_t id = 0; id < poses.size(); ++id) {
    map.add(id, view_of(small_camera(), poses[id], kWall), {}, poses[id]);
    EXPECT_LE(map.statistics().bytes_in_memory, options.memory.limit);
    EXPECT_EQ(map.views().at(id)->pages, nullptr) << "the newest stays in memory";
  }
  const PlacedMap placed = map.place(lookup_in(poses));
  cloud_of(placed);
  raw_cloud(placed);
  make_mesh(placed);
  occupied_space(placed, Pose());
  surfels_of(placed, 0.1);
  EXPECT_EQ(test::resident_kib(options.memory.folder), 0) << "pages are dropped after their use";
  for (std::uint64_t id = 0; id < poses.size(); ++id) map.remove(id);
  EXPECT_EQ(map.statistics().bytes_in_memory, 0U);
  EXPECT_EQ(map.statistics().views_on_disk, 0U);
  EXPECT_GT(compose(map_of_wall(poses), lookup_in(poses)).cloud.size(), 0U);
  EXPECT_EQ(raw_cloud(placed), raw_cloud(map_of_wall(poses).place(lookup_in(poses))))
      << "a placed map keeps its views";
  std::filesystem::remove_all(options.memory.folder);
}

TEST(DenseMap, KeepsItsViewsInMemoryIfTheDiskIsFull) {
  const std::vector<Pose> poses = five_poses();
  const DenseOptions options = with_little_memory();
  DenseMap map(small_camera(), options);
  testing::internal::CaptureStderr();
  {
    const test::FullDisk full(1.5 * static_cast<double>(options.memory.limit / 2));
    for (std::uint64_t id = 0; id < poses.size(); ++id)
      map.add(id, view_of(small_camera(), poses[id], kWall), {});
  }
  const std::string warnings = testing::internal::GetCapturedStderr();
  EXPECT_NE(warnings.find("cannot be written"), std::string::npos) << warnings;
  EXPECT_EQ(warnings.find("warning"), warnings.rfind("warning")) << "told once";
  EXPECT_EQ(map.statistics().views_on_disk, 1U) << "the one that there was room for";
  EXPECT_EQ(compose(map, lookup_in(poses)).cloud,
            compose(map_of_wall(poses), lookup_in(poses)).cloud);
  std::filesystem::remove_all(options.memory.folder);
}

// Returns a map of the wall with poses for the live map.
DenseMap live_map_of_wall(const std::vector<Pose>& true_poses, const std::vector<Pose>& estimated,
                          const DenseOptions& options = {}) {
  DenseMap map(small_camera(), options);
  for (std::uint64_t id = 0; id < true_poses.size(); ++id) {
    map.add(id, view_of(small_camera(), true_poses[id], kWall), {}, estimated[id]);
  }
  return map;
}

TEST(DenseMap, KeepsFramesBetweenKeyframesOnlyForTheirNovelty) {
  const Camera camera = small_camera();
  const auto with_walker = [&](int at) {
    RgbdFrame frame =
        frame_of(camera, [&](int u, int) { return std::abs(u - at) < 16 ? 1.2 : 2.0; });
    return std::pair(frame, cv::Mat1b(frame.depth < 1.5));
  };
  DenseMap map(camera);
  const auto [first, first_mask] = with_walker(40);
  map.add(0, first, first_mask, Pose());
  EXPECT_FALSE(map.add_if_new(1, first, first_mask, Pose()));
  const auto [second, second_mask] = with_walker(110);  // The occluded wall is visible now.
  EXPECT_TRUE(map.add_if_new(2, second, second_mask, Pose()));
  EXPECT_FALSE(map.add_if_new(3, second, second_mask, Pose()));
  EXPECT_EQ(map.statistics().keyframes, 2U);

  DenseMap with_ghost(camera);
  with_ghost.add(0, first, {}, Pose());                                // without its mask
  EXPECT_TRUE(with_ghost.add_if_new(1, second, second_mask, Pose()));  // sees through the ghost
}

TEST(DenseMap, FarSurfacesAreNovelToo) {
  const Camera camera = small_camera();
  const auto with_far_part = [&](double z) {
    return frame_of(camera, [&](int u, int) { return u < 80 ? z : 2.0; });
  };
  DenseMap map(camera);
  map.add(0, with_far_part(0), {}, Pose());
  EXPECT_TRUE(map.add_if_new(1, with_far_part(3.5), {}, Pose()));
  EXPECT_FALSE(map.add_if_new(2, with_far_part(3.5), {}, Pose()));
}

TEST(DenseMap, AveragesTheFramesUntilTheNextView) {
  const Camera camera = small_camera();
  const auto wall_at = [&](double z) { return frame_of(camera, [&](int, int) { return z; }); };
  DenseMap map(camera);
  map.add(0, wall_at(2), {}, Pose());
  EXPECT_EQ(map.open_view(), 0U);
  map.fuse(wall_at(2.02), {}, Pose());
  const auto depth = [&] {
    return map.views().at(0)->depth(30, 40) * double{DenseView::kDepthUnit};
  };
  EXPECT_NEAR(depth(), 2, 2e-4) << "until the view is closed";
  map.add(1, wall_at(2), {}, Pose());
  EXPECT_NEAR(depth(), 2.01, 5e-4);
  map.close_view();
  EXPECT_FALSE(map.open_view());

  DenseOptions single;
  single.fuse = false;
  DenseMap apart(camera, single);
  apart.add(0, wall_at(2), {}, Pose());
  EXPECT_FALSE(apart.open_view());
}

// A wall behind a person, who is gone in the next frame.
TEST(DenseMap, ViewsHaveTheirPhotosAndKnowThePixelsOfOtherFrames) {
  const Camera camera = small_camera();
  const auto wall = [&](int gray) {
    RgbdFrame frame = frame_of(camera, [](int, int) { return 2.0; });
    frame.color.setTo(cv::Scalar::all(gray));
    return frame;
  };
  RgbdFrame with_person = wall(100);
  const cv::Rect person(60, 20, 30, 80);
  with_person.depth(person).setTo(1.2F);
  with_person.color(person).setTo(cv::Scalar::all(250));
  cv::Mat1b mask = cv::Mat1b::zeros(camera.height, camera.width);
  mask(person) = 255;
  for (const bool fuse : {true, false}) {
    DenseOptions options;
    options.fuse = fuse;
    DenseMap map(camera, options);
    map.add(0, with_person, mask, Pose());
    map.fuse(wall(100), {}, Pose());
    map.close_view();
    const DenseView& view = *map.views().at(0);
    const cv::Mat3b photo = image_of(view.photo);
    ASSERT_EQ(photo.size(), cv::Size(camera.width, camera.height));
    EXPECT_NEAR(photo(10, 10)[0], 100, 5);
    EXPECT_NEAR(photo(60, 75)[0], 250, 5);
    const cv::Mat1b others = pixels_of_others(view, photo);
    EXPECT_EQ(others(5, 5), 0);
    EXPECT_EQ(others(30, 37), fuse ? 255 : 0);
  }
}

// Returns the range of the points along the wall's normal without the outermost 1 % on each side
// [m].
double thickness(const StaticGrid& grid) {
  std::vector<double> heights;
  for (std::uint32_t i = 0; i < grid.index().size(); ++i)
    heights.push_back(kWall.n.dot(grid.mean(i).cast<double>()));
  std::sort(heights.begin(), heights.end());
  const std::size_t margin = heights.size() / 100;
  return heights[heights.size() - 1 - margin] - heights[margin];
}

TEST(DenseMap, MergesTwoWallsAfterALoopIsClosed) {
  // The wall is visited twice, the second time with a drift of 8 cm and two degrees.
  std::vector<Pose> truth = five_poses();
  const std::vector<Pose> again = five_poses();
  truth.insert(truth.end(), again.begin(), again.end());
  std::vector<Pose> drifted = truth;
  const Pose drift(so3_exp({0.02, 0.03, 0}), {0.01, 0.02, 0.08});
  for (std::size_t i = 5; i < drifted.size(); ++i) drifted[i] = drift * drifted[i];

  DenseMap map = live_map_of_wall(truth, drifted);
  EXPECT_GT(thickness(map.live().grid()), 0.05);
  map.update_poses(lookup_in(drifted));  // The poses are unchanged.
  EXPECT_EQ(map.statistics().replacements, 0U);
  map.update_poses(lookup_in(truth));
  EXPECT_EQ(map.statistics().replacements, 1U);
  while (map.live().waiting() > 0) map.update_poses(lookup_in(truth));
  EXPECT_EQ(map.statistics().replacements, 1U);
  EXPECT_LT(thickness(map.live().grid()), 1e-3);
}

TEST(DenseMap, HasTheSameLiveMapWithAnyMemory) {
  const std::vector<Pose> once = five_poses();
  std::vector<Pose> poses = once, moved;
  for (int i = 0; i < 2; ++i) poses.insert(poses.end(), once.begin(), once.end());
  for (const Pose& pose : poses) moved.push_back(Pose(so3_exp({0, 0.02, 0}), {0, 0, 0.1}) * pose);
  const auto live_cloud = [&](const DenseOptions& options) {
    DenseMap map = live_map_of_wall(poses, poses, options);
    map.update_poses(lookup_in(moved));
    while (map.live().waiting() > 0) map.update_poses(lookup_in(moved));
    const StaticGrid& grid = map.live().grid();
    Cloud cloud;
    for (std::uint32_t i = 0; i < grid.index().size(); ++i)
      if (grid.is_static(i)) cloud.add(grid.mean(i), grid.color(i));
    return cloud;
  };
  const DenseOptions little = with_little_memory();
  EXPECT_EQ(live_cloud(little), live_cloud({}));
  EXPECT_EQ(test::resident_kib(little.memory.folder), 0);
  std::filesystem::remove_all(little.memory.folder);
}

TEST(DenseMap, IsRebuiltAFewViewsAtATimeNearestFirst) {
  // The camera moves along the wall and back.
  std::vector<Pose> poses;
  for (int i = 0; i < 30; ++i)
    poses.emplace_back(Eigen::Quaterniond::Identity(), Eigen::Vector3d(0.2 * i, 0, 0));
  for (int i = 29; i >= 0; --i) poses.push_back(poses[static_cast<std::size_t>(i)]);
  std::vector<Pose> moved;
  for (const Pose& pose : poses) moved.push_back(Pose(so3_exp({0, 0.02, 0}), {0, 0, 0.1}) * pose);
  DenseMap map = live_map_of_wall(poses, poses);
  map.update_poses(lookup_in(moved));
  EXPECT_EQ(map.live().waiting(), poses.size() - LiveMap::kAtOnce);
  const DenseView here =
      make_dense_view(small_camera(), view_of(small_camera(), poses.back(), kWall), {}, {}, {})
          .view;
  const Novelty novelty = map.live().novelty_of(here, moved.back());
  EXPECT_GT(novelty.pixels_examined, 30U);
  EXPECT_EQ(novelty.new_pixels, 0U) << "the surfaces in view are restored first";
}

TEST(DenseMap, HasCoarserVoxelsAboveTheBound) {
  const std::vector<Pose> poses = five_poses();
  DenseOptions options;
  const std::size_t all = compose(map_of_wall(poses, options), lookup_in(poses)).cloud.size();
  options.max_voxels = static_cast<int>(all) - 1;
  const PlacedMap placed = map_of_wall(poses, options).place(lookup_in(poses));
  EXPECT_DOUBLE_EQ(placed.grid->edge(), 2 * options.voxel);
  EXPECT_GT(placed.cells.size(), all / 8);
}

TEST(DenseMap, DropsVoxelsWithTooFewKeyframes) {
  const std::vector<Pose> poses = five_poses();
  DenseOptions options;
  const std::size_t all = compose(map_of_wall(poses, options), lookup_in(poses)).cloud.size();
  options.voxel = 0.05;
  options.evidence.remove_ghosts = false;
  options.min_keyframes = 5;
  const ComposedCloud by_all = compose(map_of_wall(poses, options), lookup_in(poses));
  EXPECT_GT(by_all.cloud.size(), 50U);
  EXPECT_LT(by_all.cloud.size(), all);
  EXPECT_GT(by_all.voxels_left_out, 0U);
  const Camera camera = small_camera();
  for (const Eigen::Vector3f& p : by_all.cloud.points) {
    for (const Pose& pose : poses) {  // in every view, with a tolerance of a voxel at its border
      const Eigen::Vector3d seen = pose.inverse() * p.cast<double>();
      const Eigen::Vector2d pixel = camera.project(seen);
      EXPECT_TRUE(camera.contains(pixel.x(), pixel.y(), -5)) << pixel.transpose();
    }
  }
}

TEST(DenseMap, IsTheSameOnAnyThreadAndInAnyOrder) {
  const std::vector<Pose> poses = five_poses();
  const Cloud expected = compose(map_of_wall(poses), lookup_in(poses)).cloud;
  const int threads_before = cv::getNumThreads();
  std::vector<Cloud> clouds(4);
  std::vector<std::jthread> threads;
  cv::setNumThreads(3);
  for (Cloud& cloud : clouds) {
    threads.emplace_back([&] {
      DenseMap map(small_camera());
      for (std::uint64_t id = 5; id-- > 0;)
        map.add(id, view_of(small_camera(), poses[id], kWall), {});
      cloud = compose(map, lookup_in(poses)).cloud;
    });
  }
  threads.clear();
  cv::setNumThreads(threads_before);
  for (const Cloud& cloud : clouds) EXPECT_EQ(cloud, expected);
}

TEST(DenseMap, IsUnchangedByARefusedFrame) {
  const std::vector<Pose> poses = five_poses();
  DenseMap map = map_of_wall(poses);
  const Cloud before = compose(map, lookup_in(poses)).cloud;
  RgbdFrame frame = view_of(small_camera(), poses[0], kWall);
  EXPECT_THROW(map.add(0, frame, cv::Mat1b(3, 3)), Error);
  frame.color = cv::Mat();
  EXPECT_THROW(map.add(0, frame, {}), Error);
  EXPECT_EQ(compose(map, lookup_in(poses)).cloud, before);
}

}  // namespace
}  // namespace stillmap
