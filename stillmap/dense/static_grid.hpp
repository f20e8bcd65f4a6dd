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
#include <functional>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Removal of voxels of the static map.
struct EvidenceOptions {
  bool remove_ghosts = true;  ///< Whether votes remove voxels; the papers keep all of them.
  /// Whether surfaces are continued between neighboring pixels that are voxels apart.
  bool interpolate = true;
};

/// The surface in a voxel of the static map, and the votes on it.
struct StaticCell {
  Eigen::Vector3f offset_sum = Eigen::Vector3f::Zero();  ///< Weighted, from the lower corner [m].
  Eigen::Vector3f color_sum = Eigen::Vector3f::Zero();   ///< Weighted, R G B.
  float weight = 0;
  std::uint32_t last_view = 0;   ///< Newest view with a static surface in it, counted from 1.
  std::uint16_t views = 0;       ///< Number of views with a static surface in it.
  std::uint16_t free = 0;        ///< Number of views that saw through it.
  std::uint16_t free_since = 0;  ///< Number of views that saw through it after `last_view`.
  std::uint16_t movers = 0;      ///< Number of views with a mover's surface in it.
  std::uint16_t doubtful = 0;    ///< Number of `views` with a mover next to it.
  std::uint16_t visit = 0;       ///< Newest visit with a static surface in it.
  std::uint16_t free_visit = 0;  ///< Newest visit that saw through it.
  std::uint16_t free_then = 0;   ///< Number of views of that visit that saw through it.
};

/// The change of a grid that a new view would cause.
struct Novelty {
  std::size_t pixels_examined = 0;  ///< Number of pixels with a static surface within range.
  std::size_t new_pixels = 0;       ///< Number of these without a surface in the grid.
  std::size_t refuted_voxels = 0;   ///< Number of static voxels that the view sees through.
};

/// The static surface in voxels, with votes for and against each: every keyframe has a surface in a
/// voxel, sees through it (free space: surfaces of other keyframes there have moved), has a mover's
/// surface in it, or has no vote (the voxel is occluded or out of view, or there is no depth). Each
/// pair of voxel and keyframe is processed once in either order, so surfaces behind people are
/// added later, and a ghost without a mask is removed by earlier as well as later keyframes.
///
/// Views of a visit (DenseView::visit) do not vote on surfaces that a later visit shows, as these
/// may have appeared since.
///
/// Positions and colors are means weighted by 1 / sigma^2 of the depth (DepthWeight). The colors of
/// each view are scaled to those of the grid by the median ratio per channel, as automatic exposure
/// and white balance change them.
///
/// The result depends on the views, their poses and their order. One thread at a time.
class StaticGrid {
 public:
  static constexpr std::uint32_t kAll = 0xffffffff;

  /// @param edge   side of a voxel [m]
  /// @param previous_views number of views before a new one that vote on the cells that it adds
  /// @param threads number of threads that vote
  /// Throws Error if `edge` or an option is out of range.
  explicit StaticGrid(double edge, const EvidenceOptions& options = {},
                      std::uint32_t previous_views = kAll, int threads = 1);

  /// Adds a keyframe's view, which must outlive the grid, or at least the next `previous_views`
  /// calls. Its pages are dropped after every use.
  void add(const DenseView& view, const Pose& T_world_camera);

  /// Adds the far surfaces of all views (kFarSurface) where the grid has no surface. A far pixel is
  /// used if its ray meets no static surface within its noise; it joins the cell of another view on
  /// its ray, so that scattered points become one surface, and every view votes on it as on any
  /// other. Call it once, after the last add().
  void fill_far();

  /// Returns the change that add() of this view would cause.
  Novelty novelty_of(const DenseView& view, const Pose& T_world_camera) const;

