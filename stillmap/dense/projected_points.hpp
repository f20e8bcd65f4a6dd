// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/parallel_for.hpp"
#include "stillmap/dense/semantic_map.hpp"

#include <algorithm>
#include <cstddef>
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
  std::optional<ProjectedPoint> operator()(const Eigen::Vector3f& p_world) const {
    constexpr float kNearest = 0.1F;  // [m]
    const Eigen::Vector3f p = R_ * p_world + t_;
    if (p.z() < kNearest) return std::nullopt;
    const float u = fx_ * p.x() / p.z() + cx_, v = fy_ * p.y() / p.z() + cy_;
    const bool inside =
        u >= -margin_ && v >= -margin_ && u <= cols_ - 1 + margin_ && v <= rows_ - 1 + margin_;
    if (!inside) return std::nullopt;
    const float x = std::clamp(u, 0.0F, cols_ - 1), y = std::clamp(v, 0.0F, rows_ - 1);
    const int col = std::min(static_cast<int>(x), static_cast<int>(cols_) - 2);
    const int row = std::min(static_cast<int>(y), static_cast<int>(rows_) - 2);
    return ProjectedPoint{row, col, x - static_cast<float>(col), y - static_cast<float>(row),
                          p.z()};
  }
  /// Returns whether points of a ball may be in the image. World frame [m].
  bool reaches(const Eigen::Vector3f& center, float radius) const;

 private:
  Eigen::Matrix3f R_;  // R_camera_world
  Eigen::Vector3f t_;
  float fx_, fy_, cx_, cy_;
  float cols_, rows_, margin_;
};

/// Points sorted by cubes of space, which a view skips together.
class PointGroups {
 public:
  explicit PointGroups(const std::vector<Eigen::Vector3f>& points);

  std::size_t size() const { return points_.size(); }
  /// Returns the i-th of the sorted points, and its place in the list that the groups are made of.
  const Eigen::Vector3f& point(std::size_t i) const { return points_[i]; }
  std::size_t place(std::size_t i) const { return places_[i]; }

  /// Calls `use(i, projected)` for all points in the image of a view. With several threads the
  /// order of the points is open.
  template <typename Use>
  void for_each_in(const ViewProjection& view, int threads, const Use& use) const {
    constexpr auto kRadius = static_cast<float>(0.87 * kSide);  // half a diagonal
    parallel_lanes(groups_.size(), threads, [&](std::size_t group) {
      const auto& [center, first, last] = groups_[group];
      if (!view.reaches(center, kRadius)) return;
      for (std::size_t i = first; i < last; ++i) {
        if (const auto projected = view(points_[i])) use(i, *projected);
      }
    });
  }

 private:
  static constexpr double kSide = 0.5;  // [m]
  struct Group {
    Eigen::Vector3f center;
    std::size_t first, last;  // of its points, without `last`
  };
  std::vector<Eigen::Vector3f> points_;
  std::vector<std::size_t> places_;
  std::vector<Group> groups_;
};

}  // namespace stillmap
