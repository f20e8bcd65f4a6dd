// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/site_frame.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/feature/tag_corners.hpp"
#include "stillmap/pipeline/saved_views.hpp"

#include <cmath>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using testing::HasSubstr;

const Pose kSiteMap(so3_exp({0.1, -0.2, 2.5}), {400, -30, 7});

std::vector<KnownPoint> corners() {
  std::vector<KnownPoint> points;
  for (const Eigen::Vector3d& p : {Eigen::Vector3d(0, 0, 1), Eigen::Vector3d(4, 0, 1),
                                   Eigen::Vector3d(4, 3, 1), Eigen::Vector3d(0, 3, 2.5)})
    points.push_back({fmt::format("p{}", points.size()), p, kSiteMap * p});
  return points;
}

/// Adds the first and only keyframe of a component; both have its number.
void add_keyframe(MapContent& map, std::uint32_t component) {
  Keyframe keyframe;
  keyframe.id = {component, 0};
  keyframe.component = component;
  map.keyframes.push_back(keyframe);
  map.first[component] = keyframe.id;
}

/// Adds a corner of a tag that a keyframe shows.
void add_corner(MapContent& map, std::uint32_t keyframe, std::uint32_t tag, std::uint8_t corner,
                const Eigen::Vector3d& p_world) {
  Landmark landmark;
  landmark.p_world = p_world;
  landmark.observations = {{{keyframe, 0}, corner}};
  landmark.descriptor = descriptor_of({{0, tag}, corner});
  map.landmarks.push_back(landmark);
}

/// A map of one keyframe, with the center of tag 7 at (5, 6, 7) and another landmark at (1, 1, 1).
SavedMap map_with_tag() {
  SavedMap saved;
  add_keyframe(saved.map, 0);
  for (std::uint8_t c = 0; c < 4; ++c)
    add_corner(saved.map, 0, 7, c, {c % 2 == 0 ? 4.0 : 6.0, c < 2 ? 5.0 : 7.0, 7});
  add_corner(saved.map, 0, 8, 0, {1, 1, 1});
  return saved;
}

/// A map of one keyframe at 12.5 s whose view shows a wall 2 m ahead; its rows from 60 on show a
/// person.
SavedMap map_of_wall() {
  SavedMap saved;
  add_keyframe(saved.map, 0);
  saved.map.keyframes[0].timestamp = 12.5;
  saved.map.keyframes[0].T_world_camera = kSiteMap;
  DenseView view;
  view.camera.fx = view.camera.fy = 50;
  view.camera.cx = 40, view.camera.cy = 30;
  view.stride = 2;
  view.depth = cv::Mat1w(60, 80, packed_depth(2));
  view.kind = cv::Mat1b(60, 80, kStaticSurface);
  view.kind.rowRange(30, 60) = kMoverSurface;
  saved.views.push_back({{0, 0}, Pose(), view});
  return saved;
}

TEST(SiteFrame, ExactPointsGiveTheExactPose) {
  const SiteAlignment alignment = align_to_site(corners());
  EXPECT_LT((alignment.T_site_map.inverse() * kSiteMap).translation().norm(), 1e-9);
  EXPECT_LT(alignment.T_site_map.quaternion().angularDistance(kSiteMap.quaternion()), 1e-9);
  ASSERT_EQ(alignment.errors.size(), 4U);
  for (const double error : alignment.errors) EXPECT_LT(error, 1e-9);
}

/// A survey that has two of three places twice.
TEST(SiteFrame, APointThatTheOthersDoNotCheckIsNoContradiction) {
  const double d = 0.005;  // errors of the points in the map [m]
  const std::vector<Eigen::Vector3d> site = {{0, 0, 0}, {4, 0, 0}, {2, 4, 0}, {0, 0, 0}, {4, 0, 0}};
  const std::vector<Eigen::Vector3d> errors = {
      {0, d, 0}, {0, 0, d}, {d, 0, d}, {0, -d, d}, {0, d, -d}};
  std::vector<KnownPoint> points;
  for (std::size_t i = 0; i < site.size(); ++i)
    points.push_back({std::to_string(i), site[i] + errors[i], kSiteMap * site[i]});
  const SiteAlignment alignment = align_to_site(points);
  EXPECT_TRUE(std::isnan(alignment.errors_of_others[2])) << "without it the rotation is unknown";
  EXPECT_LT(alignment.errors_of_others[0], 0.05);
  EXPECT_EQ(alignment.contradiction, "");
}