  double edge() const { return edge_; }
  const VoxelIndex& index() const { return index_; }
  const StaticCell& cell(std::uint32_t number) const { return cells_[number]; }
  /// Returns whether the votes against a voxel do not suffice to remove it.
  bool is_static(std::uint32_t number) const { return is_static(cells_[number]); }
  /// Returns whether a voxel consists of far pixels only.
  bool is_far(std::uint32_t number) const { return number >= first_far_; }
  /// Returns the wanted cell of a far surface nearest to a pixel on its ray, within the noise of
  /// its depth; VoxelIndex::kNone without one.
  std::uint32_t far_cell_on_ray(const PlacedView& placed, int row, int col,
                                const std::function<bool(std::uint32_t cell)>& is_wanted) const;
  /// Returns whether a second view has a surface in a voxel, or in its neighborhood of two voxels,
  /// if the first one has a mover next to it.
  bool is_confirmed(std::uint32_t number) const;
  Eigen::Vector3f mean(std::uint32_t number) const;  ///< World frame [m].
  Rgb color(std::uint32_t number) const;
  /// Returns the factors of the views' colors, R G B, one per added view.
  const std::vector<Eigen::Vector3f>& gains() const { return gains_; }

 private:
  /// A view, and the positions of the voxels of a block in its camera frame.
  struct VotingView {
    PlacedView placed;
    DepthWeight weight;                                      // of its pixels
    std::array<Eigen::Vector3f, VoxelIndex::kPlaces> steps;  // from the block's center [m]
  };
  /// A cube of blocks, which are skipped together by views that do not reach it.
  struct Region {
    Eigen::Vector3f center;  // world frame
    std::vector<std::uint32_t> blocks;
  };
  /// A point of a static surface that a view shows.
  struct Sample {
    Eigen::Vector3d p_world;
    Eigen::Vector3f color;  // R G B of the view
    float weight;
    bool doubtful;
  };
  bool is_static(const StaticCell& cell) const;
  /// Numbers of cells or views from `first` to `last`, without `last`.
  struct Range {
    std::uint32_t first, last;
  };

  bool has_surface_near(const Eigen::Vector3d& p_world, const Eigen::Vector3d& ray,
                        double reach) const;
  VotingView voting_view(const DenseView& view, const Pose& T_world_camera) const;
  std::size_t refuted_in(const VotingView& voting_view, std::uint32_t block) const;
  std::vector<std::uint32_t> cells_under(const PlacedView& placed);
  std::uint32_t cell_of(const Eigen::Vector3d& p_world);
  void insert(const PlacedView& placed);
  static Sample sample_at(const VotingView& voter, int row, int col);
  static Sample mixed(const Sample& a, const Sample& b, double share_of_b);
  void add(const Sample& sample, std::uint32_t view, std::uint32_t number);
  void add_between(const VotingView& voter);
  void fill_far(std::uint32_t view, const VoxelIndex& near_surfaces);
  std::optional<Voxel> far_voxel(const Eigen::Vector3d& p_world) const;
  std::uint32_t far_cell(const PlacedView& placed, int row, int col,
                         const VoxelIndex& near_surfaces);
  VoxelIndex find_near_surfaces() const;
  Eigen::Vector3f gain_for(const DenseView& view, const std::vector<std::uint32_t>& cells) const;
  void add_block(const VoxelIndex::Block& block);
  std::vector<std::uint32_t> blocks_of(Range cells) const;
  std::vector<std::uint32_t> blocks_in_reach(const PlacedView& placed) const;
  bool reaches(const PlacedView& placed, const Region& region) const;
  void vote_on_new(Range views, Range cells);
  void drop_pages(Range views) const;
  void vote(std::uint32_t view, std::uint32_t block, Range cells);
  void count(VoxelVote vote, std::uint32_t view, StaticCell& cell) const;
  void begin_visit(std::uint16_t visit, StaticCell& cell) const;
  std::uint16_t visit_of(std::uint32_t view) const {
    return voting_views_[view - 1].placed.view().visit;
  }
  float block_radius() const;
  std::uint32_t newest_view() const { return static_cast<std::uint32_t>(voting_views_.size()); }

  double edge_;
  EvidenceOptions options_;
  int threads_;
  std::uint32_t previous_views_;
  VoxelIndex index_;
  std::uint32_t first_far_ = kAll;
  std::deque<StaticCell> cells_;
  std::vector<Eigen::Vector3f> block_centers_;  // world frame
  VoxelIndex region_index_;
  std::vector<Region> regions_;
  std::vector<std::uint32_t> region_of_block_;
  std::vector<VotingView> voting_views_;
  std::vector<Eigen::Vector3f> gains_;
};

}  // namespace stillmap
