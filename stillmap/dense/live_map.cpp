// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/live_map.hpp"

#include <algorithm>
#include <numbers>
#include <utility>

namespace stillmap {
namespace {

/// Factor of the sides of voxels and pixels relative to the final map.
constexpr int kCoarser = 2;
/// Stride above which views are not made coarser [pixels].
constexpr int kCoarsest = 4;
/// Largest distance [m] and angle [rad] between views from nearly the same viewpoint.
constexpr double kSamePlace = 0.3, kSameDirection = 15 * std::numbers::pi / 180;
/// Number of previous views that vote on the surfaces that a new one adds.
constexpr std::uint32_t kVotingViews = 8;

// Returns the distance that a point two meters ahead of the camera moves between two poses [m].
double displacement(const Pose& a, const Pose& b) {
  const Eigen::Vector3d ahead(0, 0, 2), aside(1, 0, 1);
  return std::max((a * ahead - b * ahead).norm(), (a * aside - b * aside).norm());
}

DenseView coarse_view(const DenseView& view) {
  return view.stride >= kCoarsest ? view : coarser(view);
}

}  // namespace

LiveMap::LiveMap(double voxel, const EvidenceOptions& options, std::size_t max_voxels)
    : edge_(kCoarser * voxel),
      options_(options),
      max_voxels_(max_voxels),
      grid_(std::make_unique<StaticGrid>(edge_, options_, kVotingViews)) {}

void LiveMap::add(std::uint64_t id, std::shared_ptr<const DenseView> view,
                  const Pose& T_world_camera) {
  remove(id);
  const auto entry = views_.emplace(id, Entry{std::move(view), T_world_camera}).first;
  place(entry->second);
  place_some();
}

void LiveMap::remove(std::uint64_t id) {
  if (views_.erase(id) > 0) rebuild();
}

void LiveMap::forget(std::uint64_t id) {
  views_.erase(id);
  std::erase(waiting_, id);
}

std::optional<std::uint64_t> LiveMap::same_viewpoint_as(std::uint64_t id) const {
  const auto entry = views_.find(id);
  if (entry == views_.end()) return std::nullopt;
  const Pose T_camera_world = entry->second.T_world_camera.inverse();
  for (const auto& [other, candidate] : views_) {
    const Pose between = T_camera_world * candidate.T_world_camera;
    if (other != id && between.translation().norm() < kSamePlace &&
        between.angle() < kSameDirection) {
      return other;
    }
  }
  return std::nullopt;
}

bool LiveMap::update_poses(const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views,
                           const PoseLookup& T_world_camera) {
  bool moved = false;
  std::map<std::uint64_t, Entry> updated;
  for (const auto& [id, view] : views) {
    const std::optional<Pose> pose = T_world_camera(id);
    if (!pose) continue;
    const auto entry = views_.find(id);
    moved |=
        entry == views_.end() || displacement(entry->second.T_world_camera, *pose) > kReplacement;
    updated.emplace(id, Entry{view, *pose});
  }
  if (moved) {
    updated.merge(views_);
    views_ = std::move(updated);
    rebuild();
  }
  place_some();
  return moved;
}

// Views are placed in the order of their distance from the newest one.
void LiveMap::rebuild() {
  grid_ = std::make_unique<StaticGrid>(edge_, options_, kVotingViews);
  newest_.clear();
  class_votes_.clear();
  waiting_.clear();
  if (views_.empty()) return;
  const Pose here = views_.rbegin()->second.T_world_camera;
  std::vector<std::pair<double, std::uint64_t>> by_distance;
  for (const auto& [id, entry] : views_)
    by_distance.emplace_back(displacement(here, entry.T_world_camera), id);
  std::sort(by_distance.rbegin(), by_distance.rend());
  for (const auto& [distance, id] : by_distance) waiting_.push_back(id);
}

void LiveMap::place(const Entry& entry) {
  if (newest_.size() > kVotingViews) newest_.pop_front();
  newest_.push_back(coarse_view(*entry.view));
  entry.view->drop_pages();
  grid_->add(newest_.back(), entry.T_world_camera);
  vote_on_classes(newest_.back(), entry.T_world_camera);
  if (grid_->index().size() <= max_voxels_) return;
  edge_ *= 2;
  rebuild();
}

void LiveMap::place_some() {
  for (std::size_t n = 0; n < kAtOnce && !waiting_.empty(); ++n) {
    const std::uint64_t id = waiting_.back();
    waiting_.pop_back();
    place(views_.at(id));
  }
}

std::uint16_t LiveMap::number_of(const std::string& class_name) {
  const auto found = std::find(classes_.begin(), classes_.end(), class_name);
  const auto number = static_cast<std::uint16_t>(1 + (found - classes_.begin()));
  if (found == classes_.end()) classes_.push_back(class_name);
  return number;
}

/// Each view has one vote on each voxel that it sees in an instance.
void LiveMap::vote_on_classes(const DenseView& view, const Pose& T_world_camera) {
  if (view.instances.empty()) return;
  ++voting_views_;
  std::vector<std::uint16_t> numbers;
  for (const ViewInstance& instance : view.instances)
    numbers.push_back(number_of(instance.class_name));
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col) {
      const int instance = view.instance_at(row, col);
      if (instance < 0) continue;
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      const auto voxel =
          voxel_at(T_world_camera * view.camera.unproject(col, row, z), grid_->edge());
      const std::uint32_t cell = voxel ? grid_->index().find(*voxel) : VoxelIndex::kNone;
      if (cell == VoxelIndex::kNone) continue;
      if (cell >= class_votes_.size()) class_votes_.resize(grid_->index().size());
      ClassVotes& votes = class_votes_[cell];
      if (std::exchange(votes.last_view, voting_views_) == voting_views_) continue;
      const auto i = static_cast<std::size_t>(instance);
      votes.lead +=
          votes.leader == numbers[i] ? view.instances[i].confidence : -view.instances[i].confidence;
      if (votes.lead >= 0) continue;
      votes.leader = numbers[i];
      votes.lead = -votes.lead;
    }
  }
}

std::uint16_t LiveMap::class_of(std::uint32_t cell) const {
  if (cell >= class_votes_.size()) return 0;
  const ClassVotes& votes = class_votes_[cell];
  const float views = std::max<float>(1, grid_->cell(cell).views);
  return votes.lead >= kMinConfidence * views ? votes.leader : std::uint16_t{0};
}

Novelty LiveMap::novelty_of(const DenseView& view, const Pose& T_world_camera) const {
  Novelty novelty = grid_->novelty_of(coarse_view(view), T_world_camera);
  novelty.refuted_voxels *=
      kCoarser * kCoarser;  // The final map has that many more voxels per surface.
  return novelty;
}

}  // namespace stillmap
