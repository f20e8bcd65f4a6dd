// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/dynamics_gate.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Number of frames of which more than half must be marked (section 1.1, step 3).
constexpr int kWindow = 10;
/// Minimum number of tracked keypoints of a frame with a vote.
constexpr std::size_t kMinPoints = 20;
/// Side of the Lucas-Kanade window [pixels]. The paper names none; 9 takes as long as 5 and loses
/// fewer points.
constexpr int kFlowWindow = 9;
/// Inlier threshold of the homography [pixels]: OpenCV's default, as the paper names none.
constexpr double kRansacThreshold = 3;

PointPairs tracked_pairs(const KeypointFlow& flow) {
  PointPairs pairs;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] != 0) pairs.add(flow.before[i], flow.now[i]);
  }
  return pairs;
}

}  // namespace

std::optional<double> marked_share(const KeypointFlow& flow, std::size_t keypoints,
                                   const DynamicsGateOptions& options) {
  const PointPairs pairs = tracked_pairs(flow);
  if (pairs.size() < kMinPoints || keypoints == 0) return std::nullopt;
  const auto H = find_homography(pairs, kRansacThreshold);
  if (!H) return std::nullopt;
  const cv::Matx33d T = options.in_se2 ? nearest_rigid(*H, pairs.before) : *H;
  int marked = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i)
    marked += warp_error(T, pairs.before[i], pairs.now[i]) >= options.warp_error ? 1 : 0;
  return marked / static_cast<double>(keypoints);
}

DynamicsGate::DynamicsGate(const DynamicsGateOptions& options)
    : options_(options), flow_(kFlowWindow) {}

bool DynamicsGate::push(const MotionInput& input) {
  return push(stillmap::marked_share(flow_.from_previous(input), input.features->size(), options_));
}

bool DynamicsGate::push(std::optional<double> marked_share) {
  frames_ = std::min(frames_ + 1, kWindow);
  if (marked_share) marked_.push_back(*marked_share > options_.marked_share);
  if (marked_.size() > static_cast<std::size_t>(kWindow)) marked_.pop_front();
  return highly_dynamic();
}

bool DynamicsGate::highly_dynamic() const {
  const auto votes = std::count(marked_.begin(), marked_.end(), true);
  return frames_ < kWindow || 2 * votes > kWindow;
}

GatedCue::GatedCue(const DynamicsGateOptions& options, std::unique_ptr<MotionCue> cue)
    : gate_(options), cue_(std::move(cue)), name_("gated-" + std::string(cue_->name())) {}

void GatedCue::begin(const MotionInput& input) {
  highly_dynamic_ = std::async(std::launch::async, [this, input] { return gate_.push(input); });
}

void GatedCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  if (!highly_dynamic_.valid()) begin(input);
  evidence.dynamics = highly_dynamic_.get() ? Dynamics::kHigh : Dynamics::kLow;
  if (evidence.dynamics == Dynamics::kHigh) cue_->add_to(evidence, input);
}

}  // namespace stillmap
