// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/static_grid.hpp"

#include "stillmap/base/parallel_for.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>
#include <utility>

namespace stillmap {
namespace {

/// Minimum number of votes against a voxel to remove it; chosen on simulated scenes.
constexpr int kMinVotes = 2;
/// Share of the keyframes with a vote on a voxel that must vote against it to remove it [0..1], if
/// some of them see through it; chosen on simulated scenes.
constexpr double kRemovalShare = 0.35;
/// Number of keyframes seeing through a voxel since its last surface after which it is free.
constexpr int kVacated = 4;

constexpr std::uint32_t kNone = VoxelIndex::kNone;

/// Side of a region [voxels].
constexpr int kRegionSide = 8 * VoxelIndex::kSide;
/// Number of regions after which the pages of views that voted on them are dropped.
constexpr std::size_t kRegionsAtOnce = 64;

/// Sides of the cells of far surfaces, and of the cubes that mark nearer surfaces [voxels].
constexpr int kFarStep = 2, kNearSurfaceSide = 4;
/// Reach of a far pixel along its ray, in standard deviations of its depth.
constexpr double kFarReach = 3;

/// Minimum number of pixels for a color gain, their range of intensities [0..255], and the largest
/// gain.
constexpr std::size_t kMinGainPixels = 500;
constexpr float kDarkest = 16, kBrightest = 240, kLargestGain = 2;

/// Largest distance of neighboring pixels between which a surface is continued [voxels].
constexpr int kLongestGap = 8;

bool exposed(float value) { return value >= kDarkest && value <= kBrightest; }

/// Returns the i-th of 0, 1, -1, 2, -2 ...
int alternating(int i) { return i % 2 == 0 ? -i / 2 : (i + 1) / 2; }

/// Returns whether `holds` for a voxel within `reach` voxels along each axis.
template <typename Condition>
bool any_around(const Lattice& center, int reach, const Condition& holds) {
  for (int x = -reach; x <= reach; ++x) {
    for (int y = -reach; y <= reach; ++y) {
      for (int z = -reach; z <= reach; ++z) {
        if (holds(voxel_of(center + Lattice(x, y, z)))) return true;
      }
    }
  }
  return false;
}

/// Returns whether a pixel and its neighbors to the right and below are static surfaces, and may be
/// as far apart as a distance [m].
/// @param pixel  side of a pixel at a depth of 1 m [m]
bool is_wide_surface(const DenseView& view, int row, int col, double pixel, double distance) {
  std::uint16_t nearest = 65535, farthest = 0;
  for (const auto& [r, c] :
       {std::pair{row, col}, {row, col + 1}, {row + 1, col}, {row + 1, col + 1}}) {
    if (!view.is_static(r, c)) return false;
    nearest = std::min(nearest, view.depth(r, c));
    farthest = std::max(farthest, view.depth(r, c));
  }
  const double unit = DenseView::kDepthUnit, side = unit * farthest * pixel;
  const double step = unit * (farthest - nearest);
  return side * side + step * step >= distance * distance;
}

}  // namespace

StaticGrid::StaticGrid(double edge, const EvidenceOptions& options, std::uint32_t previous_views,
                       int threads)
    : edge_(edge), options_(options), threads_(threads), previous_views_(previous_views) {
  require_voxel_size(edge, "dense voxel size");
}

StaticGrid::VotingView StaticGrid::voting_view(const DenseView& view,
                                               const Pose& T_world_camera) const {
  VotingView voter{PlacedView(view, T_world_camera), DepthWeight(view.camera.depth_sensor), {}};
  const VoxelIndex::Block block{.corner = voxel_of({0, 0, 0})};
  const double middle = 0.5 * edge_ * VoxelIndex::kSide;
  for (unsigned place = 0; place < VoxelIndex::kPlaces; ++place) {
    const Eigen::Vector3d center = center_of(VoxelIndex::voxel_in(block, place), edge_);
    voter.steps[place] = voter.placed.rotated((center.array() - middle).matrix().cast<float>());
  }
  return voter;
}

// The new view votes on the existing cells, and the previous views on the new ones.
void StaticGrid::add(const DenseView& view, const Pose& T_world_camera) {
  const TraceScope scope("evidence");
  voting_views_.push_back(voting_view(view, T_world_camera));
  const auto known = static_cast<std::uint32_t>(index_.size());
  insert(voting_views_.back().placed);
  if (!options_.remove_ghosts) return view.drop_pages();
  const std::uint32_t newest = newest_view();
  std::vector<std::uint8_t> reached(block_centers_.size());
  for (const std::uint32_t block : blocks_in_reach(voting_views_.back().placed)) reached[block] = 1;
  parallel_lanes(reached.size(), threads_, [&](std::size_t block) {
    if (reached[block] != 0) vote(newest, static_cast<std::uint32_t>(block), {0, known});
  });
  vote_on_new({newest > previous_views_ ? newest - previous_views_ : 1, newest}, {known, kNone});
  view.drop_pages();
}

// Returns whether there is a surface within one voxel of a point, or of the points up to `reach`
// [m] before and behind it on its ray.
bool StaticGrid::has_surface_near(const Eigen::Vector3d& p_world, const Eigen::Vector3d& ray,
                                  double reach) const {
  const int steps = static_cast<int>(std::ceil(reach / edge_));
  for (int i = 0; i <= 2 * steps; ++i) {
    const auto middle = voxel_at(p_world + alternating(i) * edge_ * ray, edge_);
    const auto has_surface = [&](Voxel voxel) { return index_.find(voxel) != kNone; };
    if (middle && any_around(lattice_of(*middle), 1, has_surface)) return true;
  }
  return false;
}

Novelty StaticGrid::novelty_of(const DenseView& view, const Pose& T_world_camera) const {
  const TraceScope scope("novelty");
  constexpr int kStep = 3;      // pixels
  constexpr double kReach = 3;  // standard deviations of a depth
  const VotingView voter = voting_view(view, T_world_camera);
  const PlacedView& placed = voter.placed;
  Novelty novelty;
  for (int row = 0; row < view.depth.rows; row += kStep) {
    for (int col = 0; col < view.depth.cols; col += kStep) {
      if (!view.is_static(row, col)) continue;
      ++novelty.pixels_examined;
      const double reach = kReach * view.camera.depth_sensor.sigma(placed.depth(row, col));
      novelty.new_pixels += !has_surface_near(placed.point(row, col), placed.ray(row, col), reach);
    }
  }
  for (const std::uint32_t b : blocks_in_reach(placed))
    novelty.refuted_voxels += refuted_in(voter, b);
  return novelty;
}

// Returns the number of static cells in a block that a view sees through.
std::size_t StaticGrid::refuted_in(const VotingView& voter, std::uint32_t number) const {
  const PlacedView& placed = voter.placed;
  const Eigen::Vector3f middle = placed.in_camera(block_centers_[number]);
  const std::optional<VoxelVote> whole = placed.within(middle, block_radius());
  if (whole == VoxelVote::kNone) return 0;
  const VoxelIndex::Block& block = index_.block(number);
  std::size_t refuted = 0;
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
    const auto place = static_cast<std::size_t>(std::countr_zero(left));
    const bool through = whole || placed.at(middle + voter.steps[place]) == VoxelVote::kSeenThrough;
    refuted += through && is_static(block.numbers[place]);
  }
  return refuted;
}

