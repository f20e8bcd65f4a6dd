// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/static_grid.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cstddef>
#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// Returns T_world_camera of a keyframe by its id, or none if it is unknown.
using PoseLookup = std::function<std::optional<Pose>(std::uint64_t)>;

/// The static map during the run, which rates the novelty of a frame. It has votes as the final
/// map, but voxels of twice the side and every second pixel, and only eight previous views vote on
/// the surfaces that a new one adds, so that the time per view does not grow with the map.
///
/// When the poses change (a loop was closed), the map is rebuilt: a few views with each call, those
/// near the camera first.
class LiveMap {
 public:
  /// @param voxel      side of the final map's voxels [m]
  /// @param max_voxels maximum number of voxels of the live map, above which their side is doubled
  LiveMap(double voxel, const EvidenceOptions& options, std::size_t max_voxels);

  /// Adds a view, or replaces that of the same id.
  void add(std::uint64_t id, std::shared_ptr<const DenseView> view, const Pose& T_world_camera);
  /// Removes a view, if it exists.
  void remove(std::uint64_t id);
  /// Drops a view, if it exists, without rebuilding the map: its votes stay until the next rebuild.
  void forget(std::uint64_t id);
  /// Returns the view of least id, other than `id`, from nearly the same viewpoint as view `id`:
  /// within 0.3 m and 15 degrees; none without one.
  std::optional<std::uint64_t> same_viewpoint_as(std::uint64_t id) const;

  /// Sets the present poses of `views`; views without a pose keep theirs. If one is new or has
  /// moved by more than `kReplacement`, the map is rebuilt.
  /// @returns whether it is rebuilt
  bool update_poses(const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views,
                    const PoseLookup& T_world_camera);

  /// Returns the change that a view would cause; Novelty::refuted_voxels counts voxels of the final
  /// map.
  Novelty novelty_of(const DenseView& view, const Pose& T_world_camera) const;

  std::size_t waiting() const { return waiting_.size(); }  ///< Number of views not placed yet.
  const StaticGrid& grid() const { return *grid_; }

  /// Returns the class of a voxel of the grid, 0 for none: that of most detections, weighted by
  /// their confidences, if these are enough for the number of views that saw it.
  std::uint16_t class_of(std::uint32_t cell) const;
  /// Returns the names of the classes 1, 2, 3 ... in the order of their first detections.
  const std::vector<std::string>& classes() const { return classes_; }

  /// Least sum of confidences per view that saw the voxel, as for the final map [0..1].
  static constexpr float kMinConfidence = 0.15F;

  /// Largest movement of a point two meters ahead of a view without a rebuild [m].
  static constexpr double kReplacement = 0.015;
  /// Number of views that each call of add() or update_poses() places.
  static constexpr std::size_t kAtOnce = 8;

 private:
  struct Entry {
    std::shared_ptr<const DenseView> view;
    Pose T_world_camera;
  };
  /// The class that leads in a voxel, and its lead (majority vote of Boyer and Moore, 1981).
  struct ClassVotes {
    std::uint16_t leader = 0;  // 0: none
    float lead = 0;
    std::uint32_t last_view = 0;  // newest view with a vote, from 1 on
  };

  void rebuild();
  void place(const Entry& entry);
  void place_some();
  void vote_on_classes(const DenseView& view, const Pose& T_world_camera);
  std::uint16_t number_of(const std::string& class_name);

  double edge_;
  EvidenceOptions options_;
  std::size_t max_voxels_;
  std::map<std::uint64_t, Entry> views_;
  std::vector<std::uint64_t> waiting_;  // in reverse order
  std::deque<DenseView> newest_;  // the newest views in the grid, of its resolution, which vote
  std::unique_ptr<StaticGrid> grid_;
  std::vector<ClassVotes> class_votes_;  // by voxel of the grid, as far as there are any
  std::uint32_t voting_views_ = 0;       // number of views with votes on classes
  std::vector<std::string> classes_;
};

}  // namespace stillmap