TEST(SiteFrame, AWrongPointIsFoundByTheOthers) {
  std::vector<KnownPoint> points = corners();
  points.push_back({"wrong", {2, 2, 0}, kSiteMap * Eigen::Vector3d(2.1, 2, 0)});
  const SiteAlignment alignment = align_to_site(points);
  EXPECT_NEAR(alignment.errors_of_others.back(), 0.1, 1e-9);
  EXPECT_LT(alignment.errors.back(), 0.1) << "it draws the alignment to itself";
  EXPECT_TRUE(align_to_site({points.begin(), points.begin() + 3}).errors_of_others.empty());
  EXPECT_EQ(alignment.contradiction, "") << "less than 5 % of the extent";
  points.back().p_site = kSiteMap * Eigen::Vector3d(2.5, 2, 0);
  EXPECT_THAT(align_to_site(points).contradiction, HasSubstr("wrong is 500 mm"));
  EXPECT_EQ(align_to_site(corners()).contradiction, "");
  points.back().p_site = kSiteMap * Eigen::Vector3d(2, 2, 90);
  EXPECT_THAT(error_of([&] { align_to_site(points); }), HasSubstr("wrong does not fit"));
}

TEST(SiteFrame, OfExchangedPointsNoneIsBlamed) {
  std::vector<KnownPoint> points = corners();
  points.push_back({"p4", {2, 2, 0}, kSiteMap * Eigen::Vector3d(2, 2, 0)});
  std::swap(points[0].p_site, points[4].p_site);
  EXPECT_THAT(align_to_site(points).contradiction, HasSubstr("contradict each other"));
}

/// Three points fit their mirror image.
TEST(SiteFrame, CamerasAreNotUpsideDown) {
  const Pose T_map_camera(so3_exp({-1.57, 0, 0}), {0, 0, 1});  // looks along y
  const auto reason = [&](double turn) {
    MapContent map;
    add_keyframe(map, 0);
    map.keyframes[0].T_world_camera =
        Pose(so3_exp({turn, 0, 0}), Eigen::Vector3d::Zero()) * T_map_camera;
    return reason_against_up(map, 0);
  };
  EXPECT_EQ(reason(0), "");
  EXPECT_EQ(reason(1.2), "") << "looks up";
  EXPECT_THAT(reason(3.1), HasSubstr("upside down"));
}

TEST(SiteFrame, PointsThatDetermineNoPoseAreRefused) {
  std::vector<KnownPoint> points = corners();
  EXPECT_THAT(error_of([&] {
                align_to_site({points.begin(), points.begin() + 2});
              }),
              HasSubstr("2 points"));
  for (KnownPoint& p : points) p.p_site *= 1000;
  EXPECT_THAT(error_of([&] { align_to_site(points); }), HasSubstr("1e+03 times"));
  for (std::size_t i = 0; i < points.size(); ++i) {
    points[i].p_map = {static_cast<double>(i), 0, 0};
    points[i].p_site = kSiteMap * points[i].p_map;
  }
  EXPECT_THAT(error_of([&] { align_to_site(points); }), HasSubstr("on a line"));
}

TEST(SiteFrame, PointsOnAPlanGiveThePoseOnTheFloor) {
  const auto file = test::own_path("points.csv");
  const SitePlan plan{0.02, 500, 400};
  // A map whose y axis points down, 1.5 m above the floor, turned by 0.7 on a plan.
  const Pose T_level_map(
      Eigen::Quaterniond::FromTwoVectors(-Eigen::Vector3d::UnitY(), Eigen::Vector3d::UnitZ())
          .toRotationMatrix(),
      {0, 0, 1.5});
  const Pose T_site_map = Pose(so3_exp({0, 0, 0.7}), {3, 4, 0}) * T_level_map;
  std::string text;
  for (const Eigen::Vector3d& p :
       {Eigen::Vector3d(0, 1, 0), Eigen::Vector3d(4, 0.3, 1), Eigen::Vector3d(1, -1, 3)}) {
    const Eigen::Vector3d p_site = T_site_map * p;
    text += fmt::format("p{},{},{},{},{},{}\n", p.x(), p.x(), p.y(), p.z(), p_site.x() / 0.02,
                        500 - p_site.y() / 0.02);
  }
  write_file(file, text);
  std::vector<KnownPoint> points = read_known_points(file, map_with_tag(), plan);
  const SiteAlignment alignment = align_to_plan(points, T_level_map);
  EXPECT_LT((alignment.T_site_map.inverse() * T_site_map).translation().norm(), 1e-4);
  EXPECT_LT(alignment.T_site_map.quaternion().angularDistance(T_site_map.quaternion()), 1e-4);
  for (const double error : alignment.errors) EXPECT_LT(error, 1e-4);
  points.push_back({"p3", {2, 0.5, 2}, T_site_map * Eigen::Vector3d(2, 0.5, 2)});
  points.push_back({"p4", {3, -0.5, 3}, T_site_map * Eigen::Vector3d(3, -0.5, 3)});
  for (KnownPoint& p : points) p.p_site.z() = 0;
  EXPECT_EQ(align_to_plan(points, T_level_map).contradiction, "") << "heights do not matter";
  points.back().p_site.x() += 0.5;
  EXPECT_THAT(align_to_plan(points, T_level_map).contradiction, HasSubstr("p4 is"));
  points.resize(3);
  for (KnownPoint& p : points) p.p_site.x() *= -1;
  EXPECT_THAT(error_of([&] { align_to_plan(points, T_level_map); }), HasSubstr("mirrored"));
  write_file(file, "a,0,0,0,0,0,0\n");
  const auto error = [&] { read_known_points(file, map_with_tag(), plan); };
  EXPECT_THAT(error_of(error), HasSubstr("7 values"));
  write_file(file, "a,0,0,0,401,0\n");
  EXPECT_THAT(error_of(error), HasSubstr("outside the plan of 400 x 500 pixels"));
}

