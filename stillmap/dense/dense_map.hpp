// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/live_map.hpp"
#include "stillmap/dense/mesh_options.hpp"
#include "stillmap/dense/occupancy_options.hpp"
#include "stillmap/dense/outlier_removal.hpp"
#include "stillmap/dense/registration.hpp"
#include "stillmap/dense/seen_again.hpp"
#include "stillmap/dense/semantic_map.hpp"
#include "stillmap/dense/static_grid.hpp"
#include "stillmap/dense/view_pager.hpp"
#include "stillmap/geometry/camera.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cstddef>
#include <cstdint>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// The static dense map: the view of each keyframe, and the cloud of all views.
struct DenseOptions {
  BackProjectionOptions back_projection;
  OutlierOptions outliers = {.neighbors = 0};  ///< Off: the votes of the views replace it.
  FarOptions far;
  EvidenceOptions evidence;
  bool registration = false;  ///< Whether place() corrects the poses by registered().
  MeshOptions mesh;
  OccupancyOptions occupancy;
  /// Classes whose instances are left out even while they are still, such as people who sit.
  /// "unknown" is the class of the objects in a folder of masks.
  std::vector<std::string> movers = {"person", "unknown", "bird", "cat", "dog", "horse"};
  double voxel = 0.01;    ///< Side of the voxels of the composed cloud [m].
  int min_keyframes = 1;  ///< Minimum number of keyframes with a surface in a voxel of the cloud.
  int every = 15;         ///< Interval of the frames tested by add_if_new() [frames]; 0 for none.
  bool fuse = true;       ///< Whether depths are averaged, over frames and over views.
  /// Number of pixels of all views above which a new view replaces the oldest one from nearly the
  /// same viewpoint, so that the map does not grow while the camera stays in one place: 12 million
  /// are 150 views of 640 x 480 pixels at stride 2.
  int many_pixels = 12000000;
  MemoryLimit memory;  ///< Has no effect on the map.
  /// Maximum number of voxels, about seventy bytes each while the cloud is made, above which their
  /// side is doubled.
  int max_voxels = 6000000;
};

/// Contents of a DenseMap, and its losses since it was made.
struct DenseStatistics {
  std::size_t keyframes = 0;        ///< Number of keyframes.
  std::size_t pixels = 0;           ///< Number of pixels of all keyframes.
  std::size_t outliers = 0;         ///< Number of points dropped by the outlier removal so far.
  std::size_t bytes_in_memory = 0;  ///< Memory of the views' pixels [bytes].
  std::size_t views_on_disk = 0;    ///< Number of views whose pixels are in a file.
  std::size_t superseded = 0;    ///< Number of views dropped for newer ones of the same viewpoint.
  std::size_t replacements = 0;  ///< Number of rebuilds of the live map after changes of poses.
};

/// The views fused with one set of poses.
struct PlacedMap {
  std::shared_ptr<const StaticGrid> grid;
  std::vector<PosedView> views;         ///< Views with a pose, in the order of their ids.
  std::vector<std::uint32_t> cells;     ///< Voxels of the grid in the cloud, in its order.
  std::vector<Eigen::Vector3f> points;  ///< Their points on the surface, world frame [m].
  std::vector<Eigen::Vector3f> gains;   ///< Factors of the colors of each view, by color_gains().
  std::vector<std::shared_ptr<const DenseView>> held;  ///< Owners of the views.
  std::size_t keyframes_left_out = 0;  ///< Number of views whose pose is unknown or not finite.
  std::size_t voxels_left_out = 0;     ///< Number of voxels below min_keyframes.
  std::size_t voxels_removed = 0;      ///< Number of voxels removed by votes: ghosts.
};

/// A cloud with its objects and counts, which are those of PlacedMap.
struct ComposedCloud {
  Cloud cloud;            ///< World frame [m], ordered by voxel: x, then y, then z.
  SemanticMap semantics;  ///< Objects in the cloud; empty without a network.
  std::size_t keyframes = 0, keyframes_left_out = 0;
  std::size_t voxels_left_out = 0, voxels_removed = 0;
};

class OpenView;

/// Returns a lookup of poses in a table, which must outlive it.
PoseLookup pose_lookup(const std::map<std::uint64_t, Pose>& poses);

/// The static dense map as in SLAM3-YOLOv8 with additions: per keyframe a view without moving
/// pixels and outliers in the camera frame. The views are fused with given poses, reduced by a
/// voxel filter, and cleared of surfaces that the votes of other keyframes refute.
///
/// place() does this from scratch, and depends only on the keyframes and the poses. A coarser live
/// map decides which frames between keyframes are kept.
///
/// The oldest views beyond DenseOptions::memory are kept in a file: every pass over the views reads
/// them from there, one after the other.
///
/// With DenseOptions::fuse, the depths of the frames given to fuse() are averaged in the newest
/// view (OpenView), and place() averages the depths of neighboring views (fused_views()).
///
/// Synchronous: one thread at a time, none inside.
class DenseMap {
 public:
  /// Throws Error if an option is out of range.
  explicit DenseMap(const Camera& camera, const DenseOptions& options = {});
  DenseMap(DenseMap&&) noexcept;
  DenseMap& operator=(DenseMap&&) noexcept;
  ~DenseMap();

