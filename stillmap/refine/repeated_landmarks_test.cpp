// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/repeated_landmarks.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/refine/local_mapper.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns a zero descriptor with bits first .. first + count - 1 set.
Descriptor bits(int first, int count) {
  Descriptor d{};
  for (int i = first; i < first + count; ++i) {
    d[static_cast<std::size_t>(i / 64)] |= std::uint64_t{1} << (i % 64);
  }
  return d;
}

Descriptor both(const Descriptor& a, const Descriptor& b) {
  return {a[0] | b[0], a[1] | b[1], a[2] | b[2], a[3] | b[3]};
}

/// Returns a vocabulary of two words, all zeros and all ones.
Vocabulary two_words() { return {{2, 0, 0}, {Descriptor{}, {~0ULL, ~0ULL, ~0ULL, ~0ULL}}, {1, 1}}; }

/// A point that a keyframe observed and created a landmark from.
struct Point {
  Eigen::Vector3d p_world;
  Descriptor descriptor{};
  int level = 0;
};

/// A hand-made map.
class RepeatedLandmarks : public ::testing::Test {
 protected:
  /// Adds a keyframe with a landmark of each point, in order.
  KeyframeId add(const std::vector<Point>& points, const Pose& T_world_camera = {}) {
    auto features = std::make_shared<Features>();
    for (const Point& point : points) {
      const Eigen::Vector2d uv = camera_.project(T_world_camera.inverse() * point.p_world);
      Keypoint keypoint;
      keypoint.u = static_cast<float>(uv.x());
      keypoint.v = static_cast<float>(uv.y());
      keypoint.level = static_cast<std::uint8_t>(point.level);
      features->keypoints.push_back(keypoint);
      features->descriptors.push_back(point.descriptor);
    }
    features->grid = KeypointGrid(features->keypoints, camera_.width, camera_.height);
    Keyframe keyframe;
    keyframe.T_world_camera = T_world_camera;
    keyframe.features = features;
    keyframe.static_weight.assign(points.size(), 1);
    const KeyframeId id = map_.add_keyframe(std::move(keyframe)).id;
    for (std::uint32_t i = 0; i < points.size(); ++i) {
      map_.add_landmark(points[i].p_world, {id, i});
    }
    return id;
  }
  LandmarkId landmark(KeyframeId keyframe, std::size_t i) const {
    return map_.at(keyframe).landmarks[i];
  }
  bool exists(LandmarkId id) const { return map_.find(id) != nullptr; }
  std::vector<LandmarkId> everything() const {
    std::vector<LandmarkId> ids;
    map_.for_each_landmark([&](const Landmark& l) { ids.push_back(l.id); });
    return ids;
  }

  Camera camera_;
  Map map_{camera_, PyramidShape{}};
};

// Removal by node.

class ByNode : public RepeatedLandmarks {
 protected:
  /// Point i of the newest keyframe: 30 bits from every other one, in the word of zeros.
  static Point current(int i) { return {{0.2 * i, 0, 2}, bits(20 * i, 15)}; }
  /// A similar point with `apart` different bits.
  static Point like_current(int i, int apart) {
    return {{0.2 * i, 1, 2}, both(current(i).descriptor, bits(200, apart))};
  }
  int remove(KeyframeId newest) {
    return remove_repeated_by_node(map_, newest, everything(), two_words()).gone;
  }
};

TEST_F(ByNode, LandmarksNearerThanTheMedianAreRemoved) {
  const auto old = add({like_current(0, 4), like_current(1, 8), like_current(2, 12)});
  const auto newest = add({current(0), current(1), current(2)});
  const auto nearer = landmark(old, 0), at_median = landmark(old, 1), farther = landmark(old, 2);
  EXPECT_EQ(remove(newest), 1);
  EXPECT_FALSE(exists(nearer));
  EXPECT_TRUE(exists(at_median));
  EXPECT_TRUE(exists(farther));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(exists(landmark(newest, i)));
}

TEST_F(ByNode, TheMedianOfAnEvenNumberIsTheMeanOfTheMiddleTwo) {
  const auto old = add({like_current(0, 4), like_current(1, 8)});
  const auto newest = add({current(0), current(1)});
  const auto nearer = landmark(old, 0), farther = landmark(old, 1);
  EXPECT_EQ(remove(newest), 1);
  EXPECT_FALSE(exists(nearer));
  EXPECT_TRUE(exists(farther));
}

