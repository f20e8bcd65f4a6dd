// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/carried_parts.hpp"

#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/feature/matching.hpp"
#include "stillmap/optimize/pose_ransac.hpp"

#include <algorithm>
#include <cmath>
#include <optional>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

/// Interval of the compared frames, in which the images of a moving robot change by several pixels.
constexpr int kInterval = 5;
/// Half the side of the square in which a keypoint is searched, and minimum displacement of a moved
/// keypoint, above the noise; both at level 0 [pixels].
constexpr float kReach = 40, kMoved = 3;
/// Minimum number and share of the moved keypoints that must agree with one motion.
constexpr int kFewest = 12;
constexpr double kLeastShare = 0.6;
/// Share of the moved keypoints that must agree with the tracked motion; otherwise they contradict
/// it.
constexpr double kSupport = 0.5;
/// Depth error above which a cell contradicts a motion [tolerances]; larger than the noise.
constexpr float kContradicts = 1.5;
/// Minimum share of cells that distinguishes motion from noise, and maximum ratio of background
/// cells that keep their pixels to cells that follow the motion. In rendered recordings this ratio
/// was smaller in 43 of 46 pairs of frames with carried parts, and above 0.9 in 14 of 15 pairs of a
/// camera at rest in front of people or of a board that fills up to half of the image.
constexpr double kFewestCells = 0.015, kLargestRatio = 0.4;
/// Quantile of the depths of the moving cells; nearer resting cells count as the robot's body.
constexpr double kNearest = 0.1;
/// Minimum number of pairs of frames that show carried parts, and minimum ratio to pairs that show
/// a camera at rest.
constexpr int kFewestPairs = 5, kPairRatio = 2;

/// Returns the matches of keypoints with depth that moved in the image.
std::vector<RigidPair> moved_pairs(const TrackingModel& model, const Features& a,
                                   const Features& b) {
  std::vector<ProjectionQuery> queries;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const Keypoint& k = a.keypoints[i];
    queries.push_back({.u = k.u,
                       .v = k.v,
                       .radius = kReach,
                       .min_level = k.level - 1,
                       .max_level = k.level + 1,
                       .descriptor = a.descriptors[i],
                       .angle = k.angle});
  }
  const auto found = match_by_projection(
      queries, b,
      {.max_distance = kMaxMatchDistance, .ratio = kMatchRatio, .check_rotation = true});
  std::vector<RigidPair> pairs;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!found[i]) continue;
    const Keypoint &p = a.keypoints[i], &q = b.keypoints[*found[i]];
    const double scale = model.pyramid.scale(q.level);
    if (p.depth <= 0 || q.depth <= 0 || std::hypot(p.u - q.u, p.v - q.v) < kMoved * scale) continue;
    pairs.push_back({.p_a = model.camera.unproject(p.u, p.v, p.depth),
                     .p_b = model.camera.unproject(q.u, q.v, q.depth),
                     .uv_a = {p.u, p.v},
                     .uv_b = {q.u, q.v},
                     .scale_a = model.pyramid.scale(p.level),
                     .scale_b = scale});
  }
  return pairs;
}

/// Returns the common motion T_a_b of the moved keypoints, if there is one and it contradicts the
/// tracked motion.
std::optional<Pose> other_motion(const Camera& camera, const std::vector<RigidPair>& moved,
                                 const Pose& T_a_b_tracked) {
  const int support = count_agreeing(camera, moved, T_a_b_tracked);
  if (support >= kSupport * static_cast<double>(moved.size())) return std::nullopt;
  const auto motion = find_rigid_motion(camera, moved, kFewest);
  if (!motion || motion->inliers < kLeastShare * static_cast<double>(moved.size()) ||
      support >= kSupport * motion->inliers)
    return std::nullopt;
  return motion->model;
}

/// Depths of the cells that fit only the motion, and of those that fit only a camera at rest [m].
struct CellDepths {
  std::vector<float> moving, resting;
};

/// Returns the depths of the cells that follow the motion T_b_a, and of those that stay at their
/// pixels.
CellDepths compared(const CellGrid& a, const CellGrid& b, const Pose& T_b_a) {
  CellDepths depths;
  const auto error = [&](float expected, float seen) {
    return std::abs(seen - expected) / b.tolerance.at(expected);
  };
  const auto* seen = b.depth.ptr<float>();
  for_each_reprojected(a, Reprojection(a, T_b_a),
                       [&](int r, int c, float z, int cell, float expected) {
                         const float here = b.depth(r, c), there = seen[cell];
                         if (here <= 0 || there <= 0) return;
                         const float at_rest = error(z, here), in_motion = error(expected, there);
                         if (in_motion < 1 && at_rest > kContradicts) depths.moving.push_back(z);
                         if (at_rest < 1 && in_motion > kContradicts) depths.resting.push_back(z);
                       });
  return depths;
}

/// Returns the number of resting cells in the background. Cells of the robot are nearer than the
/// moving cells.
std::size_t background_at_rest(CellDepths& depths) {
  if (depths.moving.empty()) return depths.resting.size();
  const auto rank = static_cast<std::size_t>(kNearest * static_cast<double>(depths.moving.size()));
  const float nearest = value_of_rank(depths.moving, rank);
  return static_cast<std::size_t>(std::count_if(depths.resting.begin(), depths.resting.end(),
                                                [&](float z) { return z >= nearest; }));
}

}  // namespace

void CarriedParts::add(const TrackingModel& model, const TrackedFramePtr& tracked) {
  if (!tracked->has_pose() || tracked->enters_world() || tracked->confirmed) earlier_ = nullptr;
  if (!tracked->has_pose() || tracked->confirmed) return;
  if (earlier_ && ++frames_ < kInterval) return;
  const TrackedFramePtr a = std::exchange(earlier_, tracked);
  frames_ = 0;
  if (!a) return;
  const TraceScope scope("carried parts");
  const Frame &from = *a->frame, &to = *tracked->frame;
  const auto moved = moved_pairs(model, *from.recorded_features, *to.recorded_features);
  const auto T_a_b =
      other_motion(model.camera, moved, a->T_world_camera->inverse() * *tracked->T_world_camera);
  if (!T_a_b) return;
  CellDepths depths = compared(*from.cells, *to.cells, T_a_b->inverse());
  const auto moving = static_cast<double>(depths.moving.size());
  const auto resting = static_cast<double>(background_at_rest(depths));
  const double fewest = kFewestCells * static_cast<double>(to.cells->depth.total());
  if (moving > fewest && resting < kLargestRatio * moving) {
    ++carried_;
  } else if (resting > fewest) {
    ++resting_;
  }
}

std::optional<Finding> CarriedParts::finding() const {
  if (carried_ < kFewestPairs || carried_ < kPairRatio * resting_) return std::nullopt;
  return make_finding(
      "carried-parts",
      "the poses follow parts of the images that stay at their pixels while the scene moves, such "
      "as the robot itself, the dots of an infrared projector, or somebody who moves along",
      "exclude the robot with --ignore FILE.png (white there), or turn the projector off",
      {{"frames_following", carried_}, {"frames_at_rest", resting_}});
}

}  // namespace stillmap
