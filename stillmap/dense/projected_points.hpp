// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"

#include <cstdint>
#include <optional>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// A point in an image, between four pixels.
struct ProjectedPoint {
  int row, col;       ///< The upper left pixel.
  float right, down;  ///< Distances from it [pixels].
  float z;            ///< Depth [m].

  /// Returns the weight of a pixel by bilinear interpolation: 0 upper left, 1 upper right, 2 lower
  /// left, 3 lower right.
  float share(int pixel) const {
    return (pixel % 2 != 0 ? right : 1 - right) * (pixel / 2 != 0 ? down : 1 - down);
  }
};

/// The camera of a view, for points of the world.
class ViewProjection {
 public:
  /// @param margin  width of a border around the image, whose points are drawn to it [pixels]
  explicit ViewProjection(const PosedView& posed, float margin = 0);

  /// Returns the point in the image, or none. World frame [m].
  std::optional<ProjectedPoint> operator()(const Eigen::Vector3f& p_world) const;
  /// Returns whether points of a ball may be in the image. World frame [m].
  bool reaches(const Eigen::Vector3f& center, float radius) const;

 private:
  Eigen::Matrix3f R_;  // R_camera_world
  Eigen::Vector3f t_;
  float fx_, fy_, cx_, cy_;
  float cols_, rows_, margin_;
};

/// Points in cubes of space, which a view skips together.
class PointGroups {
 public:
  explicit PointGroups(const std::vector<Eigen::Vector3f>& points);

  /// Calls `use(point, projected)` for all points in the image of a view.
  template <typename Use>
  void for_each_in(const ViewProjection& view, const Use& use) const {
    constexpr auto kRadius = static_cast<float>(0.87 * kSide);  // half a diagonal
    for (const Group& group : groups_) {
      if (!view.reaches(group.center, kRadius)) continue;
      for (const std::uint32_t point : group.points) {
        if (const auto projected = view((*points_)[point])) use(point, *projected);
      }
    }
  }

 private:
  static constexpr double kSide = 0.5;  // [m]
  struct Group {
    Eigen::Vector3f center;
    std::vector<std::uint32_t> points;
  };
  const std::vector<Eigen::Vector3f>* points_;
  std::vector<Group> groups_;
};

}  // namespace stillmap