std::uint32_t StaticGrid::cell_of(const Eigen::Vector3d& p_world) {
  const std::optional<Voxel> voxel = voxel_at(p_world, edge_);
  if (!voxel) return kNone;
  const std::uint32_t cell = index_.add(*voxel);
  if (cell == cells_.size()) cells_.emplace_back();
  if (index_.block_count() > block_centers_.size()) {
    add_block(index_.block(index_.block_of(cell)));
  }
  return cell;
}

void StaticGrid::add_block(const VoxelIndex::Block& block) {
  const double half = 0.5 * edge_ * VoxelIndex::kSide;
  const Eigen::Vector3d center = (corner_of(block.corner, edge_).array() + half).matrix();
  const Voxel voxel = *voxel_at(center, kRegionSide * edge_);
  const std::uint32_t region = region_index_.add(voxel);
  if (region == regions_.size()) {
    regions_.push_back({center_of(voxel, kRegionSide * edge_).cast<float>(), {}});
  }
  regions_[region].blocks.push_back(static_cast<std::uint32_t>(block_centers_.size()));
  region_of_block_.push_back(region);
  block_centers_.push_back(center.cast<float>());
}

// Returns the cell of each pixel, or kNone without a static surface.
std::vector<std::uint32_t> StaticGrid::cells_under(const PlacedView& placed) {
  const DenseView& view = placed.view();
  std::vector<std::uint32_t> cells(view.depth.total(), kNone);
  auto cell = cells.begin();
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col, ++cell) {
      if (view.is_static(row, col)) *cell = cell_of(placed.point(row, col));
    }
  }
  return cells;
}

