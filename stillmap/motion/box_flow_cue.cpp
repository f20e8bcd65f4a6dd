// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/box_flow_cue.hpp"

#include "stillmap/segment/box_cluster.hpp"

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
bool moves(const cv::Rect& box, std::span<const Keypoint> keypoints,
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

std::vector<FlowSet> divide_by_boxes(std::span<const Keypoint> keypoints,
                                     const std::vector<cv::Rect>& boxes) {
  std::vector<FlowSet> sets;
  sets.reserve(keypoints.size());
  for (const Keypoint& k : keypoints) {
    sets.push_back(in_any_box(boxes, k.u, k.v) ? FlowSet::kDoubtful : FlowSet::kStatic);
  }
  return sets;
}

void divide_by_depth(std::vector<FlowSet>& sets, std::span<const Keypoint> keypoints,
                     const cv::Mat1f& depth, const std::vector<cv::Rect>& bodies) {
  for (const cv::Rect& body : bodies) {
    const cv::Rect box = body & cv::Rect({}, depth.size());
    if (box.empty()) continue;
    const cv::Mat1b cluster = cluster_in_box(depth, box);
    for (std::size_t i = 0; i < sets.size(); ++i) {
      const cv::Point pixel(cvRound(keypoints[i].u), cvRound(keypoints[i].v));
      if (sets[i] == FlowSet::kDoubtful && box.contains(pixel) && cluster(pixel - box.tl()) != 0)
        sets[i] = FlowSet::kDynamic;
    }
  }
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

void MovedKeypoints::divide(std::vector<FlowSet>& sets, const KeypointFlow& flow,
                            const std::vector<char>& on_bodies) {
  frames_ago_.assign(sets.size(), -1);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets[i] != FlowSet::kDoubtful || on_bodies[i] == 0 || flow.found[i] == 0) continue;
    for (const Moved& moved : moved_) {
      if (cv::norm(moved.at - flow.before[i]) > kSameSurface) continue;
      const int frames_ago = moved.frames_ago + 1;
      if (frames_ago > memory_ || (frames_ago_[i] >= 0 && frames_ago_[i] <= frames_ago)) continue;
      frames_ago_[i] = frames_ago;
      sets[i] = FlowSet::kDynamic;
    }
  }
}

void MovedKeypoints::add(const KeypointFlow& flow, const std::vector<char>& moving) {
  moved_.clear();
  for (std::size_t i = 0; i < moving.size(); ++i) {
    const int frames_ago = moving[i] != 0 ? 0 : frames_ago_[i];
    if (frames_ago >= 0) moved_.push_back({flow.now[i], frames_ago});
  }
}

BoxFlowCue::BoxFlowCue(const BoxFlowOptions& options)
    : options_(options), flow_(kFlowWindow), moved_(options.memory) {}

std::set<std::string> BoxFlowCue::classes() const {
  std::set<std::string> names(options_.classes.dynamic.begin(), options_.classes.dynamic.end());
  names.insert(options_.classes.potential.begin(), options_.classes.potential.end());
  return names;
}

/// Returns the set of each keypoint.
/// @param bodies boxes of dynamic classes
/// @param boxes  all boxes
std::vector<FlowSet> BoxFlowCue::sets_of(const MotionInput& input,
                                         const std::vector<cv::Rect>& bodies,
                                         const std::vector<cv::Rect>& boxes) {
  const auto& keypoints = input.features->keypoints;
  const KeypointFlow flow = flow_.to_previous(input);
  std::vector<FlowSet> by_flow = divide_by_boxes(keypoints, boxes), sets = by_flow;
  if (options_.body != BoxBody::kMoved) {
    if (options_.body == BoxBody::kDepthCluster)
      divide_by_depth(sets, keypoints, input.image->depth, bodies);
    divide_by_flow(sets, flow, options_.factor);
    return sets;
  }
  std::vector<char> on_bodies;
  on_bodies.reserve(keypoints.size());
  for (const Keypoint& k : keypoints) on_bodies.push_back(in_any_box(bodies, k.u, k.v) ? 1 : 0);
  moved_.divide(sets, flow, on_bodies);
  divide_by_flow(sets, flow, options_.factor);
  divide_by_flow(by_flow, flow, options_.factor);
  for (std::size_t i = 0; i < on_bodies.size(); ++i) {
    const bool moves = by_flow[i] == FlowSet::kDynamic && flow.found[i] != 0;
    on_bodies[i] = on_bodies[i] != 0 && moves ? 1 : 0;
  }
  moved_.add(flow, on_bodies);
  return sets;
}

void BoxFlowCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  const auto bodies = boxes_with_role(input.instances, options_.classes, ClassRole::kDynamic);
  auto boxes = boxes_with_role(input.instances, options_.classes, ClassRole::kPotential);
  boxes.insert(boxes.end(), bodies.begin(), bodies.end());
  if (boxes.empty()) {
    moved_.forget();
    return;
  }
  const std::vector<FlowSet> sets = sets_of(input, bodies, boxes);
  for (std::size_t i = 0; i < sets.size(); ++i) {
    if (sets[i] == FlowSet::kDynamic) evidence.static_log_odds[i] -= kCertainlyMoving;
  }
  for (const cv::Rect& box : bodies) {
    if (moves(box, input.features->keypoints, sets))
      mark_moving(box, input.image->gray.size(), evidence);
  }
}

}  // namespace stillmap
