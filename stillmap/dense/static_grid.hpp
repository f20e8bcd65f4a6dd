// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/depth_weight.hpp"
#include "stillmap/dense/placed_view.hpp"
#include "stillmap/dense/voxel_index.hpp"
#include "stillmap/geometry/pose.hpp"

#include <array>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// When what keyframes saw speaks against a voxel of the static map, and when that is enough.
struct EvidenceOptions {
  bool remove_ghosts = true;  ///< false: everything that any keyframe saw stays, as in the papers
  int min_votes = 2;          ///< keyframes that must speak against a voxel to remove it
};

/// What a voxel of the static map is made of, and what is known for and against it.
struct StaticCell {
  Eigen::Vector3f offset_sum = Eigen::Vector3f::Zero();  ///< weighted, from the lower corner [m]
  Eigen::Vector3f color_sum = Eigen::Vector3f::Zero();   ///< weighted, R G B
  float weight = 0;
  std::uint32_t last_view = 0;   ///< the newest view with a static surface in it, counted from 1
  std::uint16_t pixels = 0;      ///< that fell into it, at most 65535
  std::uint16_t views = 0;       ///< with a static surface in it
  std::uint16_t free = 0;        ///< views that saw through it
  std::uint16_t free_since = 0;  ///< of these, after `last_view`
  std::uint16_t movers = 0;      ///< views with a mover's surface in it
  std::uint16_t doubtful = 0;    ///< of `views`, those that saw a mover right beside it
};

/// What a view would tell a grid that it does not hold yet.
struct News {
  std::size_t looked_at = 0;  ///< pixels with a static surface near enough to be judged
  std::size_t fresh = 0;      ///< of these, where the grid has no surface
  std::size_t refuted = 0;    ///< voxels of the static map that the view sees through
};

/// The static surface in voxels, with votes for and against each: every keyframe either hits a
/// voxel, sees through it (free space: whatever was seen there by another keyframe was not there
/// then), finds a mover's surface in it, or says nothing (it is hidden, out of view, or there is no
/// depth). Each pair of voxel and keyframe is looked at once, whichever came first, so what is
/// hidden behind people is filled in later, and a ghost that a mask missed is removed by keyframes
/// before it as well as after.
///
/// Positions and colors are means weighted by 1 / sigma^2 of the depth (DepthWeight). Colors of
/// each view are scaled to those that are there already (automatic exposure and white balance
/// change them), by the median ratio per channel.
///
/// The result depends on the views, their poses and their order. One thread at a time.
class StaticGrid {
 public:
  static constexpr std::uint32_t kAll = 0xffffffff;

  /// @param edge   side of a voxel [m]
  /// @param elders how many of the views before a new one vote on the cells that it adds: the
  ///               newest of them
  /// Throws Error if `edge` or an option is out of range.
  explicit StaticGrid(double edge, const EvidenceOptions& options = {},
                      std::uint32_t elders = kAll);

  /// Adds what a keyframe saw. The view must outlive the grid.
  void add(const DenseView& view, const Pose& T_world_camera);

  /// Fills in what no view has placed with the far surfaces of all of them (kFarSurface). A far
  /// pixel counts where its ray meets no static surface within its noise; it joins the cell of
  /// another view's that its ray meets there, so that what lies scattered along the rays becomes
  /// one surface, and every view votes on it as on any other. Once, after the last add().
  void fill_far();

  /// What add() with this view would change.
  News news_in(const DenseView& view, const Pose& T_world_camera) const;

  double edge() const { return edge_; }
  const VoxelIndex& index() const { return index_; }
  const StaticCell& cell(std::uint32_t number) const { return cells_[number]; }
  /// Whether what speaks against a voxel is not enough.
  bool is_static(std::uint32_t number) const { return is_static(cells_[number]); }
  /// Whether nothing but far pixels tells of it.
  bool is_far(std::uint32_t number) const { return number >= first_far_; }
  /// Whether somebody else than a view that saw a mover right beside it saw it too, or its
  /// neighborhood of two voxels.
  bool is_confirmed(std::uint32_t number) const;
  Eigen::Vector3f mean(std::uint32_t number) const;  ///< world frame [m]
  Rgb color(std::uint32_t number) const;
  /// Views added so far, and the factors that their colors were scaled with, R G B.
  const std::vector<Eigen::Vector3f>& gains() const { return gains_; }
  std::size_t bytes() const;

 private:
  /// A view, and where the voxels of a block lie as seen from it.
  struct Witness {
    PlacedView placed;
    DepthWeight weight;                                      // of its pixels
    std::array<Eigen::Vector3f, VoxelIndex::kPlaces> steps;  // from the block's middle to each
  };
  /// A cube of blocks: views that do not reach it need not be asked about each.
  struct Region {
    Eigen::Vector3f center;  // world frame
    std::vector<std::uint32_t> blocks;
  };
  bool is_static(const StaticCell& cell) const;
  /// Numbers of cells, or of views, from `first` on, and before `last`.
  struct Range {
    std::uint32_t first, last;
  };

  bool has_surface_near(const Eigen::Vector3d& p_world, const Eigen::Vector3d& ray) const;
  Witness witness(const DenseView& view, const Pose& T_world_camera) const;
  std::size_t refuted_in(const Witness& witness, std::uint32_t block) const;
  std::vector<std::uint32_t> cells_under(const PlacedView& placed);
  std::uint32_t cell_of(const Eigen::Vector3d& p_world);
  void insert(const PlacedView& placed);
  void add_pixel(std::uint32_t view, int row, int col, std::uint32_t number);
  void fill_far(std::uint32_t view, const VoxelIndex& settled);
  std::uint32_t far_cell(const PlacedView& placed, int row, int col, const VoxelIndex& settled);
  VoxelIndex settled_space() const;
  Eigen::Vector3f gain_for(const DenseView& view, const std::vector<std::uint32_t>& cells) const;
  void enter_block(const VoxelIndex::Block& block);
  std::vector<std::uint32_t> blocks_of(Range cells) const;
  std::vector<std::uint32_t> blocks_in_reach(const PlacedView& placed) const;
  bool reaches(const PlacedView& placed, const Region& region) const;
  void vote_on_new(Range views, Range cells);
  void vote(std::uint32_t view, std::uint32_t block, Range cells);
  void count(Sight sight, std::uint32_t view, StaticCell& cell) const;
  float block_radius() const;
  std::uint32_t newest_view() const { return static_cast<std::uint32_t>(witnesses_.size()); }

  double edge_;
  EvidenceOptions options_;
  std::uint32_t elders_;
  VoxelIndex index_;
  std::uint32_t first_far_ = kAll;
  std::deque<StaticCell> cells_;
  std::vector<Eigen::Vector3f> block_centers_;  // world frame
  VoxelIndex region_index_;
  std::vector<Region> regions_;
  std::vector<std::uint32_t> region_of_block_;
  std::vector<Witness> witnesses_;
  std::vector<Eigen::Vector3f> gains_;
};

}  // namespace stillmap
