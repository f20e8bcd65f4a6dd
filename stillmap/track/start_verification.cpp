// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/start_verification.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/optimize/pose_ransac.hpp"
#include "stillmap/track/image_agreement.hpp"

#include <algorithm>
#include <utility>
#include <vector>

namespace stillmap {
namespace {

/// Number of frames since the earlier one from which on the motions differ, and up to which the
/// images have enough in common.
constexpr int kFirst = 3, kLast = 8;
/// Minimum number of keypoints that agree with another motion.
constexpr int kMinSupport = 30;
/// Largest number of other motions.
constexpr std::size_t kMotions = 3;
/// Smallest ratio of the agreement of another motion to that of the tracked pose. Of 66 starts
/// among people (bonn_crowd) and 39 in fast turns (fr1_rpy), right poses have mostly 1.0, at most
/// 1.2; wrong ones reach 1.3 to 4.
constexpr double kMinRatio = 1.25;

/// Returns whether a pixel shows an object of a moving class.
bool is_of_moving_class(const Frame& frame, float u, float v) {
  const cv::Mat1f& prior = frame.evidence.surface_prior;
  return !prior.empty() && prior(frame.cells->cell_of(u, v)) < kMovingSurface;
}

/// Returns the images without the depths of objects of moving classes.
RgbdFramePtr without_moving_classes(const Frame& frame) {
  if (frame.evidence.surface_prior.empty()) return frame.image;
  auto image = std::make_shared<RgbdFrame>(*frame.image);
  image->depth = image->depth.clone();
  const cv::Mat1f& prior = frame.evidence.surface_prior;
  for (int v = 0; v < image->depth.rows; ++v) {
    auto* depth = image->depth.ptr<float>(v);
    const float* cells = prior[frame.cells->cell_of(0, static_cast<float>(v)).y];
    for (int u = 0; u < image->depth.cols; ++u)
      if (cells[frame.cells->cell_of(static_cast<float>(u), 0).x] < kMovingSurface) depth[u] = 0;
  }
  return image;
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
    if (is_of_moving_class(first, a.u, a.v) || is_of_moving_class(frame, b.u, b.v)) continue;
    pairs.push_back({.p_a = model.camera.unproject(a.u, a.v, a.depth),
                     .p_b = model.camera.unproject(b.u, b.v, b.depth),
                     .uv_a = {a.u, a.v},
                     .uv_b = {b.u, b.v},
                     .scale_a = model.pyramid.scale(a.level),
                     .scale_b = model.pyramid.scale(b.level)});
  }
  return pairs;
}

/// Returns the rigid motion with which most pairs agree, that with which most others do, and so on.
std::vector<Pose> rigid_motions(const Camera& camera, std::vector<RigidPair> pairs) {
  std::vector<Pose> motions;
  while (motions.size() < kMotions) {
    const auto found = find_rigid_motion(camera, pairs, kMinSupport);
    if (!found) break;
    motions.push_back(found->model);
    std::vector<RigidPair> others;
    for (std::size_t i = 0; i < pairs.size(); ++i)
      if (found->inlier[i] == 0) others.push_back(pairs[i]);
    pairs = std::move(others);
  }
  return motions;
}

/// Returns whether two motions are so near that the image refines them to the same one.
bool are_alike(const Pose& a, const Pose& b) {
  constexpr double kMeters = 0.005, kRadians = 0.005;
  const Vector6d difference = (a.inverse() * b).log();
  return difference.head<3>().norm() < kMeters && difference.tail<3>().norm() < kRadians;
}

std::vector<std::uint8_t> standing(const TrackingModel& model, const Frame& frame,
                                   const ImageAgreement& images, const Pose& T_earlier_frame) {
  std::vector<std::uint8_t> stands;
  for (const Keypoint& k : frame.features->keypoints)
    stands.push_back(k.depth > 0 &&
                     images.shows(T_earlier_frame * model.camera.unproject(k.u, k.v, k.depth)));
  return stands;
}

}  // namespace

void StartVerification::begin(FramePtr first, const Pose& T_world_camera) {
  earlier_ = std::move(first);
  T_world_earlier_ = T_world_camera;
  frames_ = since_ = 0;
}

std::optional<StartVerification::Motion> StartVerification::contradiction(
    const TrackingModel& model, const FramePtr& frame, const Pose& T_world_camera) {
  if (!earlier_) return std::nullopt;
  ++frames_, ++since_;
  if (since_ < kFirst) return std::nullopt;
  const TraceScope scope("start verification");
  const ImageAgreement images(model.camera, *without_moving_classes(*earlier_),
                              *without_moving_classes(*frame));
  const Pose tracked = T_world_earlier_.inverse() * T_world_camera;
  const Pose refined_tracked = images.refined(tracked);
  double most = kMinRatio * std::max(images.of(tracked), images.of(refined_tracked));
  std::optional<Pose> best;  // T_earlier_frame
  for (const Pose& motion : rigid_motions(model.camera, pairs_of(model, *earlier_, *frame))) {
    if (are_alike(motion, refined_tracked)) continue;
    const Pose refined = images.refined(motion);
    const double agreement = images.of(refined);
    if (agreement <= most) continue;
    most = agreement;
    best = refined;
  }
  if (best)
    return Motion{T_world_earlier_ * *best, Pose::exp(best->log() / since_),
                  standing(model, *frame, images, *best)};
  if (frames_ >= kFrames) earlier_.reset();
  if (earlier_ && since_ >= kLast) {
    earlier_ = frame;
    T_world_earlier_ = T_world_camera;
    since_ = 0;
  }
  return std::nullopt;
}

}  // namespace stillmap
