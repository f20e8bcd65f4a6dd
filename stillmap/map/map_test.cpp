// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/map.hpp"

#include "stillmap/map/local_map.hpp"
#include "stillmap/map/visibility.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr std::size_t kKeypoints = 20;

FeaturesPtr features() {
  auto made = std::make_shared<Features>();
  for (std::size_t i = 0; i < kKeypoints; ++i) {
    made->keypoints.push_back({.u = 10.0F * static_cast<float>(i), .v = 100, .depth = 2});
    made->descriptors.push_back({i, 0, 0, 0});
  }
  return made;
}

class MapTest : public ::testing::Test {
 protected:
  KeyframeId keyframe(const Pose& pose = {}, std::uint32_t component = 0) {
    Keyframe made;
    made.component = component;
    made.T_world_camera = pose;
    made.features = features();
    made.static_weight.assign(kKeypoints, 1);
    return map_.add_keyframe(std::move(made)).id;
  }
  LandmarkId landmark(KeyframeId keyframe, std::uint32_t keypoint) {
    return map_.add_landmark({0, 0, 2}, {keyframe, keypoint}).id;
  }
  /// Checks the invariant of Map.
  void expect_consistent() const {
    map_.for_each_keyframe([&](const Keyframe& k) {
      for (std::uint32_t i = 0; i < k.landmarks.size(); ++i) {
        if (!k.landmarks[i].valid()) continue;
        const Landmark* l = map_.find(k.landmarks[i]);
        ASSERT_NE(l, nullptr);
        EXPECT_EQ(
            std::count_if(l->observations.begin(), l->observations.end(),
                          [&](const auto& o) { return o.keyframe == k.id && o.keypoint == i; }),
            1);
      }
    });
    map_.for_each_landmark([&](const Landmark& l) {
      EXPECT_FALSE(l.observations.empty());
      for (const Observation& o : l.observations) {
        EXPECT_EQ(map_.at(o.keyframe).landmarks[o.keypoint], l.id);
      }
    });
  }

  Camera camera_;
  Map map_{camera_, PyramidShape{}};
};

TEST_F(MapTest, AKeypointShowsOneLandmarkAndAKeyframeObservesItOnce) {
  const auto a = keyframe(), b = keyframe();
  const auto l = landmark(a, 3), m = landmark(a, 4);
  EXPECT_TRUE(map_.observe(l, {b, 5}));
  EXPECT_FALSE(map_.observe(m, {b, 5})) << "the keypoint already shows l";
  EXPECT_FALSE(map_.observe(l, {b, 6})) << "b already observes l";
  expect_consistent();
}

TEST_F(MapTest, MergingMovesObservationsAndKeepsExistingOnes) {
  const auto a = keyframe(), b = keyframe(), c = keyframe();
  const auto keep = landmark(a, 1), drop = landmark(a, 2);
  map_.observe(keep, {b, 1});
  map_.observe(drop, {b, 2});
  map_.observe(drop, {c, 2});
  map_.merge(keep, drop);
  EXPECT_EQ(map_.find(drop), nullptr);
  EXPECT_EQ(map_.at(keep).observations.size(), 3U);
  EXPECT_EQ(map_.at(c).landmarks[2], keep);
  EXPECT_FALSE(map_.at(a).landmarks[2].valid());
  expect_consistent();
}

TEST_F(MapTest, ALandmarkWithoutObservationsIsErased) {
  const auto a = keyframe(), b = keyframe();
  const auto l = landmark(a, 1);
  map_.observe(l, {b, 1});
  map_.forget(l, a);
  EXPECT_NE(map_.find(l), nullptr);
  map_.forget(l, b);
  EXPECT_EQ(map_.find(l), nullptr);
  EXPECT_EQ(map_.landmark_count(), 0U);
  expect_consistent();
}

TEST_F(MapTest, AnErasedIdIsNeverReused) {
  const auto a = keyframe();
  const auto old = landmark(a, 1);
  map_.erase(old);
  const auto fresh = landmark(a, 1);
  EXPECT_EQ(fresh.slot, old.slot) << "the slot is reused, so memory stays bounded";
  EXPECT_EQ(map_.find(old), nullptr);
  EXPECT_NE(map_.find(fresh), nullptr);
}

