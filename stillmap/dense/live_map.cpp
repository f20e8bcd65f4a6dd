// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/live_map.hpp"

#include <algorithm>
#include <utility>

namespace stillmap {
namespace {

constexpr int kCoarser = 2;           // than the final map, both voxels and pixels
constexpr int kCoarsest = 4;          // views are not made coarser than every fourth pixel
constexpr std::uint32_t kElders = 8;  // views that vote on what a new one adds

// How far a point two meters ahead of the camera moves from one pose to the other [m].
double displacement(const Pose& a, const Pose& b) {
  const Eigen::Vector3d ahead(0, 0, 2), aside(1, 0, 1);
  return std::max((a * ahead - b * ahead).norm(), (a * aside - b * aside).norm());
}

DenseView coarse_one(const DenseView& view) {
  return view.stride >= kCoarsest ? view : coarser(view);
}

}  // namespace

LiveMap::LiveMap(double voxel, const EvidenceOptions& options, std::size_t max_voxels)
    : edge_(kCoarser * voxel),
      options_(options),
      max_voxels_(max_voxels),
      grid_(std::make_unique<StaticGrid>(edge_, options_, kElders)) {}

void LiveMap::add(std::uint64_t id, std::shared_ptr<const DenseView> view,
                  const Pose& T_world_camera) {
  remove(id);
  const auto held = views_.emplace(id, Held{std::move(view), T_world_camera, {}}).first;
  place(held->second);
  place_some();
}

void LiveMap::remove(std::uint64_t id) {
  if (views_.erase(id) > 0) begin_anew();
}

bool LiveMap::follow(const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views,
                     const PoseLookup& T_world_camera) {
  bool moved = false;
  std::map<std::uint64_t, Held> told;
  for (const auto& [id, view] : views) {
    const std::optional<Pose> pose = T_world_camera(id);
    if (!pose) continue;
    const auto held = views_.find(id);
    moved |=
        held == views_.end() || displacement(held->second.T_world_camera, *pose) > kReplacement;
    told.emplace(id, Held{view, *pose, {}});
  }
  if (moved) {
    told.merge(views_);
    views_ = std::move(told);
    begin_anew();
  }
  place_some();
  return moved;
}

// The newest view stands where the camera is.
void LiveMap::begin_anew() {
  grid_ = std::make_unique<StaticGrid>(edge_, options_, kElders);
  waiting_.clear();
  if (views_.empty()) return;
  const Pose here = views_.rbegin()->second.T_world_camera;
  std::vector<std::pair<double, std::uint64_t>> by_distance;
  for (auto& [id, held] : views_) {
    held.coarse = {};
    by_distance.emplace_back(displacement(here, held.T_world_camera), id);
  }
  std::sort(by_distance.rbegin(), by_distance.rend());
  for (const auto& [distance, id] : by_distance) waiting_.push_back(id);
}

void LiveMap::place(Held& held) {
  held.coarse = coarse_one(*held.view);
  grid_->add(held.coarse, held.T_world_camera);
  if (grid_->index().size() <= max_voxels_) return;
  edge_ *= 2;
  begin_anew();
}

void LiveMap::place_some() {
  for (std::size_t n = 0; n < kAtOnce && !waiting_.empty(); ++n) {
    const std::uint64_t id = waiting_.back();
    waiting_.pop_back();
    place(views_.at(id));
  }
}

News LiveMap::news_in(const DenseView& view, const Pose& T_world_camera) const {
  News news = grid_->news_in(coarse_one(view), T_world_camera);
  news.refuted *= kCoarser * kCoarser;  // a surface has so many more voxels in the final map
  return news;
}

std::size_t LiveMap::bytes() const {
  std::size_t bytes = grid_->bytes();
  for (const auto& [id, held] : views_) bytes += sizeof(id) + held.coarse.bytes();
  return bytes;
}

}  // namespace stillmap
