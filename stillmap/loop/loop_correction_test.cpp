// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/loop_correction.hpp"

#include "stillmap/loop/rendered_map_test.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using rendered::MapBuilder;
using rendered::small_images;

/// Keyframes of a camera moved once around the office and a little farther, with the truth.
const std::vector<SimulatedFrame>& round() {
  static const std::vector<SimulatedFrame> frames = [] {
    SimulationOptions options = small_images({.people = 0, .camera = "loop", .frames = 56});
    options.fps = 30;
    options.speed = 19;  // About 0.25 m between keyframes.
    const SimulatedSequence sequence(options);
    std::vector<SimulatedFrame> made;
    for (std::size_t i = 0; i < sequence.frames(); ++i) made.push_back(sequence.at(i));
    return made;
  }();
  return frames;
}

const Camera& camera() {
  static const Camera small = SimulatedSequence(small_images({.people = 0, .frames = 1})).camera();
  return small;
}

/// The round as a drifted map: every step adds its share of `drift`.
struct Drifted {
  MapBuilder built{camera()};
  std::vector<KeyframeId> keyframes;

  explicit Drifted(const Vector6d& drift, bool second_map_from_the_middle = false) {
    const auto& frames = round();
    const double count = static_cast<double>(frames.size());
    for (std::size_t i = 0; i < frames.size(); ++i) {
      const Pose error = Pose::exp(static_cast<double>(i) / count * drift);
      const bool new_map = second_map_from_the_middle && i == frames.size() / 2;
      keyframes.push_back(
          built.add(*frames[i].frame, error * frames[i].truth.T_world_camera, new_map));
    }
  }

  /// Verifies the last keyframe against the most similar earlier places.
  LoopVerification recognize() const {
    const KeyframeId query = keyframes.back();
    std::vector<KeyframeId> near(keyframes.end() - 15, keyframes.end());
    std::sort(near.begin(), near.end());
    LoopVerification verification{std::nullopt, "no similar keyframe"};
    for (const PlaceCandidate& place :
         find_places(built.map, built.index, built.index.find(query)->words, near, 0)) {
      verification = verify_loop(built.map, built.index, query, place.keyframe);
      if (verification.match) break;
    }
    return verification;
  }

  /// RMSE of all keyframe positions [m], with the first one aligned.
  double rmse() const {
    double sum = 0;
    for (std::size_t i = 0; i < keyframes.size(); ++i) {
      sum += (built.map.at(keyframes[i]).T_world_camera.translation() -
              round()[i].truth.T_world_camera.translation())
                 .squaredNorm();
    }
    return std::sqrt(sum / static_cast<double>(keyframes.size()));
  }

  /// Median reprojection error of all observations [pixels].
  double median_reprojection() const {
    std::vector<double> errors;
    built.map.for_each_landmark([&](const Landmark& l) {
      for (const Observation& o : l.observations) {
        const Keyframe& k = built.map.at(o.keyframe);
        const Keypoint& p = k.features->keypoints[o.keypoint];
        const auto uv = camera().project(k.T_world_camera.inverse() * l.p_world);
        errors.push_back((uv - Eigen::Vector2d(p.u, p.v)).norm());
      }
    });
    std::nth_element(errors.begin(),
                     errors.begin() + static_cast<std::ptrdiff_t>(errors.size() / 2), errors.end());
    return errors[errors.size() / 2];
  }
};

Vector6d some_drift() {
  Vector6d drift;
  drift << 0.3, -0.25, 0.15, 0.02, 0.015, 0.06;
  return drift;
}

/// The remaining error is that of a chain with both ends correct and the drift evenly distributed.
TEST(CloseLoop, RemovesTheDrift) {
  Drifted map(some_drift());
  const double before = map.rmse();
  const LoopVerification verification = map.recognize();
  ASSERT_TRUE(verification.match) << verification.reason;
  const Pose T_query = map.built.map.at(verification.match->query).T_world_camera;
  const LoopCorrection done = close_loop(map.built.map, *verification.match);
  EXPECT_GT(before, 0.12);
  EXPECT_LT(map.rmse(), 0.2 * before);
  EXPECT_GT(done.meters, 0.2);
  EXPECT_EQ(done.keyframes, map.keyframes.size());
  const Pose now = map.built.map.at(verification.match->query).T_world_camera;
  EXPECT_NEAR((now.translation() - T_query.translation()).norm(), done.meters, 1e-12);
  EXPECT_LT((now.inverse() * round().back().truth.T_world_camera).translation().norm(), 0.05)
      << "as close as the candidate, which has drifted a little itself";
}

TEST(CloseLoop, BothSidesShareConsistentLandmarksAfterwards) {
  Drifted map(some_drift());
  const LoopVerification verification = map.recognize();
  ASSERT_TRUE(verification.match) << verification.reason;
  const double fit_before = map.median_reprojection();
  const std::size_t landmarks = map.built.map.landmark_count();
  const LoopCorrection done = close_loop(map.built.map, *verification.match);
  int shared = 0;
  for (const Covisible& c : map.built.map.covisible(verification.match->query)) {
    if (c.keyframe == verification.match->candidate) shared = c.shared;
  }
  EXPECT_GT(shared, 50);
  EXPECT_GT(done.fused, 100);
  EXPECT_LT(map.built.map.landmark_count() + 50, landmarks);
  EXPECT_LT(map.median_reprojection(), fit_before + 0.5)
      << "landmarks must move with their keyframes";
  ASSERT_EQ(map.built.map.loops().size(), 1U);
  EXPECT_EQ(map.built.map.loops().front().b, verification.match->query);
}