TEST_F(MapTest, FramesOfAnErasedKeyframeFollowItsReplacement) {
  const Pose at_a(so3_exp({0, 0.1, 0}), {1, 0, 0}), at_b(so3_exp({0.2, 0, 0}), {1, 2, 0});
  const auto a = keyframe(at_a), b = keyframe(at_b);
  const Pose T_b_frame(so3_exp({0, 0, 0.3}), {0.1, 0, 0});
  const Pose before = map_.resolve(b, T_b_frame);
  map_.erase(b, a);
  EXPECT_EQ(map_.current_keyframe(b), a);
  EXPECT_LT((before.inverse() * map_.resolve(b, T_b_frame)).log().norm(), 1e-12);

  const Pose shift(so3_exp({0, 0, 0.5}), {0, 0, 1});
  map_.set_pose(a, shift * at_a);
  EXPECT_LT(((shift * before).inverse() * map_.resolve(b, T_b_frame)).log().norm(), 1e-12);
  expect_consistent();
}

TEST_F(MapTest, CovisibleKeyframesAreSortedBySharedLandmarks) {
  const auto a = keyframe(), b = keyframe(), c = keyframe(), alone = keyframe();
  for (std::uint32_t i = 0; i < 6; ++i) {
    const auto l = landmark(a, i);
    map_.observe(l, {c, i});
    if (i < 3) map_.observe(l, {b, i});
  }
  const auto all = map_.covisible(a);
  ASSERT_EQ(all.size(), 2U);
  EXPECT_EQ(all[0].keyframe, c);
  EXPECT_EQ(all[0].shared, 6);
  EXPECT_EQ(all[1].keyframe, b);
  EXPECT_EQ(all[1].shared, 3);
  EXPECT_EQ(map_.covisible(a, 4).size(), 1U);
  EXPECT_TRUE(map_.covisible(alone).empty());
}

TEST_F(MapTest, TheBestViewShowsMostLandmarksAndIsTheNewest) {
  const auto a = keyframe(), b = keyframe(), c = keyframe();
  std::vector<LandmarkId> seen = {LandmarkId{}};
  for (std::uint32_t i = 0; i < 4; ++i) {
    seen.push_back(landmark(a, i));
    if (i < 3) map_.observe(seen.back(), {b, i});
    if (i < 3) map_.observe(seen.back(), {c, i});
  }
  EXPECT_EQ(best_view(map_, seen), a);
  seen.pop_back();
  EXPECT_EQ(best_view(map_, seen), c) << "all three observe the rest";
  EXPECT_FALSE(best_view(map_, std::span(seen).first(1)).valid());
}

TEST_F(MapTest, TheDescriptorIsTheMedoid) {
  const auto a = keyframe(), b = keyframe(), c = keyframe();
  const auto l = landmark(a, 0);  // 0b00000
  map_.observe(l, {b, 1});        // 0b00001
  map_.observe(l, {c, 3});        // 0b00011
  map_.refresh(l);
  EXPECT_EQ(map_.at(l).descriptor, (Descriptor{1, 0, 0, 0}));
}

TEST_F(MapTest, EachComponentHasAFirstKeyframe) {
  const auto a = keyframe(), b = keyframe(), other = keyframe({}, 1);
  EXPECT_TRUE(map_.is_first(a));
  EXPECT_FALSE(map_.is_first(b));
  EXPECT_TRUE(map_.is_first(other));
}

TEST_F(MapTest, AnotherMapIsAddedAsOlderOrYoungerComponents) {
  const auto old = keyframe(Pose(so3_exp({0, 0, 0}), {7, 0, 0})), second = keyframe({}, 1);
  const auto l = landmark(old, 3);
  map_.observe(l, {second, 4});
  const MapContent other = map_.content();
  for (const MapAge age : {MapAge::kOlder, MapAge::kYounger}) {
    map_ = Map(camera_, PyramidShape{});
    const auto erased = keyframe(), here = keyframe({}, 1);
    const auto shown = landmark(here, 5);
    map_.erase(erased, here);  // leaves a free slot
    const std::uint32_t session = map_.session();
    const std::vector<KeyframeId> added = map_.add(other, age);
    ASSERT_EQ(added.size(), 2U);
    expect_consistent();
    EXPECT_EQ(map_.keyframe_count(), 3U);
    EXPECT_EQ(map_.at(added[0]).T_world_camera.translation().x(), 7);
    EXPECT_EQ(map_.at(here).landmarks[5], shown);
    const LandmarkId moved = map_.at(added[0]).landmarks[3];
    EXPECT_EQ(map_.at(added[1]).landmarks[4], moved);
    EXPECT_EQ(map_.at(moved).observations.front().keyframe, added[0]);
    const bool older = age == MapAge::kOlder;
    EXPECT_EQ(map_.at(here).component, older ? 3U : 1U);
    EXPECT_EQ(map_.at(added[0]).component, older ? 0U : 2U);
    EXPECT_EQ(map_.at(added[1]).component, older ? 1U : 3U);
    EXPECT_TRUE(map_.is_first(added[0]) && map_.is_first(added[1]) && map_.is_first(here));
    EXPECT_NE(map_.at(added[0]).session, session);
    EXPECT_GT(map_.at(added[0]).sequence, map_.at(here).sequence);
    EXPECT_EQ(map_.new_component(), 4U);
    EXPECT_EQ(map_.content().keyframes.size(), 3U);
  }
}

