// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/merge_maps.hpp"
#include "stillmap/pipeline/site_frame.hpp"
#include "stillmap/pipeline/visits_test.hpp"

#include <fmt/format.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using visits::Outcome, visits::Visit;

const SlamParameters& parameters() {
  static const SlamParameters made = [] {
    SlamParameters options = recorded::small_options("static");
    options.tags = "tag36h11";
    options.dense_cloud = false;
    return options;
  }();
  return made;
}

/// Returns frames of a camera of 480 x 360 pixels near a point of the office, whose walls have
/// tags.
Visit visit_at(const CameraAnchor& viewpoint) {
  SimulationOptions options;
  options.people = 0;
  options.frames = 60;
  options.tags = 12;
  options.width = 480;
  options.height = 360;
  static const SimulatedSequence any(options);
  auto scene = std::make_shared<Scene>(any.scene());
  scene->viewpoint = viewpoint;
  Visit visit;
  visit.sequence = std::make_shared<SimulatedSequence>(options, any.camera(), scene);
  for (std::size_t i = 0; i < visit.sequence->frames(); ++i)
    visit.frames.push_back(visit.sequence->frame(i));
  return visit;
}

/// Two visits that look at tag 0, in the middle of the east wall's southern half, from both sides.
struct Sides {
  Visit south = visit_at({{5.3, 0.35, 1.5}, {6.39, 1.0, 1.55}});
  Visit north = visit_at({{5.3, 2.0, 1.5}, {6.39, 0.95, 1.55}});
  Outcome of_south = visits::run(south, std::nullopt, parameters());
  Outcome of_north = visits::run(north, std::nullopt, parameters());
};

const Sides& sides() {
  static const Sides made;
  return made;
}

/// Returns the position of a tag's center in the world of the truth.
Eigen::Vector3d true_center(std::uint32_t id) {
  const PlacedTag& tag = sides().south.sequence->scene().tags.at(id);
  return (tag.corners[0] + tag.corners[1] + tag.corners[2] + tag.corners[3]) / 4;
}

TEST(Tags, CentersInTheMapAreThoseOfTheScene) {
  const MapContent& map = sides().of_south.map.map;
  const TagCenters centers = tag_centers(map, 0);
  ASSERT_TRUE(centers.contains("tag36h11:0"));
  const Pose T_truth_map = sides().south.sequence->trajectory().front().T_world_camera *
                           map.keyframes.front().T_world_camera.inverse();
  EXPECT_LT((T_truth_map * centers.at("tag36h11:0") - true_center(0)).norm(), 0.02);
}

TEST(Tags, JoinMapsThatNothingElseConnects) {
  const auto merged_with = [](const SavedMap& south, const SavedMap& north) {
    return merge_maps({{"south", south}, {"north", north}}, parameters(), "test");
  };
  const MergedMap merged = merged_with(sides().of_south.map, sides().of_north.map);
  ASSERT_EQ(merged.pairs.size(), 1U);
  ASSERT_TRUE(merged.pairs[0].connected) << merged.pairs[0].reason;
  EXPECT_EQ(merged.pairs[0].inliers, 4) << "corners of one tag";
  const auto true_pose = [](const Visit& visit, const Keyframe& k) {
    return visit.sequence->trajectory().at(k.frame_index).T_world_camera;
  };
  // Sessions are numbered in the order of the merge, so the truth of both is tried.
  const Keyframe &first = merged.saved.map.keyframes.front(),
                 &last = merged.saved.map.keyframes.back();
  ASSERT_NE(first.session, last.session);
  const Pose moved = first.T_world_camera.inverse() * last.T_world_camera;
  const Pose one = true_pose(sides().south, first).inverse() * true_pose(sides().north, last);
  const Pose other = true_pose(sides().north, first).inverse() * true_pose(sides().south, last);
  const bool is_one =
      (one.inverse() * moved).translation().norm() < (other.inverse() * moved).translation().norm();
  const Pose error = (is_one ? one : other).inverse() * moved;
  EXPECT_LT(error.translation().norm(), 0.03) << "meters";
  EXPECT_LT(error.angle(), 0.02) << "radians";
  SlamParameters without = parameters();
  without.tags = "none";
  const MergedMap apart = merged_with(visits::run(sides().south, std::nullopt, without).map,
                                      visits::run(sides().north, std::nullopt, without).map);
  EXPECT_FALSE(apart.pairs[0].connected) << "the test needs views that do not look alike";
}

}  // namespace
}  // namespace stillmap
