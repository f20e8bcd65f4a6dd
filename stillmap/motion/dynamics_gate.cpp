// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/dynamics_gate.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Number of frames of which more than half must be marked (equation 8).
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

std::optional<double> share_off_homography(const KeypointFlow& flow, double warp_error_limit) {
  const PointPairs pairs = tracked_pairs(flow);
  if (pairs.size() < kMinPoints) return std::nullopt;
  const auto H = find_homography(pairs, kRansacThreshold);
  if (!H) return std::nullopt;
  int marked = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (warp_error(*H, pairs.before[i], pairs.now[i]) > warp_error_limit) ++marked;
  }
  return static_cast<double>(marked) / static_cast<double>(pairs.size());
}

DynamicsGate::DynamicsGate(const DynamicsGateOptions& options)
    : options_(options), flow_(kFlowWindow) {}

bool DynamicsGate::push(const MotionInput& input) {
  return push(share_off_homography(flow_.from_previous(input), options_.warp_error));
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

void GatedCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  if (gate_.push(input)) cue_->add_to(evidence, input);
}

}  // namespace stillmap