TEST(JoinMaps, TheYoungerMovesRigidlyAndJoinsTheOlder) {
  Drifted map(some_drift(), true);
  Map& m = map.built.map;
  // The second map has an arbitrary pose.
  m.move_component(1, Pose(so3_exp({0.3, 2, -1}), {4, -7, 2}));
  const LoopVerification verification = map.recognize();
  ASSERT_TRUE(verification.match) << verification.reason;
  EXPECT_FALSE(verification.match->same_component);
  const std::size_t half = map.keyframes.size() / 2;
  const auto step = [&](std::size_t i) {
    return m.at(map.keyframes[i]).T_world_camera.inverse() *
           m.at(map.keyframes[i + 1]).T_world_camera;
  };
  const Pose inner = step(half + 3), first = m.at(map.keyframes[0]).T_world_camera;
  join_maps(m, *verification.match);
  EXPECT_EQ(m.components(), std::vector<std::uint32_t>{0});
  EXPECT_LT((inner.inverse() * step(half + 3)).log().norm(), 1e-9);
  EXPECT_LT((first.inverse() * m.at(map.keyframes[0]).T_world_camera).log().norm(), 1e-12);
  const Pose end = m.at(map.keyframes.back()).T_world_camera;
  EXPECT_LT((end.inverse() * round().back().truth.T_world_camera).translation().norm(), 0.05);
}

TEST(EssentialGraph, HasATreeAndStrongEdgesAndIsConnected) {
  const Drifted map(Vector6d::Zero());
  const EssentialGraph tree(map.built.map, 0, 1000000);
  EXPECT_EQ(tree.edges(), map.keyframes.size() - 1);
  EXPECT_GT(EssentialGraph(map.built.map, 0, 50).edges(), tree.edges());
}

/// Adds a keyframe at a place, which observes the landmarks of this place and of the next ones.
KeyframeId visit(Map& map, int place, std::map<int, std::vector<LandmarkId>>& landmarks) {
  constexpr int kPerPlace = 20, kPlaces = 3;
  auto features = std::make_shared<Features>();
  features->keypoints.resize(kPerPlace * kPlaces);
  features->descriptors.resize(features->keypoints.size());
  Keyframe made;
  made.features = features;
  made.static_weight.assign(features->size(), 1);
  made.T_world_camera = Pose(Eigen::Quaterniond::Identity(), Eigen::Vector3d(place, 0, 0));
  const KeyframeId id = map.add_keyframe(std::move(made)).id;
  std::uint32_t keypoint = 0;
  for (int seen = place; seen < place + kPlaces; ++seen) {
    auto& known = landmarks[seen];
    for (std::size_t i = 0; i < kPerPlace; ++i, ++keypoint) {
      if (i < known.size()) {
        map.observe(known[i], {id, keypoint});
      } else {
        known.push_back(map.add_landmark({1.0 * seen, 0, 3}, {id, keypoint}).id);
      }
    }
  }
  return id;
}

TEST(EssentialGraph, ThePathDoesNotGrowInAMappedPlace) {
  Map map(Camera{.width = 64, .height = 48, .fx = 50, .fy = 50, .cx = 32, .cy = 24}, {});
  std::map<int, std::vector<LandmarkId>> landmarks;
  std::vector<KeyframeId> ids;
  for (int round = 0; round < 3; ++round) {
    for (int place = 0; place < 10; ++place) ids.push_back(visit(map, place, landmarks));
    for (int place = 9; place >= 0; --place) ids.push_back(visit(map, place, landmarks));
  }
  const EssentialGraph graph(map, 0);
  EXPECT_NEAR(graph.path_length(ids[0], ids[9]), 9, 1e-9) << "along the first visit";
  EXPECT_NEAR(graph.path_length(ids[0], ids[49]), 9, 1e-9) << "the same place in the last round";
  EXPECT_NEAR(graph.path_length(ids[0], ids[59]), 0, 1e-9) << "54 m later";
}

TEST(PropagateCorrection, MovedKeyframesStayAndTheRestFollows) {
  Drifted map(Vector6d::Zero());
  Map& m = map.built.map;
  const EssentialGraph before(m, 0, 100);
  const std::size_t last = map.keyframes.size() - 1;
  const Pose there =
      Pose(Eigen::Quaterniond::Identity(), {0.5, 0, 0}) * m.at(map.keyframes[last]).T_world_camera;
  m.set_pose(map.keyframes[last], there);
  propagate_correction(m, before);
  EXPECT_EQ(m.at(map.keyframes[last]).T_world_camera.translation(), there.translation());
  const auto moved = [&](std::size_t i) {
    return (m.at(map.keyframes[i]).T_world_camera.translation() -
            before.pose(map.keyframes[i]).translation())
        .norm();
  };
  EXPECT_EQ(moved(0), 0) << "it defines the world frame";
  EXPECT_LT(moved(5), moved(last - 5));
  EXPECT_GT(moved(last - 1), 0.3);
}

}  // namespace
}  // namespace stillmap