// Returns the factors from the view's colors to those of the cells, medians of the ratios.
Eigen::Vector3f StaticGrid::gain_for(const DenseView& view,
                                     const std::vector<std::uint32_t>& cells) const {
  std::array<std::vector<float>, 3> ratios;
  constexpr std::size_t kStep = 5;  // a fifth of the pixels suffices
  for (std::size_t i = 0; i < cells.size(); i += kStep) {
    if (cells[i] == kNone || cells_[cells[i]].weight <= 0) continue;
    const StaticCell& cell = cells_[cells[i]];
    const Eigen::Vector3f seen = rgb_of(view.color(static_cast<int>(i)));
    const Eigen::Vector3f stored = cell.color_sum / cell.weight;
    for (int c = 0; c < 3; ++c) {
      if (exposed(seen[c]) && exposed(stored[c]))
        ratios[static_cast<std::size_t>(c)].push_back(stored[c] / seen[c]);
    }
  }
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();
  for (int c = 0; c < 3; ++c) {
    auto& values = ratios[static_cast<std::size_t>(c)];
    if (values.size() < kMinGainPixels) return Eigen::Vector3f::Ones();
    gain[c] = std::clamp(upper_median(values), 1 / kLargestGain, kLargestGain);
  }
  return gain;
}

void StaticGrid::insert(const PlacedView& placed) {
  const TraceScope scope("placing");
  const std::vector<std::uint32_t> cells = cells_under(placed);
  gains_.push_back(gain_for(placed.view(), cells));
  const int cols = placed.view().depth.cols;
  for (int i = 0; i < static_cast<int>(cells.size()); ++i) {
    const std::uint32_t number = cells[static_cast<std::size_t>(i)];
    if (number != kNone)
      add(sample_at(voting_views_.back(), i / cols, i % cols), newest_view(), number);
  }
  if (options_.interpolate) add_between(voting_views_.back());
}

StaticGrid::Sample StaticGrid::sample_at(const VotingView& voter, int row, int col) {
  const PlacedView& placed = voter.placed;
  const DenseView& view = placed.view();
  return {.p_world = placed.point(row, col),
          .color = rgb_of(view.color(row, col)),
          .weight = voter.weight.at(static_cast<float>(placed.depth(row, col))),
          .doubtful = view.kind(row, col) == kDoubtfulSurface};
}

StaticGrid::Sample StaticGrid::mixed(const Sample& a, const Sample& b, double share_of_b) {
  const auto share = static_cast<float>(share_of_b);
  return {.p_world = a.p_world + share_of_b * (b.p_world - a.p_world),
          .color = a.color + share * (b.color - a.color),
          .weight = a.weight + share * (b.weight - a.weight),
          .doubtful = a.doubtful || b.doubtful};
}

