// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/static_grid.hpp"
#include "stillmap/geometry/pose.hpp"

#include <cstddef>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <vector>

namespace stillmap {

/// T_world_camera of a keyframe by its id; nothing where it is not known any more.
using PoseLookup = std::function<std::optional<Pose>(std::uint64_t)>;

/// The static map while the camera goes on: what a frame is held against to see whether it tells
/// anything new. Votes as in the final map, on voxels of twice the side and every second pixel, and
/// on what a new view adds only those of the eight before it: so a view costs as much in a large
/// map as in a small one.
///
/// When the poses change (a loop was closed), all is placed anew: a few views with each call, those
/// near the camera first, so that nobody ever waits for all of them.
class LiveMap {
 public:
  /// @param voxel      side of the final map's voxels [m]
  /// @param max_voxels beyond, the side of the live map's own is doubled
  LiveMap(double voxel, const EvidenceOptions& options, std::size_t max_voxels);

  /// Takes a view; an id that is held already is replaced.
  void add(std::uint64_t id, std::shared_ptr<const DenseView> view, const Pose& T_world_camera);
  /// Forgets a view; one that is not held is no error.
  void remove(std::uint64_t id);

  /// Tells where `views` are now; those that no pose is told of stay where they are, if anywhere.
  /// If one has moved by more than `kReplacement`, or was not held yet, all is placed anew.
  /// @returns whether it is
  bool follow(const std::map<std::uint64_t, std::shared_ptr<DenseView>>& views,
              const PoseLookup& T_world_camera);

  /// What a view would change. News::refuted in voxels of the final map.
  News news_in(const DenseView& view, const Pose& T_world_camera) const;

  std::size_t waiting() const { return waiting_.size(); }  ///< views to be placed anew still
  const StaticGrid& grid() const { return *grid_; }
  std::size_t bytes() const;

  /// How far a point two meters ahead of a view may move before it is followed [m].
  static constexpr double kReplacement = 0.015;
  /// Views that are placed anew with each call of add() or follow().
  static constexpr std::size_t kAtOnce = 8;

 private:
  struct Held {
    std::shared_ptr<const DenseView> view;
    Pose T_world_camera;
    DenseView coarse;  // what the grid looks at; empty until it is placed
  };

  void begin_anew();
  void place(Held& held);
  void place_some();

  double edge_;
  EvidenceOptions options_;
  std::size_t max_voxels_;
  std::map<std::uint64_t, Held> views_;
  std::vector<std::uint64_t> waiting_;  // the next one last
  std::unique_ptr<StaticGrid> grid_;
};

}  // namespace stillmap
