// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/epipolar_cue.hpp"

namespace stillmap {
namespace {

/// Minimum number of tracked static points for a fundamental matrix.
constexpr std::size_t kMinPoints = 30;
/// Side of the Lucas-Kanade window [pixels]. The paper names none; 9 takes as long as 5 and loses
/// fewer points.
constexpr int kFlowWindow = 9;
/// Inlier threshold of the fundamental matrix [pixels].
constexpr double kRansacThreshold = 1;

/// Returns the role of each keypoint: dynamic in the box of a dynamic object, else potential in
/// that of a potentially moving one.
std::vector<ClassRole> roles_of(std::span<const Keypoint> keypoints,
                                const SegmentedFramePtr& instances, const ClassSets& classes) {
  const auto dynamic = boxes_with_role(instances, classes, ClassRole::kDynamic);
  const auto potential = boxes_with_role(instances, classes, ClassRole::kPotential);
  std::vector<ClassRole> roles;
  roles.reserve(keypoints.size());
  for (const Keypoint& k : keypoints) {
    const ClassRole otherwise =
        in_any_box(potential, k.u, k.v) ? ClassRole::kPotential : ClassRole::kUnlisted;
    roles.push_back(in_any_box(dynamic, k.u, k.v) ? ClassRole::kDynamic : otherwise);
  }
  return roles;
}

/// Returns the tracked points whose role is not one of the two.
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
                                          const std::vector<ClassRole>& roles) {
  PointPairs pairs = pairs_without(flow, roles, ClassRole::kDynamic, ClassRole::kPotential);
  if (pairs.size() < kMinPoints) {
    pairs = pairs_without(flow, roles, ClassRole::kDynamic, ClassRole::kDynamic);
  }
  if (pairs.size() < kMinPoints) return std::nullopt;
  return find_fundamental(pairs, kRansacThreshold);
}

}  // namespace

EpipolarLabels labels_by_epipolar_lines(std::span<const Keypoint> keypoints,
                                        const SegmentedFramePtr& instances,
                                        const KeypointFlow& flow, const EpipolarOptions& options) {
  const auto roles = roles_of(keypoints, instances, options.classes);
  const auto F = fundamental_of(flow, roles);
  EpipolarLabels labels{std::vector<char>(keypoints.size(), 0), F.has_value()};
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const bool tested = options.everywhere || roles[i] == ClassRole::kPotential;
    const bool off = tested && F && flow.found[i] != 0 &&
                     epipolar_distance(*F, flow.before[i], flow.now[i]) > options.threshold;
    labels.moving[i] = off || roles[i] == ClassRole::kDynamic ? 1 : 0;
  }
  return labels;
}

EpipolarCue::EpipolarCue(const EpipolarOptions& options) : options_(options), flow_(kFlowWindow) {}

std::set<std::string> EpipolarCue::classes() const {
  const ClassSets& c = options_.classes;
  std::set<std::string> names(c.dynamic.begin(), c.dynamic.end());
  names.insert(c.potential.begin(), c.potential.end());
  return names;
}

void EpipolarCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const EpipolarLabels labels = labels_by_epipolar_lines(input.features->keypoints, input.instances,
                                                         flow_.to_previous(input), options_);
  for (std::size_t i = 0; i < labels.moving.size(); ++i) {
    if (labels.moving[i] != 0) evidence.static_log_odds[i] -= kCertainlyMoving;
  }
  for (const cv::Rect& box :
       boxes_with_role(input.instances, options_.classes, ClassRole::kDynamic)) {
    mark_moving(box, input.image->gray.size(), evidence);
  }
}

}  // namespace stillmap