void StaticGrid::add(const Sample& sample, std::uint32_t view, std::uint32_t number) {
  const Eigen::Vector3f offset =
      (sample.p_world - corner_of(index_.voxel(number), edge_)).cast<float>();
  StaticCell& cell = cells_[number];
  cell.offset_sum += sample.weight * offset;
  cell.color_sum += sample.weight * sample.color.cwiseProduct(gains_[view - 1]).cwiseMin(255.0F);
  cell.weight += sample.weight;
  if (cell.last_view == view) return;
  if (cell.visit < visit_of(view)) begin_visit(visit_of(view), cell);
  cell.last_view = view;
  ++cell.views;
  cell.doubtful += sample.doubtful;
  cell.free_since = 0;
}

// Forgets the votes of earlier visits, and the surface that was no longer there.
void StaticGrid::begin_visit(std::uint16_t visit, StaticCell& cell) const {
  if (!is_static(cell)) cell.views = cell.doubtful = 0;
  cell.free = cell.free_visit == visit ? cell.free_then : 0;
  cell.movers = 0;
  cell.visit = visit;
}

// Adds the points between each pixel and its neighbors to the right and below if these are two or
// more voxels apart, as on a floor in the distance. Pixels at depth edges have no static surface.
void StaticGrid::add_between(const VotingView& voter) {
  const PlacedView& placed = voter.placed;
  const DenseView& view = placed.view();
  const double pixel = std::max(1 / view.camera.fx, 1 / view.camera.fy);
  const auto gap = [&](const Sample& a, const Sample& b) {
    return std::max(1, static_cast<int>((a.p_world - b.p_world).norm() / edge_));
  };
  for (int row = 0; row + 1 < view.depth.rows; ++row) {
    for (int col = 0; col + 1 < view.depth.cols; ++col) {
      if (!is_wide_surface(view, row, col, pixel, 2 * edge_)) continue;
      const Sample a = sample_at(voter, row, col), b = sample_at(voter, row, col + 1);
      const Sample c = sample_at(voter, row + 1, col), d = sample_at(voter, row + 1, col + 1);
      const int across = std::max(gap(a, b), gap(c, d)), down = std::max(gap(a, c), gap(b, d));
      if (std::max(across, down) > kLongestGap) continue;
      for (int i = 1; i < across * down; ++i) {  // 0 is the pixel itself
        const double x = static_cast<double>(i % across) / across;
        const double y = static_cast<double>(i / across) / down;
        const Sample between = mixed(mixed(a, b, x), mixed(c, d, x), y);
        const std::uint32_t number = cell_of(between.p_world);
        if (number != kNone) add(between, newest_view(), number);
      }
    }
  }
}

// Returns the static surfaces in cubes so large that the pixels leave no gaps.
VoxelIndex StaticGrid::find_near_surfaces() const {
  VoxelIndex near_surfaces;
  for (std::uint32_t cell = 0; cell < cells_.size(); ++cell) {
    if (!is_static(cell)) continue;
    if (const auto voxel = voxel_at(mean(cell).cast<double>(), kNearSurfaceSide * edge_)) {
      near_surfaces.add(*voxel);
    }
  }
  return near_surfaces;
}

// Returns the cell of a far pixel, or kNone if a nearer view has a surface there. Cells of far
// surfaces are on a lattice of every kFarStep-th voxel, matching the distance of the pixels.
std::uint32_t StaticGrid::far_cell(const PlacedView& placed, int row, int col,
                                   const VoxelIndex& near_surfaces) {
  const Eigen::Vector3d p = placed.point(row, col), ray = placed.ray(row, col);
  const DepthSensor& sensor = placed.view().camera.depth_sensor;
  const double noise = kFarReach * sensor.sigma(placed.depth(row, col));
  const double coarse = kNearSurfaceSide * edge_;
  const int probes = 1 + static_cast<int>(2 * noise / coarse);  // two per cube in both directions
  for (int i = -probes; i <= probes; ++i) {
    const auto voxel = voxel_at(p + 0.5 * i * coarse * ray, coarse);
    if (!voxel || near_surfaces.find(*voxel) != kNone) return kNone;
  }
  const std::uint32_t known = far_cell_on_ray(placed, row, col, [](std::uint32_t) { return true; });
  if (known != kNone) return known;
  const auto corner = far_voxel(p);
  const std::uint32_t cell = corner ? cell_of(center_of(*corner, edge_)) : kNone;
  return is_far(cell) ? cell : kNone;
}

