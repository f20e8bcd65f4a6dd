// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/tag_matching.hpp"

#include "stillmap/map/tag_landmarks.hpp"
#include "stillmap/map/test_tag_views.hpp"

#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::tag_camera, test::tag_corner;

/// Centers of tags 0, 1, 2, of side 0.2 m, which face the camera [m].
const std::vector<Eigen::Vector3d> kTags = {{-0.6, 0, 2.5}, {0.5, 0.2, 2}, {0.1, -0.5, 3}};

/// Adds three keyframes, 0.1 m apart, that see the tags at these centers. Poses and landmarks have
/// the drift of their side of the map.
std::vector<KeyframeId> add_side(Map& map, std::uint32_t component,
                                 const std::vector<Eigen::Vector3d>& tags, const Pose& drift) {
  std::vector<KeyframeId> ids;
  for (int view = 0; view < 3; ++view) {
    const Pose T_world_camera(Eigen::Quaterniond::Identity(), {0.1 * view, 0, 0});
    ids.push_back(test::add_tag_view(map, component, T_world_camera, tags));
    map.set_pose(ids.back(), drift * T_world_camera);
    for (std::uint32_t k = 0; k < map.at(ids.back()).landmarks.size(); ++k) {
      if (view == 0)
        map.add_landmark(drift * tag_corner(tags[k / 4], static_cast<int>(k % 4)), {ids[0], k});
      else
        map.observe(map.at(ids[0]).landmarks[k], {ids.back(), k});
    }
  }
  return ids;
}

/// A map of one component whose second side has drifted.
struct Revisit {
  Map map{tag_camera(), {}};
  std::vector<KeyframeId> before, after;

  Revisit(const std::vector<Eigen::Vector3d>& tags_after, const Pose& drift) {
    const std::uint32_t component = map.new_component();
    before = add_side(map, component, kTags, Pose());
    after = add_side(map, component, tags_after, drift);
  }
};

const Pose kDrift(so3_exp({0.02, -0.05, 0.03}), {0.2, -0.1, 0.05});

Pose error_of(const Revisit& revisit, const LoopMatch& match, const Pose& drift) {
  const Pose T_world_query =
      revisit.map.at(match.candidate).T_world_camera * match.T_candidate_query;
  return (drift.inverse() * revisit.map.at(match.query).T_world_camera).inverse() * T_world_query;
}

TEST(TagMatching, ThePlaceOfTheSameTagsIsFoundAndItsMotionIsExact) {
  for (const std::size_t tags : {1U, 3U}) {
    const Revisit revisit({kTags.begin(), kTags.begin() + static_cast<std::ptrdiff_t>(tags)},
                          kDrift);
    const auto places = places_with_same_tags(revisit.map, revisit.after[2]);
    ASSERT_EQ(places, std::vector<KeyframeId>{revisit.before[0]});
    const LoopVerification found = verify_tags(revisit.map, revisit.after[2], places[0]);
    ASSERT_TRUE(found.match) << found.reason;
    EXPECT_TRUE(found.match->same_component);
    EXPECT_EQ(found.match->inliers, static_cast<int>(4 * tags));
    const Pose error = error_of(revisit, *found.match, kDrift);
    EXPECT_LT(error.translation().norm(), 1e-9);
    EXPECT_LT(error.angle(), 1e-9);
  }
}

TEST(TagMatching, AMovedTagIsOutvoted) {
  std::vector<Eigen::Vector3d> tags = kTags;
  tags[0].x() += 0.4;
  const Revisit revisit(tags, kDrift);
  const LoopVerification found = verify_tags(revisit.map, revisit.after[0], revisit.before[0]);
  ASSERT_TRUE(found.match) << found.reason;
  EXPECT_EQ(found.match->inliers, 8);
  EXPECT_LT(error_of(revisit, *found.match, kDrift).translation().norm(), 1e-9);
}

TEST(TagMatching, MoreThanDriftIsRefused) {
  const Pose far(Eigen::Quaterniond::Identity(), {2, 0, 0});
  const Revisit revisit(kTags, far);
  const LoopVerification found = verify_tags(revisit.map, revisit.after[0], revisit.before[0]);
  EXPECT_FALSE(found.match);
  EXPECT_NE(found.reason.find("exceeds the drift"), std::string::npos) << found.reason;
}

TEST(TagMatching, CornersSeenTooRarelyDoNotCount) {
  Revisit revisit(kTags, kDrift);
  for (const LandmarkId id : std::vector<LandmarkId>(revisit.map.at(revisit.before[0]).landmarks))
    for (const std::size_t view : {1U, 2U}) revisit.map.forget(id, revisit.before[view]);
  EXPECT_TRUE(places_with_same_tags(revisit.map, revisit.after[2]).empty());
  EXPECT_FALSE(verify_tags(revisit.map, revisit.after[0], revisit.before[0]).match);
}

TEST(TagMatching, EachOtherComponentHasOnePlace) {
  Revisit revisit(kTags, kDrift);
  const auto other = add_side(revisit.map, revisit.map.new_component(), kTags, Pose());
  EXPECT_EQ(places_with_same_tags(revisit.map, revisit.after[1]),
            (std::vector<KeyframeId>{revisit.before[0], other[0]}));
  const LoopVerification found = verify_tags(revisit.map, revisit.after[1], other[0]);
  ASSERT_TRUE(found.match) << found.reason;
  EXPECT_FALSE(found.match->same_component);
}

TEST(TagMatching, CornersNearEachOtherAreWelded) {
  const Pose small(Eigen::Quaterniond::Identity(), {0.05, 0, 0});
  std::vector<Eigen::Vector3d> tags = kTags;
  tags[2].y() += 0.4;
  Revisit revisit(tags, small);
  EXPECT_EQ(weld_tags(revisit.map, revisit.before, revisit.after), 8);
  const auto& before = revisit.map.at(revisit.before[0]).landmarks;
  const auto& after = revisit.map.at(revisit.after[0]).landmarks;
  for (std::size_t i = 0; i < 12; ++i) EXPECT_EQ(before[i] == after[i], i < 8) << i;
  EXPECT_EQ(weld_tags(revisit.map, revisit.before, revisit.after), 0);
  EXPECT_TRUE(places_with_same_tags(revisit.map, revisit.after[0]).empty()) << "one place now";
}

}  // namespace
}  // namespace stillmap