TEST(SiteFrame, KnownPointsAreReadFromText) {
  const auto file = test::own_path("points.csv");
  write_file(file, "# name, map, site\ndoor,1,2.5,-3,10,20,30\n\nlamp; 1e-1; 0; 0; 1; 2; 3\r\n");
  const auto points = read_known_points(file, map_with_tag());
  ASSERT_EQ(points.size(), 2U);
  EXPECT_EQ(points[0].name, "door");
  EXPECT_EQ(points[0].p_map, Eigen::Vector3d(1, 2.5, -3));
  EXPECT_EQ(points[1].p_map, Eigen::Vector3d(0.1, 0, 0));
  EXPECT_EQ(points[1].p_site, Eigen::Vector3d(1, 2, 3));
  const auto error_with = [&](const std::string& line) {
    write_file(file, "a,0,0,0,0,0,0\n" + line);
    return error_of([&] { read_known_points(file, map_with_tag()); });
  };
  EXPECT_THAT(error_with("b,0,0,0,0,0"), HasSubstr(":2: has 6 values"));
  EXPECT_THAT(error_with("tag36h11:8,1,2,3"), HasSubstr("it has tag36h11:7"));
  std::vector<std::string> unseen;
  EXPECT_EQ(read_known_points(file, map_with_tag(), {}, &unseen).size(), 1U) << "the point a";
  EXPECT_EQ(unseen, std::vector<std::string>{"tag36h11:8"});
  write_file(file, "tag36h12:8,1,2,3\n");
  EXPECT_THAT(error_of([&] { read_known_points(file, map_with_tag(), {}, &unseen); }),
              HasSubstr("no tag 'tag36h12:8'"));
  EXPECT_THAT(error_with("tag36h11:7,1,2,z"), HasSubstr("'z' is no number"));
  EXPECT_THAT(error_with("a,0,0,0,1,0,0"), HasSubstr("names 'a' again"));
  EXPECT_THAT(error_with("b,0,0,x,0,0,0"), HasSubstr("'x' is no number"));
  EXPECT_THAT(error_with("b,0,0,nan,0,0,0"), HasSubstr("'nan' is no number"));
  EXPECT_THAT(error_with("b,0,0,0,4500000,0,0"), HasSubstr("subtract the same offset"));
  EXPECT_THAT(error_with("b,0,0,-9,0,0,0"), HasSubstr("nearest landmark is 10.1 m away"));
  write_file(file, "name,x,y,z,X,Y,Z\na,0,0,0,0,0,0\n");
  EXPECT_THAT(error_of([&] { read_known_points(file, map_with_tag()); }),
              HasSubstr(":1: is a heading"));
  std::filesystem::remove(file);
}

TEST(SiteFrame, TheCenterOfATagIsAKnownPoint) {
  const auto file = test::own_path("points.csv");
  write_file(file, "tag36h11:7,1,2,3\n");
  const auto points = read_known_points(file, map_with_tag());
  ASSERT_EQ(points.size(), 1U);
  EXPECT_EQ(points[0].name, "tag36h11:7");
  EXPECT_EQ(points[0].p_map, Eigen::Vector3d(5, 6, 7));
  EXPECT_EQ(points[0].p_site, Eigen::Vector3d(1, 2, 3));
  std::filesystem::remove(file);
}