std::optional<Voxel> StaticGrid::far_voxel(const Eigen::Vector3d& p_world) const {
  const auto voxel = voxel_at(p_world, kFarStep * edge_);
  return voxel ? std::optional(voxel_of(kFarStep * lattice_of(*voxel))) : std::nullopt;
}

std::uint32_t StaticGrid::far_cell_on_ray(
    const PlacedView& placed, int row, int col,
    const std::function<bool(std::uint32_t cell)>& is_wanted) const {
  const Eigen::Vector3d p = placed.point(row, col), ray = placed.ray(row, col);
  const double side = kFarStep * edge_;
  const double noise = kFarReach * placed.view().camera.depth_sensor.sigma(placed.depth(row, col));
  const int steps = 1 + static_cast<int>(2 * noise / side);
  for (int i = 0; i <= 2 * steps; ++i) {
    const auto corner = far_voxel(p + 0.5 * alternating(i) * side * ray);
    const std::uint32_t cell = corner ? index_.find(*corner) : kNone;
    if (cell != kNone && is_far(cell) && is_wanted(cell)) return cell;
  }
  return kNone;
}

void StaticGrid::fill_far() {
  const TraceScope scope("far surfaces");
  first_far_ = static_cast<std::uint32_t>(index_.size());
  const VoxelIndex near_surfaces = find_near_surfaces();
  for (std::uint32_t number = 1; number <= newest_view(); ++number) fill_far(number, near_surfaces);
  if (!options_.remove_ghosts) return;
  vote_on_new({1, newest_view() + 1}, {first_far_, kNone});
}

void StaticGrid::fill_far(std::uint32_t number, const VoxelIndex& near_surfaces) {
  const PlacedView& placed = voting_views_[number - 1].placed;
  const cv::Mat1b& kind = placed.view().kind;
  for (int row = 0; row < kind.rows; ++row) {
    for (int col = 0; col < kind.cols; ++col) {
      if (kind(row, col) != kFarSurface) continue;
      const std::uint32_t cell = far_cell(placed, row, col, near_surfaces);
      if (cell != kNone) add(sample_at(voting_views_[number - 1], row, col), number, cell);
    }
  }
  placed.view().drop_pages();
}

