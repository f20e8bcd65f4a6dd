// SPDX-License-Identifier: Apache-2.0
#include "stillmap/refine/local_mapper.hpp"

#include <algorithm>
#include <limits>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// A wall of random points observed by a camera that moves sideways; keypoints and descriptors are
/// computed from the truth.
class RefineTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::mt19937_64 rng(3);
    std::uniform_real_distribution<double> across(-1.5, 1.5), deep(2.0, 3.0);
    for (int i = 0; i < 150; ++i) {
      points_.emplace_back(across(rng), across(rng), deep(rng));
      descriptors_.push_back({rng(), rng(), rng(), rng()});
    }
  }

  static Pose true_pose(int k) { return Pose(so3_exp({0, 0.02 * k, 0}), {0.1 * k, 0.02 * k, 0}); }

  /// Returns the frame at position k: point i is keypoint i, at (0, 0) without depth if it is out
  /// of view.
  FramePtr view(int k, bool with_depth = true) {
    auto image = std::make_shared<RgbdFrame>();
    image->index = static_cast<std::size_t>(k);
    image->timestamp = k;
    auto features = std::make_shared<Features>();
    const Pose T_camera_world = true_pose(k).inverse();
    for (const Eigen::Vector3d& p_world : points_) {
      const Eigen::Vector3d p = T_camera_world * p_world;
      const Eigen::Vector2d uv = camera_.project(p);
      Keypoint keypoint;
      keypoint.u = static_cast<float>(uv.x());
      keypoint.v = static_cast<float>(uv.y());
      if (with_depth) keypoint.depth = static_cast<float>(p.z());
      features->keypoints.push_back(keypoint);
    }
    features->descriptors.assign(descriptors_.begin(), descriptors_.end());
    features->grid = KeypointGrid(features->keypoints, camera_.width, camera_.height);
    auto frame = std::make_shared<Frame>();
    frame->image = image;
    frame->features = features;
    frame->evidence.weight.assign(points_.size(), 1);
    return frame;
  }

  KeyframeProposal proposal(int k, const Pose& pose, bool with_depth = true) {
    return {view(k, with_depth), KeyframeId{}, pose, std::vector<LandmarkId>(points_.size()), {}};
  }

  /// Adds a keyframe at a given pose, in the component of the first one.
  KeyframeId insert(LocalMapper& mapper, int k, const Pose& pose, bool with_depth = true) {
    KeyframeProposal p = proposal(k, pose, with_depth);
    if (first_.valid()) {
      p.reference = first_;
      p.T_reference_camera = map_.at(first_).T_world_camera.inverse() * pose;
    }
    const KeyframeId id = mapper.insert(p);
    if (!first_.valid()) first_ = id;
    return id;
  }

  Camera camera_;
  Map map_{camera_, PyramidShape{}};
  std::vector<Eigen::Vector3d> points_;
  std::vector<Descriptor> descriptors_;
  KeyframeId first_;
};

/// Standard deviation that is below that of every depth [m].
constexpr double kNone = 1e-9;

TEST_F(RefineTest, TheNearestKeypointsPlaceLandmarksInAnyCase) {
  LocalMapper mapper(map_, {.max_landmark_sigma = kNone,
                            .max_first_landmark_sigma = kNone,
                            .fewest_depth_landmarks = 30});
  const Keyframe& keyframe = map_.at(insert(mapper, 0, true_pose(0)));
  float farthest_placed = 0, nearest_left = std::numeric_limits<float>::infinity();
  std::size_t placed = 0;
  for (std::size_t i = 0; i < keyframe.landmarks.size(); ++i) {
    const float depth = keyframe.features->keypoints[i].depth;
    if (keyframe.landmarks[i].valid()) {
      ++placed;
      farthest_placed = std::max(farthest_placed, depth);
    } else {
      nearest_left = std::min(nearest_left, depth);
    }
  }
  EXPECT_EQ(placed, 30U);
  EXPECT_LT(farthest_placed, nearest_left);
}

