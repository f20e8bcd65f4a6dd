// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/dense_map.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <utility>

namespace stillmap {
namespace {

// A view this coarse has no shape left: it is emptied instead [pixels].
constexpr int kCoarsest = 64;

void require_valid(const DenseOptions& options) {
  const bool valid = options.min_samples >= 1 && options.min_keyframes >= 1 &&
                     options.max_pixels >= 1 && options.every >= 0 && options.min_news >= 0 &&
                     options.min_refuted >= 1;
  require_valid(options.back_projection);
  require_valid(options.outliers);
  require_valid(options.evidence);
  require_valid(options.semantics);
  require_valid(options.mesh);
  require_valid(options.occupancy);
  require_voxel_size(options.voxel, "dense.voxel");
  if (valid) return;
  throw Error("an option is out of range", "dense map",
              "min_samples, min_keyframes, max_pixels, min_refuted >= 1, every, min_news >= 0");
}

bool is_finite(const Pose& pose) {
  return pose.quaternion().coeffs().allFinite() && pose.translation().allFinite();
}

// How far a point two metres ahead of the camera moves from one pose to the other [m].
double displacement(const Pose& a, const Pose& b) {
  const Eigen::Vector3d ahead(0, 0, 2), aside(1, 0, 1);
  return std::max((a * ahead - b * ahead).norm(), (a * aside - b * aside).norm());
}

}  // namespace

PoseLookup pose_lookup(const std::map<std::uint64_t, Pose>& poses) {
  return [&poses](std::uint64_t id) -> std::optional<Pose> {
    const auto found = poses.find(id);
    return found == poses.end() ? std::nullopt : std::optional(found->second);
  };
}

DenseMap::DenseMap(const Camera& camera, const DenseOptions& options)
    : camera_(camera), options_(options) {
  require_valid(options_);
}

void DenseMap::add(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
                   const std::optional<Pose>& T_world_camera, const SegmentedFrame* things) {
  MadeView made =
      make_dense_view(camera_, frame, movers, options_.back_projection, options_.outliers, things);
  outliers_ += made.outliers;
  add(id, std::move(made.view), T_world_camera);
}

bool DenseMap::add_if_new(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
                          const Pose& T_world_camera, const SegmentedFrame* things) {
  MadeView made =
      make_dense_view(camera_, frame, movers, options_.back_projection, options_.outliers, things);
  if (live_ && is_finite(T_world_camera)) {
    const News news = live_->news_in(made.view, T_world_camera);
    const bool fresh =
        static_cast<double>(news.fresh) >=
        options_.min_news * static_cast<double>(std::max<std::size_t>(1, news.looked_at));
    if (!fresh && news.refuted < static_cast<std::size_t>(options_.min_refuted)) return false;
  }
  outliers_ += made.outliers;
  add(id, std::move(made.view), T_world_camera);
  return true;
}

void DenseMap::add(std::uint64_t id, DenseView view, const std::optional<Pose>& T_world_camera) {
  remove(id);
  pixels_ += view.depth.total();
  const auto held = views_.emplace(id, std::make_shared<DenseView>(std::move(view))).first;
  if (T_world_camera && is_finite(*T_world_camera)) {
    const bool newest = live_poses_.empty() || live_poses_.rbegin()->first < id;
    live_poses_[id] = *T_world_camera;
    if (!live_) live_ = std::make_shared<StaticGrid>(options_.voxel, options_.evidence);
    if (newest) {
      live_->add(*held->second, *T_world_camera);
    } else {
      place_all();
    }
  }
  thin_to_bound();
}

void DenseMap::remove(std::uint64_t id) {
  const auto found = views_.find(id);
  if (found == views_.end()) return;
  pixels_ -= found->second->depth.total();
  views_.erase(found);
  if (live_poses_.erase(id) > 0) place_all();
}

void DenseMap::follow(const PoseLookup& T_world_camera) {
  bool moved = false;
  std::map<std::uint64_t, Pose> poses;
  for (const auto& [id, view] : views_) {
    const std::optional<Pose> pose = T_world_camera(id);
    const auto before = live_poses_.find(id);
    if (pose && is_finite(*pose)) {
      poses[id] = *pose;
      moved |= before == live_poses_.end() || displacement(before->second, *pose) > kReplacement;
    } else if (before != live_poses_.end()) {
      poses[id] = before->second;  // not told: where it was
    }
  }
  if (!moved) return;
  live_poses_ = std::move(poses);
  place_all();
  ++replacements_;
}

void DenseMap::leave_world() {
  live_poses_.clear();
  live_.reset();
}

void DenseMap::place_all() {
  live_ = std::make_shared<StaticGrid>(options_.voxel, options_.evidence,
                                       live_ ? live_->index().size() : 0);
  for (const auto& [id, pose] : live_poses_) live_->add(*views_.at(id), pose);
}

// The finest view is thinned first, the oldest (lowest id) of equally fine ones: so detail is lost
// evenly, and latest where the camera is.
void DenseMap::thin_to_bound() {
  const auto finer = [](const auto& a, const auto& b) {
    const bool a_empty = a.second->depth.empty(), b_empty = b.second->depth.empty();
    return a_empty != b_empty ? b_empty : a.second->stride < b.second->stride;
  };
  while (pixels_ > static_cast<std::size_t>(options_.max_pixels)) {
    DenseView& view = *std::min_element(views_.begin(), views_.end(), finer)->second;
    pixels_ -= view.depth.total();
    view = view.stride < kCoarsest ? coarser(view)
                                   : DenseView{.camera = view.camera, .stride = view.stride};
    pixels_ += view.depth.total();
    ++thinnings_;
  }
}

// Which voxels are in the cloud.
PlacedMap DenseMap::sorted_out(std::shared_ptr<const StaticGrid> grid,
                               const std::vector<std::uint64_t>& ids,
                               const PoseLookup& T_world_camera) const {
  PlacedMap placed;
  placed.keyframes_left_out = views_.size() - ids.size();
  for (const std::uint64_t id : ids) {
    placed.held.push_back(views_.at(id));
    placed.views.push_back({placed.held.back().get(), T_world_camera(id).value()});
  }
  for (const std::uint32_t number : grid->index().sorted()) {
    const StaticCell& cell = grid->cell(number);
    const bool enough = cell.pixels >= static_cast<std::uint32_t>(options_.min_samples) &&
                        cell.views >= options_.min_keyframes;
    if (!enough) {
      ++placed.voxels_left_out;
    } else if (!grid->is_static(number) || !grid->is_confirmed(number)) {
      ++placed.voxels_removed;
    } else {
      placed.cells.push_back(number);
    }
  }
  placed.grid = std::move(grid);
  return placed;
}

PlacedMap DenseMap::place(const PoseLookup& T_world_camera) const {
  const auto grid = std::make_shared<StaticGrid>(options_.voxel, options_.evidence,
                                                 live_ ? live_->index().size() : 0);
  std::vector<std::uint64_t> ids;
  for (const auto& [id, view] : views_) {
    const std::optional<Pose> pose = T_world_camera(id);
    if (!pose || !is_finite(*pose)) continue;
    grid->add(*view, *pose);
    ids.push_back(id);
  }
  return sorted_out(grid, ids, T_world_camera);
}

ComposedCloud DenseMap::compose(const PoseLookup& T_world_camera) const {
  return cloud_of(place(T_world_camera), options_.semantics);
}

ComposedCloud DenseMap::live() const {
  if (!live_) return {};
  std::vector<std::uint64_t> ids;
  for (const auto& [id, pose] : live_poses_) ids.push_back(id);
  const auto pose_of = [&](std::uint64_t id) { return std::optional(live_poses_.at(id)); };
  return cloud_of(sorted_out(live_, ids, pose_of), options_.semantics);
}

Cloud raw_cloud(const PlacedMap& placed) {
  Cloud cloud;
  VoxelIndex met(placed.grid->index().size());
  for (const auto& [view, T_world_camera] : placed.views) {
    for (int row = 0; row < view->depth.rows; ++row) {
      for (int col = 0; col < view->depth.cols; ++col) {
        if (view->kind(row, col) == kNoSurface) continue;
        const double z = view->depth(row, col) * double{DenseView::kDepthUnit};
        const Eigen::Vector3d p = T_world_camera * view->camera.unproject(col, row, z);
        const auto voxel = voxel_at(p, placed.grid->edge());
        if (z <= 0 || !voxel || met.add(*voxel) < cloud.size()) continue;
        const cv::Vec3b& bgr = view->color(row, col);
        cloud.add(p.cast<float>(), {bgr[2], bgr[1], bgr[0]});
      }
    }
  }
  return cloud;
}

ComposedCloud cloud_of(const PlacedMap& placed, const SemanticOptions& options) {
  ComposedCloud result;
  result.keyframes = placed.views.size();
  result.keyframes_left_out = placed.keyframes_left_out;
  result.voxels_left_out = placed.voxels_left_out;
  result.voxels_removed = placed.voxels_removed;
  result.cloud.reserve(placed.cells.size());
  for (const std::uint32_t cell : placed.cells) {
    result.cloud.add(placed.grid->mean(cell), placed.grid->color(cell));
  }
  result.semantics = make_semantic_map(*placed.grid, placed.views, placed.cells, options);
  return result;
}

DenseStatistics DenseMap::statistics() const {
  return {.keyframes = views_.size(),
          .pixels = pixels_,
          .outliers = outliers_,
          .thinnings = thinnings_,
          .replacements = replacements_};
}

std::size_t DenseMap::bytes() const {
  std::size_t bytes = live_ ? live_->bytes() : 0;
  for (const auto& [id, view] : views_) bytes += sizeof(id) + view->bytes();
  return bytes;
}

}  // namespace stillmap
