// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/box_flow_cue.hpp"

#include <optional>

namespace stillmap {
namespace {

/// Side of the Lucas-Kanade window in the paper [pixels].
constexpr int kFlowWindow = 5;

/// Returns (U, V) of equation 8; none if no point of S has flow.
std::optional<cv::Point2d> mean_static_flow(const std::vector<FlowSet>& sets,
                                            const KeypointFlow& flow) {
  cv::Point2d sum;
  int count = 0;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets[i] != FlowSet::kStatic || flow.found[i] == 0) continue;
    sum += cv::Point2d(flow.flow(i));
    ++count;
  }
  if (count == 0) return std::nullopt;
  return sum / count;
}

/// Returns whether at least half of the keypoints in the box are in D.
bool moves(const cv::Rect& box, const std::vector<Keypoint>& keypoints,
           const std::vector<FlowSet>& sets) {
  int inside = 0, dynamic = 0;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (!in_any_box({box}, keypoints[i].u, keypoints[i].v)) continue;
    ++inside;
    dynamic += sets[i] == FlowSet::kDynamic ? 1 : 0;
  }
  return 2 * dynamic >= inside;
}

}  // namespace

std::vector<FlowSet> divide_by_boxes(const std::vector<Keypoint>& keypoints,
                                     const std::vector<cv::Rect>& boxes) {
  std::vector<FlowSet> sets;
  sets.reserve(keypoints.size());
  for (const Keypoint& k : keypoints) {
    sets.push_back(in_any_box(boxes, k.u, k.v) ? FlowSet::kDoubtful : FlowSet::kStatic);
  }
  return sets;
}

void divide_by_flow(std::vector<FlowSet>& sets, const KeypointFlow& flow, double factor) {
  const auto mean = mean_static_flow(sets, flow);
  const double l = mean ? factor * cv::norm(*mean) : 0;
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets[i] != FlowSet::kDoubtful) continue;
    const bool is_static =
        mean && flow.found[i] != 0 && cv::norm(cv::Point2d(flow.flow(i)) - *mean) <= l;
    sets[i] = is_static ? FlowSet::kStatic : FlowSet::kDynamic;
  }
}

BoxFlowCue::BoxFlowCue(const BoxFlowOptions& options) : options_(options), flow_(kFlowWindow) {}

std::set<std::string> BoxFlowCue::classes() const {
  return {options_.classes.dynamic.begin(), options_.classes.dynamic.end()};
}

void BoxFlowCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const auto boxes = boxes_with_role(input.instances, options_.classes, ClassRole::kDynamic);
  if (boxes.empty()) return;
  const auto& keypoints = input.features->keypoints;
  std::vector<FlowSet> sets = divide_by_boxes(keypoints, boxes);
  divide_by_flow(sets, flow_.to_previous(input), options_.factor);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets[i] == FlowSet::kDynamic) evidence.static_log_odds[i] -= kCertainlyMoving;
  }
  for (const cv::Rect& box : boxes) {
    if (moves(box, keypoints, sets)) mark_moving(box, input.image->gray.size(), evidence);
  }
}

}  // namespace stillmap
