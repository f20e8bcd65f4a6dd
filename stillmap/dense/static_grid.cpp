// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/static_grid.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/statistics.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <map>

namespace stillmap {
namespace {

/// Share of the keyframes with a vote on a voxel that must vote against it to remove it [0..1].
constexpr double kRemovalShare = 0.35;
/// A voxel that this many keyframes saw through since it was last seen has become free.
constexpr int kVacated = 4;

constexpr std::uint32_t kNone = VoxelIndex::kNone;

constexpr int kRegionSide = 8 * VoxelIndex::kSide;  // voxels

constexpr int kFarStep = 2;      // side of far cells [voxels]
constexpr int kSettled = 4;      // side of what is looked up for surfaces seen nearer [voxels]
constexpr double kFarReach = 3;  // standard deviations of a far pixel's depth

// Gains are judged by this many pixels at least, none of them too dark or saturated.
constexpr std::size_t kEnoughForGain = 500;
constexpr float kDarkest = 16, kBrightest = 240, kLargestGain = 2;

bool exposed(float value) { return value >= kDarkest && value <= kBrightest; }

Eigen::Vector3f rgb_of(const cv::Vec3b& bgr) {
  return {static_cast<float>(bgr[2]), static_cast<float>(bgr[1]), static_cast<float>(bgr[0])};
}

}  // namespace

StaticGrid::StaticGrid(double edge, const EvidenceOptions& options, std::uint32_t elders)
    : edge_(edge), options_(options), elders_(elders) {
  require_voxel_size(edge, "dense voxel size");
}

StaticGrid::Witness StaticGrid::witness(const DenseView& view, const Pose& T_world_camera) const {
  Witness witness{PlacedView(view, T_world_camera), DepthWeight(view.camera.depth_sensor), {}};
  const VoxelIndex::Block block{.corner = voxel_of({0, 0, 0})};
  const double middle = 0.5 * edge_ * VoxelIndex::kSide;
  for (unsigned place = 0; place < VoxelIndex::kPlaces; ++place) {
    const Eigen::Vector3d center = center_of(VoxelIndex::voxel_in(block, place), edge_);
    witness.steps[place] = witness.placed.turned((center.array() - middle).matrix().cast<float>());
  }
  return witness;
}

// The new view votes on the cells that were there, the views before it on the new ones.
void StaticGrid::add(const DenseView& view, const Pose& T_world_camera) {
  const TraceScope scope("evidence");
  witnesses_.push_back(witness(view, T_world_camera));
  const auto known = static_cast<std::uint32_t>(index_.size());
  insert(witnesses_.back().placed);
  if (!options_.remove_ghosts) return;
  const std::uint32_t newest = newest_view();
  for (const std::uint32_t b : blocks_in_reach(witnesses_.back().placed)) {
    vote(newest, b, {0, known});
  }
  vote_on_new({newest > elders_ ? newest - elders_ : 1, newest}, {known, kNone});
}

// Whether there is surface where this point lies, or within its noise before or behind it.
bool StaticGrid::has_surface_near(const Eigen::Vector3d& p_world,
                                  const Eigen::Vector3d& ray) const {
  for (const int steps : {0, 1, -1}) {
    const auto voxel = voxel_at(p_world + steps * edge_ * ray, edge_);
    if (voxel && index_.find(*voxel) != kNone) return true;
  }
  return false;
}

News StaticGrid::news_in(const DenseView& view, const Pose& T_world_camera) const {
  const TraceScope scope("look for news");
  constexpr int kStep = 3;  // pixels
  // Of a Kinect v1 at 2.5 m; beyond, pixels are farther apart than voxels, and noisier [m].
  constexpr double kMaxSigma = 0.009579;
  const double farthest = view.camera.depth_sensor.depth_at_sigma(kMaxSigma);
  const Witness seeing = witness(view, T_world_camera);
  const PlacedView& placed = seeing.placed;
  News news;
  for (int row = 0; row < view.depth.rows; row += kStep) {
    for (int col = 0; col < view.depth.cols; col += kStep) {
      if (!view.is_static(row, col) || placed.depth(row, col) > farthest) continue;
      ++news.looked_at;
      news.fresh += !has_surface_near(placed.point(row, col), placed.ray(row, col));
    }
  }
  for (const std::uint32_t b : blocks_in_reach(placed)) news.refuted += refuted_in(seeing, b);
  return news;
}

// Cells of the static map in a block that a view sees through.
std::size_t StaticGrid::refuted_in(const Witness& witness, std::uint32_t number) const {
  const PlacedView& placed = witness.placed;
  const Eigen::Vector3f middle = placed.in_camera(block_centers_[number]);
  const std::optional<Sight> whole = placed.within(middle, block_radius());
  if (whole == Sight::kNothing) return 0;
  const VoxelIndex::Block& block = index_.block(number);
  std::size_t refuted = 0;
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
    const auto place = static_cast<std::size_t>(std::countr_zero(left));
    const bool through = whole || placed.at(middle + witness.steps[place]) == Sight::kThrough;
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
    enter_block(index_.block(index_.block_of(cell)));
  }
  return cell;
}