TEST_F(MapTest, ALocalMapHoldsOnlyTheNeighbors) {
  const auto a = keyframe(), b = keyframe(), far = keyframe();
  std::vector<LandmarkId> shared;
  for (std::uint32_t i = 0; i < 12; ++i) {
    shared.push_back(landmark(a, i));
    map_.observe(shared.back(), {b, i});
  }
  const auto only_b = landmark(b, 15);
  const auto elsewhere = landmark(far, 0);
  const auto local = make_local_map(map_, a);
  EXPECT_EQ(local->reference, a);
  ASSERT_EQ(local->keyframes.size(), 2U);
  EXPECT_EQ(local->keyframes[0].id, a);
  EXPECT_EQ(local->landmarks.size(), 13U);
  EXPECT_NE(local->find(only_b), nullptr);
  EXPECT_EQ(local->find(elsewhere), nullptr);
  EXPECT_EQ(local->find(shared[0])->observations, 2);
}

TEST_F(MapTest, OnlyTheOldestComponentHasTheWorldOfTheSavedMapLoadedLast) {
  const auto of_saved_map = [&](KeyframeId id) { return make_local_map(map_, id)->of_saved_map; };
  const auto oldest = keyframe({}, 0), unconnected = keyframe({}, 1);
  EXPECT_FALSE(of_saved_map(oldest)) << "of the present run";
  const MapContent saved = map_.content();
  map_ = Map(saved);
  const auto here = keyframe({}, map_.new_component());
  EXPECT_TRUE(of_saved_map(oldest));
  EXPECT_FALSE(of_saved_map(unconnected));
  EXPECT_FALSE(of_saved_map(here));
  const KeyframeId added = map_.add(saved, MapAge::kOlder).front();
  EXPECT_TRUE(of_saved_map(added));
  EXPECT_FALSE(of_saved_map(oldest)) << "of the map loaded before";
}

TEST_F(MapTest, WhatTheRunMadeInAComponentIsErasedAndASavedMapInItStays) {
  const auto saved = keyframe({}, 0);
  const auto shared = landmark(saved, 0);
  map_ = Map(map_.content());
  const auto here = keyframe({}, map_.new_component()),
             elsewhere = keyframe({}, map_.new_component());
  const auto only_here = landmark(here, 1);
  EXPECT_TRUE(map_.observe(shared, {here, 0}));
  map_.join_components(0, map_.at(here).component);
  map_.erase_made_in(0);
  EXPECT_EQ(map_.find(here), nullptr);
  EXPECT_FALSE(map_.current_keyframe(here).valid());
  EXPECT_EQ(map_.find(only_here), nullptr);
  ASSERT_NE(map_.find(saved), nullptr);
  EXPECT_EQ(map_.at(shared).observations.size(), 1U);
  map_.erase_made_in(map_.at(elsewhere).component);
  EXPECT_EQ(map_.find(elsewhere), nullptr);
  EXPECT_EQ(map_.components(), std::vector<std::uint32_t>{0});
}

TEST_F(MapTest, ALandmarkIsExpectedAtItsProjectionIfVisible) {
  const auto a = keyframe();
  const Landmark& l = map_.at(landmark(a, 0));  // at (0, 0, 2), seen from the origin on level 0
  const PyramidShape pyramid;
  const auto from = [&](const Pose& pose) {
    return LandmarkProjector(camera_, pyramid, pose).expect(l, 4, 0.5);
  };
  const auto ahead = from(Pose());
  ASSERT_TRUE(ahead.has_value());
  EXPECT_FLOAT_EQ(ahead->u, static_cast<float>(camera_.cx));
  EXPECT_EQ(ahead->min_level, -1);
  EXPECT_EQ(ahead->max_level, 1);
  EXPECT_FLOAT_EQ(ahead->radius, 4);

  EXPECT_FALSE(from(Pose(Eigen::Quaterniond::Identity(), {0, 0, 3}))) << "behind";
  EXPECT_FALSE(from(Pose(Eigen::Quaterniond::Identity(), {4, 0, 0}))) << "outside the image";
  EXPECT_FALSE(from(Pose(so3_exp({0, M_PI, 0}), {0, 0, 4}))) << "from the back";
  const auto nearer = from(Pose(Eigen::Quaterniond::Identity(), {0, 0, 2 - 2 / 1.44}));
  ASSERT_TRUE(nearer.has_value());
  EXPECT_EQ(nearer->min_level, 1) << "1.44 times nearer is two levels up";
}

}  // namespace
}  // namespace stillmap