TEST_F(ByNode, EqualDescriptorsAreKept) {
  const auto old = add({like_current(0, 0), like_current(1, 4), like_current(2, 8)});
  const auto newest = add({current(0), current(1), current(2)});
  const auto equal = landmark(old, 0);
  EXPECT_EQ(remove(newest), 0);  // No d satisfies 0 < d < 4.
  EXPECT_TRUE(exists(equal));
}

TEST_F(ByNode, OtherNodesAndObservedLandmarksAreNotCompared) {
  Point inverted = like_current(0, 4);
  for (auto& word : inverted.descriptor) word = ~word;
  add({inverted});
  const auto newest = add({current(0), like_current(0, 4), current(1), like_current(1, 20)});
  EXPECT_EQ(remove(newest), 0);
  EXPECT_EQ(map_.landmark_count(), 5U);
}

TEST_F(ByNode, OnlyLandmarksOfTheLocalMapAreRemoved) {
  const auto old = add({like_current(0, 4), like_current(1, 8), like_current(2, 12)});
  const auto newest = add({current(0), current(1), current(2)});
  const std::vector<LandmarkId> local = {landmark(old, 1), landmark(old, 2)};
  const auto outside = landmark(old, 0), inside = landmark(old, 1);
  EXPECT_EQ(remove_repeated_by_node(map_, newest, local, two_words()).gone, 1);
  EXPECT_TRUE(exists(outside));
  EXPECT_FALSE(exists(inside));
}

TEST_F(ByNode, ALandmarkIsRemovedOnlyOnce) {
  const auto old = add({like_current(0, 4), like_current(1, 30), like_current(2, 31)});
  Point another = current(0);
  another.descriptor = both(another.descriptor, bits(240, 2));
  const auto newest = add({current(0), another, current(1), current(2)});
  const auto wanted_twice = landmark(old, 0);
  EXPECT_EQ(remove(newest), 1);  // The distances are 4, 6, 30 and 31.
  EXPECT_FALSE(exists(wanted_twice));
}

// Merging by place.

class ByPlace : public RepeatedLandmarks {
 protected:
  const Point corner_{{0.1, 0.05, 2}, bits(0, 20)};
  const Pose second_view_{so3_exp({0, 0, 0}), {0.1, 0, 0}};
  /// The same corner with noise in position and appearance.
  Point again() const {
    return {corner_.p_world + Eigen::Vector3d(0.001, -0.001, 0.005), bits(5, 20), 0};
  }
  /// The same corner shifted by a disparity [pixels] along the ray from `second_view_`.
  Point behind_by(double pixels) const {
    const double bf = camera_.bf(), z = corner_.p_world.z();
    const Eigen::Vector3d ray = (corner_.p_world - second_view_.translation()) / z;
    Point other = again();
    other.p_world = second_view_.translation() + ray * (bf / (bf / z - pixels));
    return other;
  }
  int join(KeyframeId newest) { return join_repeated_by_place(map_, newest, everything()).gone; }
  /// Returns the number of merges when one keyframe created a landmark from the corner and another
  /// keyframe one from `other`.
  int merges_with(const Point& other, const Pose& from) {
    add({corner_});
    return join(add({other}, from));
  }
};

TEST_F(ByPlace, DuplicatesOfACornerBecomeOneLandmark) {
  const auto first = add({corner_}), second = add({again()}, second_view_);
  EXPECT_EQ(join(second), 1);
  ASSERT_EQ(map_.landmark_count(), 1U);
  EXPECT_TRUE(exists(landmark(first, 0)));
  EXPECT_EQ(landmark(first, 0), landmark(second, 0));
  EXPECT_EQ(map_.at(landmark(first, 0)).observations.size(), 2U);
}

TEST_F(ByPlace, ADifferentAppearanceIsAnotherPoint) {
  Point other = again();
  other.descriptor = bits(100, 31);  // The distance is 20 + 31 bits.
  EXPECT_EQ(merges_with(other, second_view_), 0);
}

TEST_F(ByPlace, ADifferentImagePositionIsAnotherPoint) {
  Point other = again();
  other.p_world.x() += 3.0 * other.p_world.z() / camera_.fx;  // 3 pixels
  EXPECT_EQ(merges_with(other, second_view_), 0);
}

