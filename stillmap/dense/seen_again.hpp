// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/placed_view.hpp"
#include "stillmap/dense/semantic_map.hpp"

#include <cstddef>
#include <vector>

namespace stillmap {

/// A view without what is there no longer.
struct RestOfView {
  DenseView view;
  std::size_t surfaces = 0;  ///< Number of pixels whose surface hardly any newer view shows.
};

/// The newest views of a map, for what earlier ones show at the same place.
class NewerViews {
 public:
  /// Adds a view, which must outlive the object.
  /// @param refutes whether what it sees through is no longer there
  void add(const PosedView& view, bool refutes);

  /// Returns a view without the pixels whose points at least `kRefuting` newer views see through.
  /// Of the others, those count as new that fewer than `kEnough` newer views show, from no more
  /// than one and a half times the distance.
  RestOfView rest_of(const PosedView& earlier) const;

  static constexpr int kEnough = 3, kRefuting = 2;

 private:
  struct Newer {
    PlacedView view;
    Pose T_world_camera;
    bool refutes;
  };
  std::vector<Newer> newer_;
};

}  // namespace stillmap