TEST(SiteFrame, APixelOfAKeyframeIsAKnownPoint) {
  const auto file = test::own_path("points.csv");
  const auto read = [&](const std::string& line) {
    write_file(file, line);
    return read_known_points(file, map_of_wall());
  };
  const auto points = read("corner@12.5,100,20,1,2,3\n");
  ASSERT_EQ(points.size(), 1U);
  // Half of the image's columns and rows: (50 - 40) / 50 and (10 - 30) / 50 at 2 m.
  EXPECT_LT((points[0].p_map - kSiteMap * Eigen::Vector3d(0.4, -0.8, 2)).norm(), 1e-6);
  EXPECT_EQ(points[0].p_site, Eigen::Vector3d(1, 2, 3));
  const auto error_with = [&](const std::string& line) { return error_of([&] { read(line); }); };
  EXPECT_THAT(error_with("corner@12.6,100,20,1,2,3\n"), HasSubstr("nearest is that of 12.500000"));
  EXPECT_THAT(error_with("corner@12.5,100,80,1,2,3\n"), HasSubstr("(100, 80) shows no surface"));
  EXPECT_THAT(error_with("corner@12.5,400,20,1,2,3\n"), HasSubstr("(400, 20) shows no surface"));
  EXPECT_THAT(error_with("corner@noon,100,20,1,2,3\n"), HasSubstr("'noon' is no number"));
  EXPECT_THAT(error_with("corner,100,20,1,2,3\n"), HasSubstr("6 values"));
  std::filesystem::remove(file);
}

/// Two components, of which each has tag 7; of tag 8 one corner is missing.
TEST(SiteFrame, CentersOfTagsAreThoseOfTheWorld) {
  MapContent map;
  for (std::uint32_t i = 0; i < 2; ++i) {
    add_keyframe(map, i);
    for (std::uint8_t c = 0; c < 4; ++c) {
      add_corner(map, i, 7, c, {c * 0.1, 2.0 + i, c < 2 ? 1.0 : 2.0});
      if (c < 3) add_corner(map, i, 8, c, {0, 0, 0});
    }
  }
  const TagCenters centers = tag_centers(map, 0);
  ASSERT_EQ(centers.size(), 1U);
  EXPECT_LT((centers.at("tag36h11:7") - Eigen::Vector3d(0.15, 2, 1.5)).norm(), 1e-12);
}

/// The second component has more keyframes.
TEST(SiteFrame, TheMainComponentIsAligned) {
  SavedMap saved = map_with_tag();
  for (int i = 0; i < 2; ++i) add_keyframe(saved.map, 1);
  saved.map.keyframes[2].id = {2, 0};
  for (std::uint8_t c = 0; c < 4; ++c) add_corner(saved.map, 1, 9, c, {0, 0, 1});
  EXPECT_EQ(main_component(saved), 1U);
  const auto file = test::own_path("points.csv");
  write_file(file, "tag36h11:9,1,2,3\n");
  EXPECT_EQ(read_known_points(file, saved)[0].p_map, Eigen::Vector3d(0, 0, 1));
  EXPECT_FALSE(is_at_site(saved.map, 1));
  move_world(saved.map, 1, kSiteMap);
  EXPECT_TRUE(is_at_site(saved.map, 1));
  EXPECT_FALSE(is_at_site(saved.map, 0));
  std::filesystem::remove(file);
}

TEST(SiteFrame, OnlyTheWorldOfTheMapMoves) {
  MapContent map;
  for (std::uint32_t i = 0; i < 2; ++i) {
    add_keyframe(map, i);
    Landmark landmark;
    landmark.p_world = {1, 2, 3};
    landmark.observations = {{{i, 0}, 0}};
    map.landmarks.push_back(landmark);
  }
  move_world(map, 0, kSiteMap);
  EXPECT_EQ(map.keyframes[0].T_world_camera.translation(), kSiteMap.translation());
  EXPECT_EQ(map.landmarks[0].p_world, kSiteMap * Eigen::Vector3d(1, 2, 3));
  EXPECT_EQ(map.landmarks[0].normal, kSiteMap.quaternion() * Eigen::Vector3d::UnitZ());
  EXPECT_EQ(map.keyframes[1].T_world_camera.translation(), Eigen::Vector3d::Zero());
  EXPECT_EQ(map.landmarks[1].p_world, Eigen::Vector3d(1, 2, 3));
}

}  // namespace
}  // namespace stillmap
