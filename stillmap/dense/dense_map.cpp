// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/dense_map.hpp"

#include "stillmap/base/parallel_for.hpp"
#include "stillmap/dense/open_view.hpp"
#include "stillmap/dense/surface_refinement.hpp"
#include "stillmap/dense/view_colors.hpp"
#include "stillmap/dense/view_fusion.hpp"

#include <algorithm>
#include <numeric>
#include <ranges>
#include <utility>

namespace stillmap {
namespace {

/// Minimum share of a view that must be new for a frame that is no keyframe to be kept [0..1].
constexpr double kMinNovelty = 0.005;
/// Number of voxels seen through above which such a frame is kept too.
constexpr std::size_t kMinRefuted = 100;
/// Minimum share of the pixels of an earlier view with surfaces that no newer view shows, for the
/// view to be kept [0..1].
constexpr double kMinRest = 0.02;

bool is_finite(const Pose& pose) {
  return pose.quaternion().coeffs().allFinite() && pose.translation().allFinite();
}

/// Keeps one of the points in a voxel: that of the most certain cell.
void keep_one_per_voxel(PlacedMap& placed) {
  const auto weight = [&](std::size_t i) { return placed.grid->cell(placed.cells[i]).weight; };
  VoxelIndex index;
  std::vector<std::size_t> best;
  for (std::size_t i = 0; i < placed.points.size(); ++i) {
    const auto voxel = voxel_at(placed.points[i].cast<double>(), placed.grid->edge());
    if (!voxel) continue;
    const std::uint32_t number = index.add(*voxel);
    if (number == best.size())
      best.push_back(i);
    else if (weight(i) > weight(best[number]))
      best[number] = i;
  }
  std::sort(best.begin(), best.end());
  for (std::size_t i = 0; i < best.size(); ++i) {
    placed.cells[i] = placed.cells[best[i]];
    placed.points[i] = placed.points[best[i]];
  }
  placed.cells.resize(best.size());
  placed.points.resize(best.size());
}

/// Moves the points onto the surface, in steps: layers of voxels further apart than the noise of a
/// near view meet after the first one.
void refine(PlacedMap& placed) {
  constexpr int kSteps = 3;
  const auto resting = static_cast<float>(0.1 * placed.grid->edge());
  std::vector<std::size_t> moving(placed.points.size());
  std::iota(moving.begin(), moving.end(), std::size_t{0});
  for (int step = 0; step < kSteps; ++step) {
    std::vector<Eigen::Vector3f> points;
    for (const std::size_t i : moving) points.push_back(placed.points[i]);
    const std::vector<Eigen::Vector3f> refined = refined_points(points, placed.views);
    std::vector<std::size_t> still_moving;
    for (std::size_t k = 0; k < moving.size(); ++k) {
      placed.points[moving[k]] = refined[k];
      if ((refined[k] - points[k]).norm() > resting) still_moving.push_back(moving[k]);
    }
    moving = std::move(still_moving);
  }
  keep_one_per_voxel(placed);
}

}  // namespace

PoseLookup pose_lookup(const std::map<std::uint64_t, Pose>& poses) {
  return [&poses](std::uint64_t id) -> std::optional<Pose> {
    const auto found = poses.find(id);
    return found == poses.end() ? std::nullopt : std::optional(found->second);
  };
}

DenseMap::DenseMap(const Camera& camera, const DenseOptions& options)
    : camera_(camera), options_(options), pager_(options.memory) {
  start_new_world();
}

DenseMap::DenseMap(DenseMap&&) noexcept = default;
DenseMap& DenseMap::operator=(DenseMap&&) noexcept = default;
DenseMap::~DenseMap() = default;

void DenseMap::add(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
                   const std::optional<Pose>& T_world_camera, const SegmentedFrame* objects) {
  MadeView made = make_dense_view(camera_, frame, movers, options_.back_projection,
                                  options_.outliers, options_.far, objects);
  add(id, std::move(made), frame, T_world_camera);
}

bool DenseMap::add_if_new(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
                          const Pose& T_world_camera, const SegmentedFrame* objects) {
  MadeView made = make_dense_view(camera_, frame, movers, options_.back_projection,
                                  options_.outliers, options_.far, objects);
  if (is_finite(T_world_camera)) {
    const Novelty novelty = live_->novelty_of(made.view, T_world_camera);
    const bool is_new =
        static_cast<double>(novelty.new_pixels) >=
        kMinNovelty * static_cast<double>(std::max<std::size_t>(1, novelty.pixels_examined));
    if (!is_new && novelty.refuted_voxels < kMinRefuted) return false;
  }
  add(id, std::move(made), frame, T_world_camera);
  return true;
}

void DenseMap::add(std::uint64_t id, MadeView made, const RgbdFrame& frame,
                   const std::optional<Pose>& T_world_camera) {
  outliers_ += made.outliers;
  made.view.photo = photo_of(frame.color);
  add(id, std::move(made.view), T_world_camera);
}

void DenseMap::add(std::uint64_t id, DenseView view, const std::optional<Pose>& T_world_camera) {
  close_view();
  remove(id);
  pixels_ += view.depth.total();
  if (view.bytes_in_memory() > 0) in_memory_.insert(id);
  bytes_in_memory_ += view.bytes_in_memory();
  const auto held = views_.emplace(id, std::make_shared<DenseView>(std::move(view))).first;
  if (T_world_camera && is_finite(*T_world_camera)) live_->add(id, held->second, *T_world_camera);
  if (pixels_ > static_cast<std::size_t>(options_.many_pixels)) replace_same_viewpoint(id);
  page_out_oldest();
  if (options_.fuse && T_world_camera && is_finite(*T_world_camera)) open(id, *T_world_camera);
}

void DenseMap::open(std::uint64_t id, const Pose& T_world_camera) {
  newest_ = {id, T_world_camera,
             std::make_unique<OpenView>(*views_.at(id), options_.back_projection, options_.far)};
}

std::optional<std::uint64_t> DenseMap::open_view() const {
  return newest_ ? std::optional(newest_->id) : std::nullopt;
}

void DenseMap::fuse(const RgbdFrame& frame, const cv::Mat1b& movers, const Pose& T_world_camera) {
  if (!newest_ || !is_finite(T_world_camera)) return;
  newest_->depths->fuse(camera_, frame, movers, newest_->T_world_camera.inverse() * T_world_camera);
}

void DenseMap::close_view() {
  if (newest_ && newest_->depths->frames() > 0) {
    DenseView& view = *views_.at(newest_->id);
    bytes_in_memory_ -= view.bytes_in_memory();
    view = newest_->depths->fused();
    bytes_in_memory_ += view.bytes_in_memory();
    in_memory_.insert(newest_->id);
  }
  newest_.reset();
  page_out_oldest();
}

void DenseMap::remove(std::uint64_t id) {
  const auto found = views_.find(id);
  if (found == views_.end()) return;
  if (open_view() == id) newest_.reset();
  erase(found);
  live_->remove(id);
}

void DenseMap::erase(Views::iterator view) {
  pixels_ -= view->second->depth.total();
  bytes_in_memory_ -= view->second->bytes_in_memory();
  in_memory_.erase(view->first);
  views_.erase(view);
}

// The newest views, around the camera, stay in memory.
void DenseMap::page_out_oldest() {
  while (bytes_in_memory_ > pager_.limit()) {
    DenseView& oldest = *views_.at(*in_memory_.begin());
    const std::size_t bytes = oldest.bytes_in_memory();
    if (!pager_.page_out(oldest)) return;
    bytes_in_memory_ -= bytes;
    in_memory_.erase(in_memory_.begin());
  }
}

void DenseMap::update_poses(const PoseLookup& T_world_camera) {
  if (newest_) {
    const auto pose = T_world_camera(newest_->id);
    if (pose && is_finite(*pose)) newest_->T_world_camera = *pose;
  }
  replacements_ += live_->update_poses(views_, [&](std::uint64_t id) {
    const std::optional<Pose> pose = T_world_camera(id);
    return pose && is_finite(*pose) ? pose : std::nullopt;
  });
}

void DenseMap::start_new_world() {
  close_view();
  // A surface has a quarter as many voxels of twice the side.
  live_ = std::make_unique<LiveMap>(options_.voxel, options_.evidence,
                                    static_cast<std::size_t>(options_.max_voxels) / 4);
}

void DenseMap::replace_same_viewpoint(std::uint64_t id) {
  const auto older = live_->same_viewpoint_as(id);
  if (!older) return;
  const auto found = views_.find(*older);
  if (found == views_.end()) return;
  erase(found);
  live_->forget(*older);
  ++superseded_;
}

void DenseMap::replace_seen_again(std::uint64_t first, const PoseLookup& T_world_camera) {
  std::vector<std::pair<std::uint64_t, Pose>> newest_first;
  for (const auto& [id, view] : std::views::reverse(views_)) {
    const std::optional<Pose> pose = T_world_camera(id);
    if (pose && is_finite(*pose)) newest_first.emplace_back(id, *pose);
  }
  if (newest_first.empty() || newest_first.front().first < first) return;
  NewerViews newer;
  for (const auto& [id, pose] : newest_first) {
    if (id < first && !keep_rest(id, newer.rest_of({views_.at(id).get(), pose}))) continue;
    newer.add({views_.at(id).get(), pose}, id >= first);
  }
}

bool DenseMap::keep_rest(std::uint64_t id, RestOfView rest) {
  const auto pixels = static_cast<double>(rest.view.depth.total());
  const bool kept = static_cast<double>(rest.surfaces) >= kMinRest * pixels;
  if (kept) {
    add(id, std::move(rest.view));
  } else {
    remove(id);
    ++superseded_;
  }
  return kept;
}

// Returns the grid with the voxel size of the options, or larger voxels to stay below the bound.
std::shared_ptr<const StaticGrid> DenseMap::grid_of(const std::vector<PosedView>& views) const {
  const auto bound = static_cast<std::size_t>(options_.max_voxels);
  for (double edge = options_.voxel;; edge *= 2) {
    const auto grid =
        std::make_shared<StaticGrid>(edge, options_.evidence, StaticGrid::kAll, all_threads());
    for (const auto& [view, T_world_camera] : views) {
      grid->add(*view, T_world_camera);
      if (grid->index().size() > bound) break;
    }
    if (grid->index().size() <= bound) grid->fill_far();
    if (grid->index().size() <= bound) return grid;
  }
}

PlacedMap DenseMap::place(const PoseLookup& T_world_camera) const {
  PlacedMap placed;
  for (const auto& [id, view] : views_) {
    const std::optional<Pose> pose = T_world_camera(id);
    if (!pose || !is_finite(*pose)) continue;
    placed.held.push_back(view);
    placed.views.push_back({view.get(), *pose});
  }
  if (options_.fuse) {
    MemoryLimit memory = options_.memory;
    memory.limit -= std::min<std::uint64_t>(memory.limit, bytes_in_memory_);
    placed.held = fused_views(placed.views, memory);
    for (std::size_t i = 0; i < placed.views.size(); ++i)
      placed.views[i].view = placed.held[i].get();
  }
  if (options_.registration) placed.views = registered(placed.views);
  placed.keyframes_left_out = views_.size() - placed.views.size();
  placed.grid = grid_of(placed.views);
  for (const std::uint32_t number : placed.grid->index().sorted()) {
    const StaticCell& cell = placed.grid->cell(number);
    if (cell.views < options_.min_keyframes) {
      ++placed.voxels_left_out;
    } else if (!placed.grid->is_static(number) || !placed.grid->is_confirmed(number)) {
      ++placed.voxels_removed;
    } else {
      placed.cells.push_back(number);
    }
  }
  for (const std::uint32_t cell : placed.cells) placed.points.push_back(placed.grid->mean(cell));
  if (options_.fuse) refine(placed);
  placed.gains = color_gains(placed.points, placed.views);
  return placed;
}

Cloud raw_cloud(const PlacedMap& placed) {
  Cloud cloud;
  VoxelIndex seen;
  for (const auto& [view, T_world_camera] : placed.views) {
    for (int row = 0; row < view->depth.rows; ++row) {
      for (int col = 0; col < view->depth.cols; ++col) {
        if (view->kind(row, col) == kNoSurface) continue;
        const double z = view->depth(row, col) * double{DenseView::kDepthUnit};
        const Eigen::Vector3d p = T_world_camera * view->camera.unproject(col, row, z);
        const auto voxel = voxel_at(p, placed.grid->edge());
        if (z <= 0 || !voxel || seen.add(*voxel) < cloud.size()) continue;
        const cv::Vec3b& bgr = view->color(row, col);
        cloud.add(p.cast<float>(), {bgr[2], bgr[1], bgr[0]});
      }
    }
    view->drop_pages();
  }
  return cloud;
}

ComposedCloud cloud_of(const PlacedMap& placed) {
  ComposedCloud result;
  result.keyframes = placed.views.size();
  result.keyframes_left_out = placed.keyframes_left_out;
  result.voxels_left_out = placed.voxels_left_out;
  result.voxels_removed = placed.voxels_removed;
  result.cloud.points = placed.points;
  result.cloud.colors = surface_colors(result.cloud.points, placed.views, placed.gains);
  result.semantics = make_semantic_map(*placed.grid, placed.views, placed.cells);
  return result;
}

DenseStatistics DenseMap::statistics() const {
  const auto on_disk = [](const auto& view) { return view.second->pages != nullptr; };
  return {.keyframes = views_.size(),
          .pixels = pixels_,
          .outliers = outliers_,
          .bytes_in_memory = bytes_in_memory_,
          .views_on_disk =
              static_cast<std::size_t>(std::count_if(views_.begin(), views_.end(), on_disk)),
          .superseded = superseded_,
          .replacements = replacements_};
}

}  // namespace stillmap
