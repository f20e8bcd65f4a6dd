// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/relocalizer.hpp"

#include <algorithm>
#include <utility>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Minimum ratio of an island's score to the best island of its component [0..1]; lower than for
/// loops, since people may cover a large part of the view.
constexpr double kIslandShare = 0.4;
/// Minimum number of inliers of the pose found by RANSAC.
constexpr int kMinRansacInliers = 12;
/// Search radius around the pose found by RANSAC, and around the refined pose [pixels at level 0].
constexpr double kWideRadius = 10, kNarrowRadius = 4;
/// Number of the candidate's best covisible keyframes whose landmarks take part.
constexpr int kWindow = 10;
/// Minimum number of matches by node with a landmark.
constexpr int kMinMatches = 15;
/// Minimum number of inlier landmarks.
constexpr int kMinInliers = 40;
/// Bounds on MatchConsistency [0..1]; looser than for a loop, since people may cover a large part
/// of the view.
constexpr double kMinFoundShare = 0.2, kMaxBlankShare = 0.4;
/// Maximum share of inliers with depth whose depth disagrees [0..1].
constexpr double kMaxContradicted = 0.4;

/// One relocalization attempt in steps; a failed step sets its reason.
class Attempt {
 public:
  Attempt(const Map& map, const ImageView& image, const Keyframe& candidate)
      : map_(map), image_(image), candidate_(candidate) {}

  RelocalizationVerification run(const BagOfWords& bag, const BagOfWords& candidate_bag) {
    const auto matches = match_by_node(bag, image_.features, candidate_bag, *candidate_.features);
    if (estimate(matches) && refine() && surroundings_agree() && texture_agrees())
      return {result(), ""};
    return {std::nullopt, reason_};
  }

 private:
  bool fail(const std::string& reason) {
    reason_ = "the most similar place: " + reason;
    return false;
  }

  bool estimate(const std::vector<DescriptorMatch>& matches) {
    std::vector<RigidPair> solid;
    std::vector<AbsolutePair> pixels;
    const Pose T_candidate_world = candidate_.T_world_camera.inverse();
    for (const DescriptorMatch& m : matches) {
      const Landmark* landmark = map_.find(candidate_.landmarks[m.b]);
      if (landmark == nullptr) continue;
      const Keypoint& k = image_.features.keypoints[m.a];
      const Keypoint& seen = candidate_.features->keypoints[m.b];
      const double scale = map_.pyramid().scale(k.level);
      pixels.push_back({landmark->p_world, {k.u, k.v}, scale});
      if (k.depth <= 0) continue;
      solid.push_back({T_candidate_world * landmark->p_world,
                       map_.camera().unproject(k.u, k.v, k.depth),
                       {seen.u, seen.v},
                       {k.u, k.v},
                       map_.pyramid().scale(seen.level),
                       scale});
    }
    if (static_cast<int>(pixels.size()) < kMinMatches)
      return fail(fmt::format("{} matches of {} needed", pixels.size(), kMinMatches));
    if (const auto rigid = find_rigid_motion(map_.camera(), solid, kMinRansacInliers)) {
      T_world_camera_ = candidate_.T_world_camera * rigid->model;
      return true;
    }
    const auto absolute = find_absolute_pose(map_.camera(), pixels, kMinRansacInliers);
    if (!absolute) return fail(fmt::format("no pose fits the {} matches", pixels.size()));
    T_world_camera_ = absolute->model;
    return true;
  }

  bool refine() {
    landmarks_ = landmarks_seen_by(map_, with_best_covisible(map_, candidate_.id, kWindow));
    for (const double radius : {kWideRadius, kNarrowRadius}) {
      const auto found = search_landmarks(map_, landmarks_, image_, T_world_camera_, radius);
      solved_ = solve_matches(map_, found.matches, image_, T_world_camera_);
      if (!solved_.solution.well_posed) return fail("the pose is not determined");
      T_world_camera_ = solved_.solution.T_world_camera;
    }
    const auto inliers = static_cast<int>(solved_.inliers.size());
    if (inliers < kMinInliers)
      return fail(fmt::format("{} landmarks agree of {} needed", inliers, kMinInliers));
    const int with_depth = solved_.solution.depth_inliers + solved_.contradicted;
    if (solved_.contradicted > kMaxContradicted * with_depth)
      return fail(fmt::format("{} of {} depths disagree", solved_.contradicted, with_depth));
    return true;
  }

  bool surroundings_agree() {
    std::vector<LandmarkId> known = landmarks_seen_by(map_, std::span(&candidate_.id, 1));
    std::erase_if(known, [&](LandmarkId id) { return map_.at(id).observations.size() < 2; });
    const auto search = search_landmarks(map_, known, image_, T_world_camera_, kNarrowRadius);
    consistency_ = consistency(map_.camera(), search.expected);
    if (consistency_.found >= kMinFoundShare && consistency_.blank <= kMaxBlankShare) {
      return true;
    }
    return fail(fmt::format("{:.0f} % of the expected landmarks matched, {:.0f} % in blank regions",
                            100 * consistency_.found, 100 * consistency_.blank));
  }

  bool texture_agrees() {
    const TextureAgreement texture =
        texture_agreement(map_, landmarks_, image_, T_world_camera_, kNarrowRadius);
    return texture.of_one_place() || fail(texture.text());
  }

  Relocalization result() const {
    Relocalization r;
    r.T_world_camera = T_world_camera_;
    r.reference = candidate_.id;
    r.T_reference_camera = candidate_.T_world_camera.inverse() * T_world_camera_;
    r.component = candidate_.component;
    r.landmarks.resize(image_.features.size());
    for (const LandmarkMatch& s : solved_.inliers) r.landmarks[s.keypoint] = s.landmark;
    r.inliers = static_cast<int>(solved_.inliers.size());
    r.found_share = consistency_.found;
    r.blank_share = consistency_.blank;
    return r;
  }

  const Map& map_;
  const ImageView& image_;
  const Keyframe& candidate_;
  Pose T_world_camera_;
  std::vector<LandmarkId> landmarks_;  // Around the candidate; from refine() on.
  MatchedPose solved_;
  MatchConsistency consistency_;
  std::string reason_;
};

}  // namespace

RelocalizationVerification relocalize(const Map& map, const PlaceIndex& index,
                                      const ImageView& image) {
  const BagOfWords bag =
      index.vocabulary().transform(image.features.descriptors, image.static_weight);
  RelocalizationVerification verification{std::nullopt, "no similar keyframe"};
  bool first = true;
  for (const PlaceCandidate& place : find_places(map, index, bag.words, {}, 0, kIslandShare)) {
    RelocalizationVerification tried =
        Attempt(map, image, map.at(place.keyframe)).run(bag, *index.find(place.keyframe));
    if (std::exchange(first, false) || tried.result) verification = std::move(tried);
    if (verification.result) break;
  }
  return verification;
}

}  // namespace stillmap