TEST_F(RefineTest, TheFirstKeyframeHasALimitOfItsOwn) {
  LocalMapper mapper(map_, {.max_landmark_sigma = kNone, .max_first_landmark_sigma = 1});
  insert(mapper, 0, true_pose(0));
  const std::size_t first = map_.landmark_count();
  EXPECT_GT(first, 100U);
  insert(mapper, 1, true_pose(1));
  EXPECT_EQ(map_.landmark_count(), first);
}

TEST_F(RefineTest, InsertionCreatesLandmarksFromDepth) {
  LocalMapper mapper(map_, {});
  const auto id = insert(mapper, 0, true_pose(0));
  EXPECT_EQ(map_.landmark_count(), points_.size());
  for (std::size_t i = 0; i < points_.size(); ++i) {
    EXPECT_LT((map_.at(map_.at(id).landmarks[i]).p_world - points_[i]).norm(), 1e-5);
  }
}

TEST_F(RefineTest, MovingAndFarKeypointsCreateNoLandmark) {
  LocalMapper mapper(map_, {});
  KeyframeProposal p = proposal(0, true_pose(0));
  auto frame = std::make_shared<Frame>(*p.frame);
  frame->evidence.weight[7] = 0;
  auto features = std::make_shared<Features>(*frame->features);
  features->keypoints[8].depth = 7;
  frame->features = features;
  p.frame = frame;
  const auto id = mapper.insert(p);
  EXPECT_FALSE(map_.at(id).landmarks[7].valid());
  EXPECT_FALSE(map_.at(id).landmarks[8].valid());
  EXPECT_EQ(map_.landmark_count(), points_.size() - 2);
}

TEST_F(RefineTest, DuplicatesAreFused) {
  LocalMapper mapper(map_, {});
  const auto a = insert(mapper, 0, true_pose(0));
  const auto b = insert(mapper, 1, true_pose(1));
  // The first 20 points are shared, so that the keyframes are neighbors.
  for (std::uint32_t i = 0; i < 20; ++i)
    map_.merge(map_.at(a).landmarks[i], map_.at(b).landmarks[i]);
  fuse_duplicates(map_, b, 10);
  int shared = 0, in_both_images = 0;
  for (std::size_t i = 0; i < points_.size(); ++i) {
    const auto& ka = map_.at(a).features->keypoints[i];
    const auto& kb = map_.at(b).features->keypoints[i];
    if (!camera_.contains(ka.u, ka.v, 4) || !camera_.contains(kb.u, kb.v, 4)) continue;
    ++in_both_images;
    const auto la = map_.at(a).landmarks[i], lb = map_.at(b).landmarks[i];
    EXPECT_TRUE(!la.valid() || !lb.valid() || la == lb ||
                map_.at(la).p_world != map_.at(lb).p_world);
    shared += la.valid() && la == lb;
  }
  EXPECT_GT(in_both_images, 80);
  EXPECT_GE(shared, in_both_images * 95 / 100);
}

TEST_F(RefineTest, PointsWithoutDepthAreTriangulated) {
  LocalMapper mapper(map_, {});
  const auto a = insert(mapper, 0, true_pose(0), false);
  const auto b = insert(mapper, 3, true_pose(3), false);
  EXPECT_EQ(map_.landmark_count(), 0U);
  for (std::uint32_t i = 0; i < 20; ++i) {  // Twenty shared points make the keyframes neighbors.
    map_.observe(map_.add_landmark(points_[i], {a, i}).id, {b, i});
  }
  EXPECT_GT(create_by_triangulation(map_, b, MapperOptions().max_landmark_sigma), 100);
  map_.for_each_landmark([&](const Landmark& l) {
    EXPECT_LT((l.p_world - points_[l.observations.front().keypoint]).norm(), 1e-3);
  });
}