  /// Adds a keyframe, or replaces that of the same id.
  /// @param movers pixels of objects that move or may move (not zero), height x width; empty for
  ///   none
  /// @param objects static objects that a network detected in the frame; null for none
  /// @param T_world_camera present pose for the live map; without it, the view is not in that map
  /// Throws Error, with the map unchanged, if frame, mask and camera do not fit together.
  void add(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
           const std::optional<Pose>& T_world_camera = std::nullopt,
           const SegmentedFrame* objects = nullptr);

  /// Adds a given view, or replaces that of the same id.
  void add(std::uint64_t id, DenseView view,
           const std::optional<Pose>& T_world_camera = std::nullopt);
  /// Adds a frame that is no keyframe if the live map finds enough novelty in it, so that surfaces
  /// behind people are added, ghosts get votes, and known places do not grow.
  /// @returns whether it was added
  bool add_if_new(std::uint64_t id, const RgbdFrame& frame, const cv::Mat1b& movers,
                  const Pose& T_world_camera, const SegmentedFrame* objects = nullptr);

  /// Adds the depth of a frame to the averages in the newest view; no effect without one.
  void fuse(const RgbdFrame& frame, const cv::Mat1b& movers, const Pose& T_world_camera);
  /// Replaces the depths of the newest view by their averages. Until then it has the depths of its
  /// own frame only.
  void close_view();
  /// Returns the id of the view in which depths are averaged; none without one.
  std::optional<std::uint64_t> open_view() const;

  /// Removes a keyframe, if it exists. A culled keyframe need not be removed: its view stays useful
  /// as long as its pose is known.
  void remove(std::uint64_t id);

  /// Removes from the views of smaller ids than `first`, which earlier visits made, what views from
  /// `first` on see through, and the views of which hardly anything is left that enough newer ones
  /// do not show (NewerViews), so that the map of a place does not grow with the visits. Without a
  /// view from `first` on nothing changes.
  void replace_seen_again(std::uint64_t first, const PoseLookup& T_world_camera);

  /// Moves the views of the live map to their present poses; see LiveMap::update_poses().
  void update_poses(const PoseLookup& T_world_camera);

  /// Clears the live map, as the following poses are in a new world. The views stay.
  void start_new_world();

  /// Returns all views fused in the world frame, as input for cloud_of(), meshes and grids.
  /// Keyframes without a pose are left out and counted.
  PlacedMap place(const PoseLookup& T_world_camera) const;

  /// Returns the views by id.
  const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views() const { return views_; }
  const DenseOptions& options() const { return options_; }
  DenseStatistics statistics() const;
  const LiveMap& live() const { return *live_; }

 private:
  void replace_same_viewpoint(std::uint64_t id);
  /// Replaces a view by its rest, if that is worth it; otherwise removes it and returns false.
  bool keep_rest(std::uint64_t id, RestOfView rest);
  using Views = std::map<std::uint64_t, std::shared_ptr<DenseView>>;
  void erase(Views::iterator view);
  void page_out_oldest();
  void add(std::uint64_t id, MadeView made, const RgbdFrame& frame,
           const std::optional<Pose>& T_world_camera);
  void open(std::uint64_t id, const Pose& T_world_camera);
  std::shared_ptr<const StaticGrid> grid_of(const std::vector<PosedView>& views) const;

  Camera camera_;
  DenseOptions options_;
  Views views_;
  ViewPager pager_;
  std::set<std::uint64_t> in_memory_;  // views whose pixels are in memory
  std::size_t bytes_in_memory_ = 0;    // of their pixels
  std::unique_ptr<LiveMap> live_;
  /// The newest view while depths are averaged in it.
  struct Newest {
    std::uint64_t id;
    Pose T_world_camera;
    std::unique_ptr<OpenView> depths;
  };
  std::optional<Newest> newest_;
  std::size_t pixels_ = 0, outliers_ = 0, superseded_ = 0, replacements_ = 0;
};

/// Returns the cloud of all surfaces in the views of a placed map, moving ones included, one point
/// per voxel of its grid: the result without masks and votes, for comparison.
Cloud raw_cloud(const PlacedMap& placed);

/// Returns the cloud of a placed map with its objects.
ComposedCloud cloud_of(const PlacedMap& placed);

}  // namespace stillmap
