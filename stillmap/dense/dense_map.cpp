// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/dense_map.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

namespace stillmap {
namespace {

// One thinning doubles the area of a voxel's face, so it halves the points of a surface.
constexpr double kCoarser = std::numbers::sqrt2;
// A cloud this coarse has no shape left: it is emptied instead [m].
constexpr double kCoarsest = 1.0;

void require_valid(const DenseOptions& options) {
  const bool valid = options.voxel > 0 && options.min_samples >= 1 && options.min_keyframes >= 1 &&
                     options.max_points >= 1;
  require_valid(options.back_projection);
  require_valid(options.outliers);
  if (valid) return;
  throw Error("an option is out of range", "dense map",
              "voxel > 0, min_samples >= 1, min_keyframes >= 1, max_points >= 1");
}

bool is_finite(const Pose& pose) {
  return pose.quaternion().coeffs().allFinite() && pose.translation().allFinite();
}

// Adds the points of a keyframe to the grid of the whole.
void place(const KeyframeCloud& cloud, const Pose& T_world_camera, std::uint32_t source,
           VoxelGrid& world) {
  const Eigen::Matrix3d R = T_world_camera.rotation() * cloud.step;
  const Eigen::Vector3d& t = T_world_camera.translation();
  for (const PackedPoint& point : cloud.points) {
    const auto& [x, y, z] = point.position;
    world.add(R * Eigen::Vector3d(x, y, z) + t, point.color, point.count, source);
  }
}

}  // namespace

DenseMap::DenseMap(const Camera& camera, const DenseOptions& options)
    : camera_(camera), options_(options) {
  require_valid(options_);
}

void DenseMap::add(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& excluded) {
  PointGrid grid = back_project(camera_, frame, excluded, options_.back_projection);
  const std::size_t outliers = remove_outliers(grid, options_.outliers);
  KeyframeCloud cloud = pack_keyframe(grid, frame, options_.voxel);

  remove(id);
  outliers_ += outliers;
  points_ += cloud.points.size();
  clouds_.emplace(id, std::move(cloud));
  thin_to_bound();
}

void DenseMap::remove(std::uint64_t id) {
  const auto found = clouds_.find(id);
  if (found == clouds_.end()) return;
  points_ -= found->second.points.size();
  clouds_.erase(found);
}

// The finest cloud is thinned first, the oldest (lowest id) of equally fine ones: so detail is lost
// evenly, and latest where the camera is.
void DenseMap::thin_to_bound() {
  const auto finer = [](const auto& a, const auto& b) {
    const bool a_empty = a.second.points.empty(), b_empty = b.second.points.empty();
    return a_empty != b_empty ? b_empty : a.second.voxel < b.second.voxel;
  };
  while (points_ > static_cast<std::size_t>(options_.max_points)) {
    KeyframeCloud& cloud = std::min_element(clouds_.begin(), clouds_.end(), finer)->second;
    const double voxel = cloud.voxel * kCoarser;
    points_ -= cloud.points.size();
    cloud = voxel < kCoarsest ? thinned(cloud, voxel) : KeyframeCloud{.voxel = voxel};
    points_ += cloud.points.size();
    ++thinnings_;
  }
}

ComposedCloud DenseMap::compose(const PoseLookup& T_world_camera) const {
  ComposedCloud composed;
  VoxelGrid world(options_.voxel);
  std::uint32_t source = 0;
  for (const auto& [id, cloud] : clouds_) {
    const std::optional<Pose> pose = T_world_camera(id);
    const bool usable = pose && is_finite(*pose);
    if (usable) place(cloud, *pose, source++, world);
    ++(usable ? composed.keyframes : composed.keyframes_left_out);
  }
  composed.cloud.reserve(world.size());
  world.for_each_sorted([&](const Voxel& voxel) {
    const bool kept = voxel.count >= static_cast<std::uint32_t>(options_.min_samples) &&
                      voxel.sources >= static_cast<std::uint32_t>(options_.min_keyframes);
    if (kept) composed.cloud.add(voxel.mean, voxel.color);
    if (!kept) ++composed.voxels_left_out;
  });
  return composed;
}

DenseStatistics DenseMap::statistics() const {
  return {.keyframes = clouds_.size(),
          .points = points_,
          .outliers = outliers_,
          .thinnings = thinnings_};
}

std::size_t DenseMap::bytes() const {
  std::size_t bytes = 0;
  for (const auto& [id, cloud] : clouds_) bytes += sizeof(id) + cloud.bytes();
  return bytes;
}

}  // namespace stillmap