TEST_F(RefineTest, LocalAdjustmentMovesADisplacedKeyframeBack) {
  LocalMapper mapper(map_, {});
  const auto a = insert(mapper, 0, true_pose(0));
  Eigen::Matrix<double, 6, 1> error;
  error << 0.01, -0.008, 0.012, 0.003, -0.004, 0.002;
  KeyframeProposal p = proposal(1, Pose());
  p.reference = a;
  p.T_reference_camera = map_.at(a).T_world_camera.inverse() * true_pose(1) * Pose::exp(error);
  p.landmarks = map_.at(a).landmarks;
  const auto b = mapper.insert(p);
  const auto result = adjust_locally(map_, b, 15);
  EXPECT_LT(result.cost_after, result.cost_before);
  EXPECT_LT((map_.at(b).T_world_camera.inverse() * true_pose(1)).log().norm(), 1e-3);
  EXPECT_LT((map_.at(a).T_world_camera.inverse() * true_pose(0)).log().norm(), 1e-12)
      << "it is fixed";
}

TEST_F(RefineTest, AWrongMatchIsRemoved) {
  LocalMapper mapper(map_, {});
  const auto a = insert(mapper, 0, true_pose(0));
  KeyframeProposal p = proposal(1, Pose());
  p.reference = a;
  p.T_reference_camera = map_.at(a).T_world_camera.inverse() * true_pose(1);
  p.landmarks = map_.at(a).landmarks;
  std::swap(p.landmarks[10], p.landmarks[90]);
  const auto wrong_at_10 = p.landmarks[10], wrong_at_90 = p.landmarks[90], right = p.landmarks[11];
  const auto b = mapper.insert(p);
  adjust_locally(map_, b, 15);
  // Each wrong landmark has two contradictory observations and cannot keep both.
  const auto both_see = [&](LandmarkId id) {
    return map_.find(id) != nullptr && map_.at(id).observations.size() == 2;
  };
  EXPECT_FALSE(both_see(wrong_at_10));
  EXPECT_FALSE(both_see(wrong_at_90));
  EXPECT_TRUE(both_see(right));
}

TEST_F(RefineTest, LandmarksRarelyMatchedAreCulled) {
  LocalMapper mapper(map_, {});
  const auto a = insert(mapper, 0, true_pose(0));
  const auto ghost = map_.at(a).landmarks[5], solid = map_.at(a).landmarks[6];
  map_.count_visibility(ghost, 20, 2);
  map_.count_visibility(solid, 20, 15);
  cull_landmarks(map_, a);
  EXPECT_EQ(map_.find(ghost), nullptr);
  EXPECT_NE(map_.find(solid), nullptr);
}

TEST_F(RefineTest, ARedundantKeyframeIsCulledButNeverTheFirst) {
  LocalMapper mapper(map_, {});
  const auto a = insert(mapper, 0, true_pose(0));
  std::vector<KeyframeId> ids = {a};
  for (int k = 1; k < 9; ++k) {
    KeyframeProposal p = proposal(k, Pose());
    p.reference = a;
    p.T_reference_camera = map_.at(a).T_world_camera.inverse() * true_pose(k);
    p.landmarks = map_.at(a).landmarks;
    ids.push_back(mapper.insert(p));
  }
  const Pose before = map_.at(ids[3]).T_world_camera;
  EXPECT_GT(cull_keyframes(map_, ids.back()), 0);
  EXPECT_NE(map_.find(a), nullptr);
  EXPECT_NE(map_.find(ids.back()), nullptr);
  EXPECT_LT((map_.resolve(ids[3], Pose()).inverse() * before).log().norm(), 1e-12)
      << "its frames keep their poses";
}

TEST_F(RefineTest, AKeyframeOfAnExtendedMapIsRedundantWithTwoOthers) {
  for (const bool extended : {false, true}) {
    map_ = Map(camera_, PyramidShape{});
    first_ = {};
    LocalMapper mapper(map_, {});
    insert(mapper, 0, true_pose(0));
    const auto insert_again = [&] {
      KeyframeProposal p = proposal(0, Pose());
      p.reference = first_;
      p.landmarks = map_.at(first_).landmarks;
      return mapper.insert(p);
    };
    insert_again();
    if (extended) map_ = Map(map_.content());
    first_ = map_.first_of(map_.components().front());
    for (int i = 0; i < 2; ++i) insert(mapper, 0, true_pose(0));  // with landmarks of their own
    EXPECT_EQ(cull_keyframes(map_, insert_again()), extended ? 1 : 0);
  }
}

}  // namespace
}  // namespace stillmap
