// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/static_grid.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

constexpr int kCellsPerBlock = 32;  // along an edge: 32 cm at 1 cm
constexpr float kNearest = 0.1F;    // nothing nearer to a camera is looked at [m]
constexpr std::uint32_t kNone = VoxelIndex::kNone;

// 1 / sigma^2 of a depth, in units of that at one metre.
float depth_weight(float z) {
  const float floor = std::max(z, 0.5F);  // nearer, the noise is that of quantisation and poses
  return 1 / (floor * floor * floor * floor);
}

// Gains are judged by this many pixels at least, none of them too dark or saturated.
constexpr std::size_t kEnoughForGain = 500;
constexpr float kDarkest = 16, kBrightest = 240, kLargestGain = 2;

bool exposed(float value) { return value >= kDarkest && value <= kBrightest; }

float median_of(std::vector<float>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

Eigen::Vector3f rgb_of(const cv::Vec3b& bgr) {
  return {static_cast<float>(bgr[2]), static_cast<float>(bgr[1]), static_cast<float>(bgr[0])};
}

}  // namespace

void require_valid(const EvidenceOptions& options) {
  const bool valid = options.margin > 0 && options.margin_growth >= 0 && options.min_votes >= 1 &&
                     options.share > 0 && options.vacated >= 1;
  if (valid) return;
  throw Error("an option is out of range", "dense evidence",
              "margin > 0, margin_growth >= 0, min_votes >= 1, share > 0, vacated >= 1");
}

StaticGrid::StaticGrid(double edge, const EvidenceOptions& options, std::size_t expected)
    : edge_(edge), options_(options), index_(expected) {
  require_voxel_size(edge, "dense voxel size");
  require_valid(options);
  cells_.reserve(expected);
}

StaticGrid::PlacedView StaticGrid::placed_at(const DenseView& view,
                                             const Pose& T_world_camera) const {
  const Pose T_camera_world = T_world_camera.inverse();
  return {.view = &view,
          .R_world_camera = T_world_camera.rotation(),
          .t_world_camera = T_world_camera.translation(),
          .R_camera_world = T_camera_world.rotation().cast<float>(),
          .t_camera_world = T_camera_world.translation().cast<float>(),
          .number = static_cast<std::uint32_t>(placed_.size() + 1)};
}

void StaticGrid::add(const DenseView& view, const Pose& T_world_camera) {
  placed_.push_back(placed_at(view, T_world_camera));
  std::vector<std::size_t> known;
  for (const Block& block : blocks_) known.push_back(block.cells.size());
  insert(placed_.back());
  if (!options_.remove_ghosts) return;
  known.resize(blocks_.size(), 0);
  for (std::size_t b = 0; b < blocks_.size(); ++b) {
    const Block& block = blocks_[b];
    vote(placed_.back(), block, 0, known[b]);
    if (known[b] == block.cells.size()) continue;
    for (std::size_t i = 0; i + 1 < placed_.size(); ++i) {
      vote(placed_[i], block, known[b], block.cells.size());
    }
  }
}

// Whether there is surface where this point lies, or within its noise before or behind it.
bool StaticGrid::has_surface_near(const Eigen::Vector3d& p_world,
                                  const Eigen::Vector3d& ray) const {
  for (const int steps : {0, 1, -1, 2, -2}) {
    const auto voxel = voxel_at(p_world + steps * edge_ * ray, edge_);
    if (voxel && index_.find(*voxel) != kNone) return true;
  }
  return false;
}

News StaticGrid::news_in(const DenseView& view, const Pose& T_world_camera) const {
  constexpr int kStep = 3;  // pixels
  constexpr double kFarthest =
      2.5;  // beyond, pixels are farther apart than voxels, and noisier [m]
  const PlacedView placed = placed_at(view, T_world_camera);
  News news;
  for (int row = 0; row < view.depth.rows; row += kStep) {
    for (int col = 0; col < view.depth.cols; col += kStep) {
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      if (!view.is_static(row, col) || z > kFarthest) continue;
      const Eigen::Vector3d ray = placed.R_world_camera * view.camera.unproject(col, row, 1);
      ++news.looked_at;
      news.fresh += !has_surface_near(placed.t_world_camera + z * ray, ray);
    }
  }
  const Lens lens(view.camera);
  for (const Block& block : blocks_) {
    if (!may_see(placed, block)) continue;
    for (std::size_t i = 0; i < block.cells.size(); ++i) {
      news.refuted +=
          look(placed, lens, block.centers[i]) == Sight::kThrough && is_static(block.cells[i]);
    }
  }
  return news;
}

std::uint32_t StaticGrid::cell_of(const Eigen::Vector3d& p_world) {
  const std::optional<Voxel> voxel = voxel_at(p_world, edge_);
  if (!voxel) return kNone;
  const std::uint32_t cell = index_.add(*voxel);
  if (cell < cells_.size()) return cell;
  cells_.emplace_back();
  const double side = edge_ * kCellsPerBlock;
  const Voxel around = voxel_at(center_of(*voxel, edge_), side).value();
  const std::uint32_t block = block_index_.add(around);
  if (block == blocks_.size()) blocks_.push_back({center_of(around, side).cast<float>(), {}, {}});
  blocks_[block].cells.push_back(cell);
  blocks_[block].centers.push_back(center_of(*voxel, edge_).cast<float>());
  return cell;
}

// Per pixel, kNone where there is no static surface.
std::vector<std::uint32_t> StaticGrid::cells_under(const PlacedView& placed) {
  const DenseView& view = *placed.view;
  std::vector<std::uint32_t> cells(view.depth.total(), kNone);
  auto cell = cells.begin();
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col, ++cell) {
      if (!view.is_static(row, col)) continue;
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      *cell = cell_of(placed.R_world_camera * view.camera.unproject(col, row, z) +
                      placed.t_world_camera);
    }
  }
  return cells;
}

