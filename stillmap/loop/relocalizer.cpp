// SPDX-License-Identifier: Apache-2.0
#include "stillmap/loop/relocalizer.hpp"

#include <algorithm>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Returns the keyframes of all other components, sorted by id.
std::vector<KeyframeId> outside(const Map& map, std::optional<std::uint32_t> component) {
  std::vector<KeyframeId> ids;
  if (!component) return ids;
  map.for_each_keyframe([&](const Keyframe& k) {
    if (k.component != *component) ids.push_back(k.id);
  });
  std::sort(ids.begin(), ids.end());
  return ids;
}

std::vector<LandmarkId> landmarks_around(const Map& map, KeyframeId center, int window) {
  std::vector<KeyframeId> keyframes = {center};
  for (const Covisible& c : map.covisible(center)) {
    if (static_cast<int>(keyframes.size()) <= window) keyframes.push_back(c.keyframe);
  }
  return landmarks_seen_by(map, keyframes);
}

/// One relocalization attempt in steps; a failed step sets its reason.
class Attempt {
 public:
  Attempt(const Map& map, const ImageView& image, const Keyframe& candidate,
          const RelocalizerOptions& options)
      : map_(map), image_(image), candidate_(candidate), options_(options) {}

  RelocalizationVerification run(const BagOfWords& bag, const BagOfWords& candidate_bag) {
    const auto matches =
        match_by_node(bag, image_.features, candidate_bag, *candidate_.features, options_.matching);
    if (estimate(matches) && refine() && surroundings_agree()) return {result(), ""};
    return {std::nullopt, reason_};
  }

 private:
  bool fail(std::string reason) {
    reason_ = std::move(reason);
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
    if (static_cast<int>(pixels.size()) < options_.min_matches)
      return fail(fmt::format("{} matches", pixels.size()));
    if (const auto rigid = find_rigid_motion(map_.camera(), solid, options_.ransac)) {
      T_world_camera_ = candidate_.T_world_camera * rigid->model;
      return true;
    }
    const auto absolute = find_absolute_pose(map_.camera(), pixels, options_.ransac);
    if (!absolute) return fail(fmt::format("no pose fits the {} matches", pixels.size()));
    T_world_camera_ = absolute->model;
    return true;
  }

  bool refine() {
    const auto landmarks = landmarks_around(map_, candidate_.id, options_.window);
    for (const GuidedSearchOptions& search : {options_.wide, options_.narrow}) {
      const auto found = search_landmarks(map_, landmarks, image_, T_world_camera_, search);
      solved_ = solve_matches(map_, found.matches, image_, T_world_camera_);
      if (!solved_.solution.well_posed) return fail("the pose is not determined");
      T_world_camera_ = solved_.solution.T_world_camera;
    }
    const auto inliers = static_cast<int>(solved_.inliers.size());
    if (inliers < options_.min_inliers) return fail(fmt::format("{} landmarks agree", inliers));
    const int with_depth = solved_.solution.depth_inliers + solved_.contradicted;
    if (solved_.contradicted > options_.max_contradicted * with_depth)
      return fail(fmt::format("{} of {} depths disagree", solved_.contradicted, with_depth));
    return true;
  }

  bool surroundings_agree() {
    std::vector<LandmarkId> known = landmarks_seen_by(map_, std::span(&candidate_.id, 1));
    std::erase_if(known, [&](LandmarkId id) { return map_.at(id).observations.size() < 2; });
    const auto search = search_landmarks(map_, known, image_, T_world_camera_, options_.narrow);
    consistency_ = consistency(map_.camera(), search.expected);
    if (consistency_.found >= options_.min_found_share &&
        consistency_.blank <= options_.max_blank_share) {
      return true;
    }
    return fail(fmt::format("{:.0f} % of the expected landmarks matched, {:.0f} % in blank regions",
                            100 * consistency_.found, 100 * consistency_.blank));
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
  const RelocalizerOptions& options_;
  Pose T_world_camera_;
  MatchedPose solved_;
  MatchConsistency consistency_;
  std::string reason_;
};

}  // namespace

RelocalizationVerification relocalize(const Map& map, const PlaceIndex& index,
                                      const ImageView& image, const RelocalizerOptions& options,
                                      std::optional<std::uint32_t> component) {
  const BagOfWords bag =
      index.vocabulary().transform(image.features.descriptors, image.static_weight);
  RelocalizationVerification verification{std::nullopt, "no similar keyframe"};
  for (const PlaceCandidate& place :
       find_places(map, index, bag.words, outside(map, component), 0, options.query)) {
    verification =
        Attempt(map, image, map.at(place.keyframe), options).run(bag, *index.find(place.keyframe));
    if (verification.result) break;
  }
  return verification;
}

}  // namespace stillmap