void StaticGrid::enter_block(const VoxelIndex::Block& block) {
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

// Per pixel, kNone where there is no static surface.
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

// The factors that make the view's colors those of the cells, medians of the ratios.
Eigen::Vector3f StaticGrid::gain_for(const DenseView& view,
                                     const std::vector<std::uint32_t>& cells) const {
  std::array<std::vector<float>, 3> ratios;
  constexpr std::size_t kStep = 5;  // a fifth of the pixels is plenty
  for (std::size_t i = 0; i < cells.size(); i += kStep) {
    if (cells[i] == kNone || cells_[cells[i]].weight <= 0) continue;
    const StaticCell& cell = cells_[cells[i]];
    const Eigen::Vector3f seen = rgb_of(view.color(static_cast<int>(i)));
    const Eigen::Vector3f held = cell.color_sum / cell.weight;
    for (int c = 0; c < 3; ++c) {
      if (exposed(seen[c]) && exposed(held[c]))
        ratios[static_cast<std::size_t>(c)].push_back(held[c] / seen[c]);
    }
  }
  Eigen::Vector3f gain = Eigen::Vector3f::Ones();
  for (int c = 0; c < 3; ++c) {
    auto& values = ratios[static_cast<std::size_t>(c)];
    if (values.size() < kEnoughForGain) return Eigen::Vector3f::Ones();
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
    if (number != kNone) add_pixel(newest_view(), i / cols, i % cols, number);
  }
}

void StaticGrid::add_pixel(std::uint32_t view_number, int row, int col, std::uint32_t number) {
  const Witness& witness = witnesses_[view_number - 1];
  const PlacedView& placed = witness.placed;
  const Eigen::Vector3f& gain = gains_[view_number - 1];
  const DenseView& view = placed.view();
  const Eigen::Vector3d p_world = placed.point(row, col);
  const float weight = witness.weight.at(static_cast<float>(placed.depth(row, col)));
  StaticCell& cell = cells_[number];
  cell.offset_sum += weight * (p_world - corner_of(index_.voxel(number), edge_)).cast<float>();
  cell.color_sum += weight * rgb_of(view.color(row, col)).cwiseProduct(gain).cwiseMin(255.0F);
  cell.weight += weight;
  if (cell.pixels < std::numeric_limits<std::uint16_t>::max()) ++cell.pixels;
  if (cell.last_view == view_number) return;
  cell.last_view = view_number;
  ++cell.views;
  cell.doubtful += view.kind(row, col) == kDoubtfulSurface;
  cell.free_since = 0;
}

// Where there is a static surface, in voxels so large that its pixels leave no gaps.
VoxelIndex StaticGrid::settled_space() const {
  VoxelIndex settled;
  for (std::uint32_t cell = 0; cell < cells_.size(); ++cell) {
    if (!is_static(cell)) continue;
    if (const auto voxel = voxel_at(mean(cell).cast<double>(), kSettled * edge_)) {
      settled.add(*voxel);
    }
  }
  return settled;
}

// The cell that a far pixel belongs to; kNone where a nearer view has seen what it shows. Those of
// far surfaces lie on a lattice of every kFarStep-th voxel, as its pixels do.
std::uint32_t StaticGrid::far_cell(const PlacedView& placed, int row, int col,
                                   const VoxelIndex& settled) {
  const Eigen::Vector3d p = placed.point(row, col), ray = placed.ray(row, col);
  const DepthSensor& sensor = placed.view().camera.depth_sensor;
  const double noise = kFarReach * sensor.sigma(placed.depth(row, col));
  const double coarse = kSettled * edge_, side = kFarStep * edge_;
  const int looks = 1 + static_cast<int>(2 * noise / coarse);  // two a voxel, and both ways
  for (int i = -looks; i <= looks; ++i) {
    const auto voxel = voxel_at(p + 0.5 * i * coarse * ray, coarse);
    if (!voxel || settled.find(*voxel) != kNone) return kNone;
  }
  const auto home_of = [&](const Eigen::Vector3d& place) -> std::optional<Voxel> {
    const auto voxel = voxel_at(place, side);
    return voxel ? std::optional(voxel_of(kFarStep * lattice_of(*voxel))) : std::nullopt;
  };
  const int steps = 1 + static_cast<int>(2 * noise / side);
  for (int i = 0; i <= 2 * steps; ++i) {  // 0, 1, -1, 2, -2 ...
    const int step = i % 2 == 0 ? -i / 2 : (i + 1) / 2;
    const auto home = home_of(p + 0.5 * step * side * ray);
    const std::uint32_t cell = home ? index_.find(*home) : kNone;
    if (cell != kNone && is_far(cell)) return cell;
  }
  const auto home = home_of(p);
  const std::uint32_t cell = home ? cell_of(center_of(*home, edge_)) : kNone;
  return is_far(cell) ? cell : kNone;
}

void StaticGrid::fill_far() {
  const TraceScope scope("far surfaces");
  first_far_ = static_cast<std::uint32_t>(index_.size());
  const VoxelIndex settled = settled_space();
  for (std::uint32_t number = 1; number <= newest_view(); ++number) fill_far(number, settled);
  if (!options_.remove_ghosts) return;
  vote_on_new({1, newest_view() + 1}, {first_far_, kNone});
}

void StaticGrid::fill_far(std::uint32_t number, const VoxelIndex& settled) {
  const PlacedView& placed = witnesses_[number - 1].placed;
  const cv::Mat1b& kind = placed.view().kind;
  for (int row = 0; row < kind.rows; ++row) {
    for (int col = 0; col < kind.cols; ++col) {
      if (kind(row, col) != kFarSurface) continue;
      const std::uint32_t cell = far_cell(placed, row, col, settled);
      if (cell != kNone) add_pixel(number, row, col, cell);
    }
  }
}

// The blocks that hold some cells, in rising order.
std::vector<std::uint32_t> StaticGrid::blocks_of(Range cells) const {
  std::vector<std::uint32_t> blocks;
  const auto last = std::min(cells.last, static_cast<std::uint32_t>(index_.size()));
  for (std::uint32_t cell = cells.first; cell < last; ++cell)
    blocks.push_back(index_.block_of(cell));
  std::sort(blocks.begin(), blocks.end());
  blocks.erase(std::unique(blocks.begin(), blocks.end()), blocks.end());
  return blocks;
}

// Of a ball around a block that holds the centers of its cells.
float StaticGrid::block_radius() const {
  return static_cast<float>(edge_) * (VoxelIndex::kSide - 1) * 0.8661F;  // half a diagonal
}

// A region's blocks lie wholly in it: their lattices fit into each other.
bool StaticGrid::reaches(const PlacedView& placed, const Region& region) const {
  const auto radius = static_cast<float>(edge_) * kRegionSide * 0.8661F;  // half a diagonal
  return placed.within(placed.in_camera(region.center), radius) != Sight::kNothing;
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
  for (const auto& [region, blocks] : by_region) {
    for (std::uint32_t view = views.first; view < views.last; ++view) {
      if (!reaches(witnesses_[view - 1].placed, regions_[region])) continue;
      for (const std::uint32_t b : blocks) vote(view, b, cells);
    }
  }
}

void StaticGrid::vote(std::uint32_t view, std::uint32_t number, Range cells) {
  const auto& [placed, weight, steps] = witnesses_[view - 1];
  const Eigen::Vector3f middle = placed.in_camera(block_centers_[number]);
  const std::optional<Sight> whole = placed.within(middle, block_radius());
  if (whole == Sight::kNothing) return;
  const VoxelIndex::Block& block = index_.block(number);
  for (std::uint64_t left = block.occupied; left != 0; left &= left - 1) {
    const auto place = static_cast<std::size_t>(std::countr_zero(left));
    const std::uint32_t cell = block.numbers[place];
    if (cell < cells.first || cell >= cells.last) continue;
    const Sight sight = whole ? *whole : placed.at(middle + steps[place]);
    if (sight != Sight::kNothing) count(sight, view, cells_[cell]);
  }
}

void StaticGrid::count(Sight sight, std::uint32_t view, StaticCell& cell) const {
  if (cell.last_view == view) return;  // it saw a static surface there itself
  if (sight == Sight::kMover) ++cell.movers;
  if (sight != Sight::kThrough) return;
  ++cell.free;
  if (view > cell.last_view) ++cell.free_since;
}

bool StaticGrid::is_static(const StaticCell& cell) const {
  if (!options_.remove_ghosts) return true;
  const int against = cell.free + cell.movers;
  const int votes = against + cell.views;
  const bool outvoted =
      against >= options_.min_votes && against >= kRemovalShare * static_cast<double>(votes);
  return !outvoted && cell.free_since < kVacated;
}

bool StaticGrid::is_confirmed(std::uint32_t number) const {
  const StaticCell& cell = cells_[number];
  if (!options_.remove_ghosts || cell.doubtful == 0 || cell.views > 1) return true;
  constexpr int kAround = 2;
  const Lattice center = lattice_of(index_.voxel(number));
  for (int x = -kAround; x <= kAround; ++x) {
    for (int y = -kAround; y <= kAround; ++y) {
      for (int z = -kAround; z <= kAround; ++z) {
        const std::uint32_t other = index_.find(voxel_of(center + Lattice(x, y, z)));
        if (other == kNone || !is_static(other)) continue;
        if (cells_[other].last_view != cell.last_view || cells_[other].views > 1) return true;
      }
    }
  }
  return false;
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

std::size_t StaticGrid::bytes() const {
  return index_.bytes() + cells_.size() * sizeof(StaticCell) +
         block_centers_.capacity() * (sizeof(Eigen::Vector3f) + 2 * sizeof(std::uint32_t));
}

}  // namespace stillmap