// Returns the numbers of the blocks of some cells in ascending order.
std::vector<std::uint32_t> StaticGrid::blocks_of(Range cells) const {
  std::vector<std::uint32_t> blocks;
  const auto last = std::min(cells.last, static_cast<std::uint32_t>(index_.size()));
  for (std::uint32_t cell = cells.first; cell < last; ++cell)
    blocks.push_back(index_.block_of(cell));
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

// Returns the radius [m] of a ball around the centers of a block's cells.
float StaticGrid::block_radius() const {
  return static_cast<float>(edge_) * (VoxelIndex::kSide - 1) * 0.8661F;  // half a diagonal
}

// Returns whether a view may vote on cells of a region, whose blocks are all inside it.
bool StaticGrid::reaches(const PlacedView& placed, const Region& region) const {
  const auto radius = static_cast<float>(edge_) * kRegionSide * 0.8661F;  // half a diagonal
  return placed.within(placed.in_camera(region.center), radius) != VoxelVote::kNone;
}

std::vector<std::uint32_t> StaticGrid::blocks_in_reach(const PlacedView& placed) const {
  std::vector<std::uint32_t> blocks;
  for (const Region& region : regions_) {
    if (reaches(placed, region))
      blocks.insert(blocks.end(), region.blocks.begin(), region.blocks.end());
  }
  return blocks;
}

void StaticGrid::vote_on_new(Range views, Range cells) {
  std::map<std::uint32_t, std::vector<std::uint32_t>> by_region;
  for (const std::uint32_t b : blocks_of(cells)) by_region[region_of_block_[b]].push_back(b);
  const std::vector<std::pair<std::uint32_t, std::vector<std::uint32_t>>> regions(by_region.begin(),
                                                                                  by_region.end());
  for (std::size_t first = 0; first < regions.size(); first += kRegionsAtOnce) {
    const auto vote_on = [&](std::size_t i) {
      const auto& [region, blocks] = regions[first + i];
      for (std::uint32_t view = views.first; view < views.last; ++view) {
        if (!reaches(voting_views_[view - 1].placed, regions_[region])) continue;
        for (const std::uint32_t b : blocks) vote(view, b, cells);
      }
    };
    parallel_for(std::min(kRegionsAtOnce, regions.size() - first), threads_,
                 [&] { return vote_on; });
    drop_pages(views);
  }
}

void StaticGrid::drop_pages(Range views) const {
  for (std::uint32_t view = views.first; view < views.last; ++view)
    voting_views_[view - 1].placed.view().drop_pages();
}

void StaticGrid::vote(std::uint32_t view, std::uint32_t number, Range cells) {
  const auto& [placed, weight, steps] = voting_views_[view - 1];
  const Eigen::Vector3f middle = placed.in_camera(block_centers_[number]);
  const std::optional<VoxelVote> whole = placed.within(middle, block_radius());
  if (whole == VoxelVote::kNone) return;
  const VoxelIndex::Block& block = index_.block(number);
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
    const auto place = static_cast<std::size_t>(std::countr_zero(left));
    const std::uint32_t cell = block.numbers[place];
    if (cell < cells.first || cell >= cells.last) continue;
    const VoxelVote vote = whole ? *whole : placed.at(middle + steps[place]);
    if (vote != VoxelVote::kNone) count(vote, view, cells_[cell]);
  }
}

void StaticGrid::count(VoxelVote vote, std::uint32_t view, StaticCell& cell) const {
  if (cell.last_view == view) return;  // It has a static surface there itself.
  const std::uint16_t visit = visit_of(view);
  if (visit < cell.visit) return;
  if (vote == VoxelVote::kMover) ++cell.movers;
  if (vote != VoxelVote::kSeenThrough) return;
  ++cell.free;
  cell.free_then = cell.free_visit == visit ? cell.free_then + 1 : 1;
  cell.free_visit = visit;
  if (view > cell.last_view) ++cell.free_since;
}

bool StaticGrid::is_static(const StaticCell& cell) const {
  if (!options_.remove_ghosts) return true;
  const int against = cell.free + cell.movers;
  if (against < kMinVotes) return true;
  if (cell.free == 0) return cell.views >= cell.movers;  // people also stand on static surfaces
  const int votes = against + cell.views;
  return against < kRemovalShare * static_cast<double>(votes) && cell.free_since < kVacated;
}

bool StaticGrid::is_confirmed(std::uint32_t number) const {
  const StaticCell& cell = cells_[number];
  if (!options_.remove_ghosts || cell.doubtful == 0 || cell.views > 1) return true;
  constexpr int kAround = 2;
  return any_around(lattice_of(index_.voxel(number)), kAround, [&](Voxel voxel) {
    const std::uint32_t other = index_.find(voxel);
    if (other == kNone || !is_static(other)) return false;
    return cells_[other].last_view != cell.last_view || cells_[other].views > 1;
  });
}

Eigen::Vector3f StaticGrid::mean(std::uint32_t number) const {
  const StaticCell& cell = cells_[number];
  const Eigen::Vector3d offset = (cell.offset_sum / cell.weight).cast<double>();
  return (corner_of(index_.voxel(number), edge_) + offset).cast<float>();
}

Rgb StaticGrid::color(std::uint32_t number) const {
  const StaticCell& cell = cells_[number];
  const Eigen::Vector3f color = cell.color_sum / cell.weight;
  const auto channel = [&](int c) {
    return static_cast<std::uint8_t>(std::clamp(std::round(color[c]), 0.0F, 255.0F));
  };
  return {channel(0), channel(1), channel(2)};
}

}  // namespace stillmap