TEST_F(ByPlace, ADifferentDepthIsAnotherPoint) {
  EXPECT_EQ(merges_with(behind_by(1.2), second_view_), 0);
}

TEST_F(ByPlace, ANoisyDepthIsTheSamePoint) {
  EXPECT_EQ(merges_with(behind_by(0.8), second_view_), 1);
}

TEST_F(ByPlace, ADifferentScaleIsAnotherPoint) {
  Point other = again();
  other.level = 3;
  EXPECT_EQ(merges_with(other, second_view_), 0);
}

TEST_F(ByPlace, TheBackOfAnObjectIsAnotherPoint) {
  const Pose behind(so3_exp({0, std::numbers::pi, 0}), {0, 0, 4});
  EXPECT_EQ(merges_with(again(), behind), 0);
}

TEST_F(ByPlace, TwoObservationsInOneKeyframeAreTwoPoints) {
  add({corner_, again()});
  EXPECT_EQ(join(add({}, second_view_)), 0);
  EXPECT_EQ(map_.landmark_count(), 2U);
}

TEST_F(ByPlace, TheMostSimilarAreMergedAndTheThirdStays) {
  Point less_alike = corner_;
  less_alike.descriptor = bits(15, 20);
  const auto first = add({less_alike, corner_}), second = add({again()}, second_view_);
  const auto left = landmark(first, 0), right = landmark(first, 1);
  EXPECT_EQ(join(second), 1);
  EXPECT_TRUE(exists(left));
  EXPECT_EQ(landmark(second, 0), right);
}

TEST_F(ByPlace, TheOneWithMoreObservationsStays) {
  const auto once = add({corner_});
  const auto twice = add({again()}, second_view_);
  auto third = add({}, second_view_);
  const auto known = landmark(twice, 0), newer = landmark(once, 0);
  {  // A third keyframe observes the landmark that the second one created.
    Keyframe keyframe = map_.at(twice);
    keyframe.landmarks.clear();
    third = map_.add_keyframe(keyframe).id;
    ASSERT_TRUE(map_.observe(known, {third, 0}));
  }
  EXPECT_EQ(join(third), 1);
  EXPECT_TRUE(exists(known));
  EXPECT_FALSE(exists(newer));
}

// Within the mapper.

/// Returns the number of landmarks after the refinement of a keyframe with 20 known points and one
/// new point whose appearance changed slightly.
std::size_t landmarks_after_refining(const std::string& rule) {
  const Camera camera;
  Map map(camera, PyramidShape{});
  MapperOptions options;
  options.repeated_landmarks = rule;
  options.fusion_keyframes = 0;
  LocalMapper mapper(map, options);
  const auto propose = [&](std::size_t index) {
    auto features = std::make_shared<Features>();
    for (int i = 0; i < 21; ++i) {
      Keypoint k;
      k.u = static_cast<float>(60 + 25 * i);
      k.v = static_cast<float>(60 + 80 * (i % 5));
      k.depth = 2;
      features->keypoints.push_back(k);
      // The corners have no bits in common; the last one differs by 4 bits from frame to frame.
      const int changed_bits = i == 20 && index == 0 ? 4 : 0;
      features->descriptors.push_back(both(bits(11 * i, 11), bits(240, changed_bits)));
    }
    features->grid = KeypointGrid(features->keypoints, camera.width, camera.height);
    auto image = std::make_shared<RgbdFrame>();
    image->index = index;
    auto frame = std::make_shared<Frame>();
    frame->image = image;
    frame->features = features;
    frame->evidence.weight.assign(21, 1);
    return KeyframeProposal{frame, KeyframeId{}, Pose(), std::vector<LandmarkId>(21), {}};
  };
  const KeyframeId first = mapper.insert(propose(0));
  KeyframeProposal second = propose(1);
  second.reference = first;
  second.landmarks = map.at(first).landmarks;
  second.landmarks[20] = LandmarkId{};
  mapper.refine(mapper.insert(second));
  return map.landmark_count();
}

TEST(RepeatedRule, SelectsTheTreatmentInTheMapper) {
  EXPECT_EQ(landmarks_after_refining("none"), 22U);
  EXPECT_EQ(landmarks_after_refining("place"), 21U);
}

}  // namespace
}  // namespace stillmap
