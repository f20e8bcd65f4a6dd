// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/live_map.hpp"
#include "stillmap/dense/mesh_options.hpp"
#include "stillmap/dense/occupancy_options.hpp"
#include "stillmap/dense/outlier_removal.hpp"
#include "stillmap/dense/semantic_map.hpp"
#include "stillmap/dense/static_grid.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// The static dense cloud: what is kept of each keyframe, and of all together.
struct DenseOptions {
  BackProjectionOptions back_projection;
  OutlierOptions outliers;
  FarOptions far;
  EvidenceOptions evidence;
  SemanticOptions semantics;
  MeshOptions mesh;
  OccupancyOptions occupancy;
  /// Classes whose instances are kept out, whether they move at the moment or not: people who sit
  /// still get up some time. "unknown" is what a folder of masks calls the things in it.
  std::vector<std::string> movers = {"person", "unknown", "bird", "cat", "dog", "horse"};
  double voxel = 0.01;    ///< side of the voxels of the composed cloud [m]
  int min_keyframes = 1;  ///< voxels of the composed cloud seen by fewer keyframes are dropped
  int every = 15;         ///< frames after which one that is no keyframe is looked at too; 0: never
  /// Pixels kept over all keyframes, six bytes each; beyond, views are thinned. 24 million are 300
  /// keyframes of 640 x 480 at stride 2.
  int max_pixels = 24000000;
  /// Voxels kept, about seventy bytes each while the cloud is made; where there would be more, all
  /// have twice the side.
  int max_voxels = 6000000;
};

/// What a DenseMap holds and what it had to leave out, since it was made.
struct DenseStatistics {
  std::size_t keyframes = 0;  ///< held now
  std::size_t pixels = 0;     ///< held now, over all keyframes
  std::size_t outliers = 0;   ///< points dropped by the outlier removal so far
  std::size_t thinnings =
      0;  ///< how often a keyframe's view was made coarser to stay below max_pixels
  std::size_t replacements = 0;  ///< how often poses changed so much that the live map began anew
};

/// Views put together with one set of poses.
struct PlacedMap {
  std::shared_ptr<const StaticGrid> grid;
  std::vector<ViewAtPlace> views;    ///< those with a pose, in the order of their ids
  std::vector<std::uint32_t> cells;  ///< voxels of the grid that are in the cloud, in its order
  std::vector<std::shared_ptr<const DenseView>> held;  ///< keeps the views
  std::size_t keyframes_left_out = 0;
  std::size_t voxels_left_out = 0, voxels_removed = 0;
};

/// A cloud, and what it was made of.
struct ComposedCloud {
  Cloud cloud;                         ///< world frame [m], ordered by voxel: x, then y, then z
  SemanticMap semantics;               ///< the things in it; empty where no network looked
  std::size_t keyframes = 0;           ///< that went in
  std::size_t keyframes_left_out = 0;  ///< whose pose was unknown or not finite
  std::size_t voxels_left_out = 0;     ///< below min_samples or min_keyframes
  std::size_t voxels_removed = 0;      ///< ghosts: what other keyframes saw speaks against them
};

/// Looks poses up in a table, which must outlive it.
PoseLookup pose_lookup(const std::map<std::uint64_t, Pose>& poses);

/// The static dense map as in SLAM3-YOLOv8, and beyond it: per keyframe a view without moving
/// pixels and outliers, kept in the camera frame; put together with the poses as they are known,
/// reduced by a voxel filter over the whole, and cleared of what other keyframes contradict.
///
/// place() does this from scratch, and depends only on the set of keyframes held and the poses
/// (and, once max_pixels has been exceeded, on the order they came in). Meanwhile a coarser live
/// map tells which frames are worth keeping.
///
/// Synchronous: one thread at a time, none inside.
class DenseMap {
 public:
  /// Throws Error if an option is out of range.
  explicit DenseMap(const Camera& camera, const DenseOptions& options = {});

  /// Takes what a keyframe saw; an id that is held already is replaced.
  /// @param movers pixels of things that move or may (not zero), height x width; empty for none
  /// @param things static things that a network found in the frame; null for none
  /// @param T_world_camera as far as is known now, for the live map; none: it does without
  /// Throws Error, with the map unchanged, if frame, mask and camera do not fit together.
  void add(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
           const std::optional<Pose>& T_world_camera = std::nullopt,
           const SegmentedFrame* things = nullptr);

  /// Takes a view that was made before, likewise.
  void add(std::uint64_t id, DenseView view,
           const std::optional<Pose>& T_world_camera = std::nullopt);
  /// The same for a frame that is no keyframe: kept if it tells enough that is new, measured by the
  /// live map (see DenseOptions::min_news). So the places behind people get filled, ghosts get
  /// voted on, and nothing grows where all is known.
  /// @returns whether it was kept
  bool add_if_new(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
                  const Pose& T_world_camera, const SegmentedFrame* things = nullptr);

  /// Forgets a keyframe. One that is not held is no error. A culled keyframe need not be removed:
  /// its view stays useful as long as the caller can still tell its pose.
  void remove(std::uint64_t id);

  /// Tells the live map where keyframes are now; see LiveMap::follow().
  void follow(const PoseLookup& T_world_camera);

  /// Begins the live map anew: poses from now on are in a world of their own. The views stay.
  void leave_world();

  /// Fuses all views in the world frame, as input for cloud_of(), meshes and grids. Keyframes
  /// without a pose are left out and counted.
  PlacedMap place(const PoseLookup& T_world_camera) const;

  /// The views held, by id.
  const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views() const { return views_; }
  const DenseOptions& options() const { return options_; }
  DenseStatistics statistics() const;
  const LiveMap& live() const { return *live_; }
  /// Memory held by the views and the live map.
  std::size_t bytes() const;

 private:
  void thin_to_bound();
  std::shared_ptr<const StaticGrid> grid_of(const std::vector<ViewAtPlace>& views) const;

  Camera camera_;
  DenseOptions options_;
  std::map<std::uint64_t, std::shared_ptr<DenseView>> views_;
  std::unique_ptr<LiveMap> live_;
  std::size_t pixels_ = 0, outliers_ = 0, thinnings_ = 0, replacements_ = 0;
};

/// All that the views of a placed map saw, what moves too, a point per voxel of its grid: what
/// there would be without masks and votes, to be looked at beside it.
Cloud raw_cloud(const PlacedMap& placed);

/// The cloud of a placed map, with the things in it.
ComposedCloud cloud_of(const PlacedMap& placed, const SemanticOptions& options);

}  // namespace stillmap
