// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/start_verification.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/optimize/pose_ransac.hpp"

#include <utility>
#include <vector>

namespace stillmap {
namespace {

/// Interval of the verified frames.
constexpr int kInterval = 3;
/// Minimum number of keypoints that agree with the other motion. With 60, a start on somebody who
/// turns before the camera is missed; from 60 to 30 no other of 157 starts among people changes.
constexpr int kMinSupport = 30;
/// Smallest ratio of the support of the other motion to that of the tracked pose.
constexpr double kMinRatio = 1.25;

/// Returns whether a keypoint is on an object of a moving class.
bool is_of_moving_class(const Frame& frame, const Keypoint& keypoint) {
  const cv::Mat1f& prior = frame.evidence.surface_prior;
  return !prior.empty() && prior(frame.cells->cell_of(keypoint.u, keypoint.v)) < kMovingSurface;
}

/// Returns the matches of both frames' keypoints with depth, without objects of moving classes: a
/// person who walks ahead of the camera may have most of them.
std::vector<RigidPair> pairs_of(const TrackingModel& model, const Frame& first,
                                const Frame& frame) {
  std::vector<RigidPair> pairs;
  for (const DescriptorMatch& match :
       match_brute_force(first.features->descriptors, frame.features->descriptors,
                         {.max_distance = kMaxMatchDistance, .ratio = kMatchRatio})) {
    const Keypoint& a = first.features->keypoints[match.a];
    const Keypoint& b = frame.features->keypoints[match.b];
    if (a.depth <= 0 || b.depth <= 0) continue;
    if (is_of_moving_class(first, a) || is_of_moving_class(frame, b)) continue;
    pairs.push_back({.p_a = model.camera.unproject(a.u, a.v, a.depth),
                     .p_b = model.camera.unproject(b.u, b.v, b.depth),
                     .uv_a = {a.u, a.v},
                     .uv_b = {b.u, b.v},
                     .scale_a = model.pyramid.scale(a.level),
                     .scale_b = model.pyramid.scale(b.level)});
  }
  return pairs;
}

}  // namespace

void StartVerification::begin(FramePtr first, const Pose& T_world_camera) {
  first_ = std::move(first);
  T_world_first_ = T_world_camera;
  frames_ = 0;
}

std::optional<Pose> StartVerification::contradiction(const TrackingModel& model, const Frame& frame,
                                                     const Pose& T_world_camera) {
  if (!first_) return std::nullopt;
  ++frames_;
  if (frames_ % kInterval != 0) return std::nullopt;
  const TraceScope scope("start verification");
  const auto pairs = pairs_of(model, *first_, frame);
  if (frames_ >= kFrames) first_.reset();
  const auto majority = find_rigid_motion(model.camera, pairs, kMinSupport);
  if (!majority) return std::nullopt;
  const Pose T_first_frame = T_world_first_.inverse() * T_world_camera;
  const int support = count_agreeing(model.camera, pairs, T_first_frame);
  if (majority->inliers < kMinRatio * support) return std::nullopt;
  return majority->model;
}

}  // namespace stillmap
