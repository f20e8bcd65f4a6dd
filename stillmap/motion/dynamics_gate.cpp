// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/dynamics_gate.hpp"

#include <algorithm>

namespace stillmap {
namespace {

/// Number of frames of which more than half must be marked (equation 8).
constexpr int kWindow = 10;
/// Minimum number of followed keypoints for a frame to be judged.
constexpr std::size_t kMinPoints = 20;

PointPairs followed_pairs(const KeypointFlow& flow) {
  PointPairs pairs;
  for (std::size_t i = 0; i < flow.size(); ++i) {
    if (flow.found[i] != 0) pairs.add(flow.before[i], flow.now[i]);
  }
  return pairs;
}

}  // namespace

std::optional<double> share_off_homography(const KeypointFlow& flow,
                                           const DynamicsGateOptions& options) {
  const PointPairs pairs = followed_pairs(flow);
  if (pairs.size() < kMinPoints) return std::nullopt;
  const auto H = find_homography(pairs, options.ransac);
  if (!H) return std::nullopt;
  int marked = 0;
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    if (warp_error(*H, pairs.before[i], pairs.now[i]) > options.warp_error) ++marked;
  }
  return static_cast<double>(marked) / static_cast<double>(pairs.size());
}

DynamicsGate::DynamicsGate(const DynamicsGateOptions& options)
    : options_(options), flow_(options.flow) {}

bool DynamicsGate::push(const MotionInput& input) {
  return push(share_off_homography(flow_.of_frame_before(input), options_));
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