// The factors that make the view's colours those of the cells, medians of the ratios.
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
    gain[c] = std::clamp(median_of(values), 1 / kLargestGain, kLargestGain);
  }
  return gain;
}

void StaticGrid::insert(const PlacedView& placed) {
  const std::vector<std::uint32_t> cells = cells_under(placed);
  const Eigen::Vector3f gain = gain_for(*placed.view, cells);
  gains_.push_back(gain);
  const int cols = placed.view->depth.cols;
  for (int i = 0; i < static_cast<int>(cells.size()); ++i) {
    const std::uint32_t number = cells[static_cast<std::size_t>(i)];
    if (number != kNone) add_pixel(placed, i / cols, i % cols, gain, number);
  }
}

void StaticGrid::add_pixel(const PlacedView& placed, int row, int col, const Eigen::Vector3f& gain,
                           std::uint32_t number) {
  const DenseView& view = *placed.view;
  const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
  const Eigen::Vector3d p_world =
      placed.R_world_camera * view.camera.unproject(col, row, z) + placed.t_world_camera;
  const float weight = depth_weight(static_cast<float>(z));
  StaticCell& cell = cells_[number];
  cell.offset_sum += weight * (p_world - corner_of(index_.voxel(number), edge_)).cast<float>();
  cell.color_sum += weight * rgb_of(view.color(row, col)).cwiseProduct(gain).cwiseMin(255.0F);
  cell.weight += weight;
  ++cell.pixels;
  if (cell.last_view == placed.number) return;
  cell.last_view = placed.number;
  ++cell.views;
  cell.doubtful += view.kind(row, col) == kDoubtfulSurface;
  cell.free_since = 0;
}

bool StaticGrid::may_see(const PlacedView& placed, const Block& block) const {
  const float radius = static_cast<float>(edge_) * kCellsPerBlock * 0.87F;  // half a diagonal
  const Eigen::Vector3f p = placed.R_camera_world * block.center + placed.t_camera_world;
  if (p.z() < -radius) return false;
  const Camera& camera = placed.view->camera;
  const auto inside = [&](float x, double focal, double left, double right) {
    // Distances from the two planes through the image's borders.
    const auto a = static_cast<float>(left / focal), b = static_cast<float>(right / focal);
    return x + a * p.z() > -radius * std::sqrt(1 + a * a) &&
           b * p.z() - x > -radius * std::sqrt(1 + b * b);
  };
  return inside(p.x(), camera.fx, camera.cx, camera.width - camera.cx) &&
         inside(p.y(), camera.fy, camera.cy, camera.height - camera.cy);
}

StaticGrid::Sight StaticGrid::look(const PlacedView& placed, const Lens& lens,
                                   const Eigen::Vector3f& p_world) const {
  const DenseView& view = *placed.view;
  const Eigen::Vector3f p = placed.R_camera_world * p_world + placed.t_camera_world;
  if (p.z() < kNearest) return Sight::kNothing;
  const float scale = 1 / p.z();
  const float u = lens.fx * p.x() * scale + lens.cx, v = lens.fy * p.y() * scale + lens.cy;
  const auto right = static_cast<float>(view.depth.cols) - 1.5F;
  const auto bottom = static_cast<float>(view.depth.rows) - 1.5F;
  if (!(u >= 0.5F && v >= 0.5F && u < right && v < bottom)) return Sight::kNothing;

  const int col = static_cast<int>(u + 0.5F), row = static_cast<int>(v + 0.5F);
  const float z = view.depth(row, col) * DenseView::kDepthUnit;
  if (z <= 0 || z + slack(z) < p.z()) return Sight::kNothing;
  if (z - slack(z) <= p.z()) {
    return view.kind(row, col) == kMoverSurface ? Sight::kMover : Sight::kNothing;
  }
  // An edge or something thin may be half a pixel away: all nine around must agree.
  for (int r = row - 1; r <= row + 1; ++r) {
    for (int c = col - 1; c <= col + 1; ++c) {
      const float around = view.depth(r, c) * DenseView::kDepthUnit;
      if (around - slack(around) <= p.z()) return Sight::kNothing;
    }
  }
  return Sight::kThrough;
}

void StaticGrid::vote(const PlacedView& placed, const Block& block, std::size_t first,
                      std::size_t last) {
  if (first == last || !may_see(placed, block)) return;
  const Lens lens(placed.view->camera);
  for (std::size_t i = first; i < last; ++i) {
    const Sight sight = look(placed, lens, block.centers[i]);
    if (sight == Sight::kNothing) continue;
    StaticCell& cell = cells_[block.cells[i]];
    if (cell.last_view == placed.number) continue;  // it saw a static surface there itself
    if (sight == Sight::kMover) ++cell.movers;
    if (sight != Sight::kThrough) continue;
    ++cell.free;
    if (placed.number > cell.last_view) ++cell.free_since;
  }
}

bool StaticGrid::is_static(std::uint32_t number) const {
  if (!options_.remove_ghosts) return true;
  const StaticCell& cell = cells_[number];
  const int against = cell.free + cell.movers;
  const int votes = against + cell.views;
  const bool outvoted =
      against >= options_.min_votes && against >= options_.share * static_cast<double>(votes);
  return !outvoted && cell.free_since < options_.vacated;
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
  std::size_t bytes = index_.bytes() + cells_.capacity() * sizeof(StaticCell);
  for (const Block& block : blocks_) {
    bytes += sizeof(block) + block.cells.capacity() * sizeof(std::uint32_t);
  }
  return bytes;
}

}  // namespace stillmap
