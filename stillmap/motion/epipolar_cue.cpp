// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/epipolar_cue.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Minimum number of followed static points for a fundamental matrix.
constexpr std::size_t kMinPoints = 30;

/// Strongest claim first: a keypoint in several boxes takes the first.
ClassRole role_at(const Keypoint& k, const std::vector<cv::Rect>& dynamic,
                  const std::vector<cv::Rect>& potential, const std::vector<cv::Rect>& still) {
  if (in_any_box(dynamic, k.u, k.v)) return ClassRole::kDynamic;
  if (in_any_box(potential, k.u, k.v)) return ClassRole::kPotential;
  if (in_any_box(still, k.u, k.v)) return ClassRole::kStatic;
  return ClassRole::kUnlisted;
}

std::vector<ClassRole> roles_of(const std::vector<Keypoint>& keypoints,
                                const SegmentedFramePtr& instances, const ClassSets& classes) {
  const auto dynamic = boxes_with_role(instances, classes, ClassRole::kDynamic);
  const auto potential = boxes_with_role(instances, classes, ClassRole::kPotential);
  const auto still = boxes_with_role(instances, classes, ClassRole::kStatic);
  std::vector<ClassRole> roles;
  roles.reserve(keypoints.size());
  for (const Keypoint& k : keypoints) roles.push_back(role_at(k, dynamic, potential, still));
  return roles;
}

/// The points followed whose role is not one of the two.
PointPairs pairs_without(const KeypointFlow& flow, const std::vector<ClassRole>& roles,
                         ClassRole one, ClassRole other) {
  PointPairs pairs;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] == 0 || roles[i] == one || roles[i] == other) continue;
    pairs.add(flow.before[i], flow.now[i]);
  }
  return pairs;
}

std::optional<cv::Matx33d> fundamental_of(const KeypointFlow& flow,
                                          const std::vector<ClassRole>& roles,
                                          const EpipolarOptions& options) {
  PointPairs pairs = pairs_without(flow, roles, ClassRole::kDynamic, ClassRole::kPotential);
  if (pairs.size() < kMinPoints) {
    pairs = pairs_without(flow, roles, ClassRole::kDynamic, ClassRole::kDynamic);
  }
  if (pairs.size() < kMinPoints) return std::nullopt;
  return find_fundamental(pairs, options.ransac);
}

}  // namespace

EpipolarLabels judge_by_epipolar_lines(const std::vector<Keypoint>& keypoints,
                                       const SegmentedFramePtr& instances, const KeypointFlow& flow,
                                       const EpipolarOptions& options) {
  const auto roles = roles_of(keypoints, instances, options.classes);
  const auto F = fundamental_of(flow, roles, options);
  EpipolarLabels labels{std::vector<char>(keypoints.size(), 0), F.has_value()};
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const bool tested =
        F && flow.found[i] != 0 && (options.test_standing_still || roles[i] != ClassRole::kStatic);
    const bool off =
        tested && epipolar_distance(*F, flow.before[i], flow.now[i]) > options.threshold;
    labels.moving[i] = off || roles[i] == ClassRole::kDynamic ? 1 : 0;
  }
  return labels;
}

EpipolarCue::EpipolarCue(const EpipolarOptions& options) : options_(options), flow_(options.flow) {}

std::set<std::string> EpipolarCue::classes() const {
  const ClassSets& c = options_.classes;
  std::set<std::string> names(c.dynamic.begin(), c.dynamic.end());
  names.insert(c.potential.begin(), c.potential.end());
  if (!options_.test_standing_still) {
    names.insert(c.standing_still.begin(), c.standing_still.end());
  }
  return names;
}

void EpipolarCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const EpipolarLabels labels = judge_by_epipolar_lines(input.features->keypoints, input.instances,
                                                        flow_.of_this_frame(input), options_);
  for (std::size_t i = 0; i < labels.moving.size(); ++i) {
    if (labels.moving[i] != 0) {
      evidence.static_log_odds[i] -= kCertainlyMoving;
    }
  }
  for (const cv::Rect& box :
       boxes_with_role(input.instances, options_.classes, ClassRole::kDynamic)) {
    mark_moving(box, input.image->gray.size(), evidence);
  }
}

}  // namespace stillmap
