// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/texture.hpp"

#include "stillmap/base/trace.hpp"
#include "stillmap/dense/mesh_charts.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <limits>
#include <map>
#include <numbers>
#include <numeric>
#include <optional>
#include <utility>

#include <Eigen/Geometry>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Largest side of the image [texels].
constexpr int kMaxSide = 8192;
/// Largest extent of a chart [m].
constexpr double kChartSide = 4;
/// Width of the border around a triangle that has its colors, so that none of the background is
/// seen when a viewer interpolates between texels or reduces the image [texels].
constexpr float kBorder = 2;
/// Number of texels that are colored at once, to bound the memory.
constexpr std::size_t kAtOnce = 1000000;

/// A chart with the places of its vertices.
struct Patch {
  std::vector<std::array<Eigen::Vector2f, 3>> corners;  // of the triangles [texels of the patch]
  cv::Size size;                                        // [texels]
  cv::Point at;                                         // upper left corner in the image [texels]
};

/// Returns the axes of a chart, turned so that its rectangle is as small as possible.
Eigen::Matrix<float, 2, 3> tight_axes(const TriangleMesh& mesh, const MeshChart& chart) {
  std::vector<cv::Point2f> points;
  for (const std::uint32_t triangle : chart.triangles) {
    for (const std::uint32_t vertex : mesh.triangles[triangle]) {
      const Eigen::Vector2f p = chart.axes * mesh.vertices[vertex];
      points.emplace_back(p.x(), p.y());
    }
  }
  const float degrees = cv::minAreaRect(points).angle;
  return Eigen::Rotation2Df(-degrees * std::numbers::pi_v<float> / 180).matrix() * chart.axes;
}

/// Returns a chart with the corner of its rectangle at the border.
Patch patch_of(const TriangleMesh& mesh, const MeshChart& chart, double texel) {
  Patch patch;
  const Eigen::Matrix<float, 2, 3> axes = tight_axes(mesh, chart) / static_cast<float>(texel);
  Eigen::Vector2f low = Eigen::Vector2f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const std::uint32_t triangle : chart.triangles) {
    std::array<Eigen::Vector2f, 3>& corners = patch.corners.emplace_back();
    for (std::size_t k = 0; k < 3; ++k) {
      corners[k] = axes * mesh.vertices[mesh.triangles[triangle][k]];
      low = low.cwiseMin(corners[k]);
      high = high.cwiseMax(corners[k]);
    }
  }
  const Eigen::Vector2f offset = Eigen::Vector2f::Constant(kBorder) - low;
  for (auto& corners : patch.corners) {
    for (Eigen::Vector2f& corner : corners) corner += offset;
  }
  const Eigen::Vector2f size = high - low + Eigen::Vector2f::Constant(2 * kBorder + 1);
  patch.size = {static_cast<int>(std::ceil(size.x())), static_cast<int>(std::ceil(size.y()))};
  return patch;
}

/// Places the patches in rows of a given width, the highest first; returns the size of all.
cv::Size pack(std::vector<Patch>& patches, int width) {
  std::vector<std::size_t> by_height(patches.size());
  std::iota(by_height.begin(), by_height.end(), std::size_t{0});
  std::stable_sort(by_height.begin(), by_height.end(), [&](std::size_t a, std::size_t b) {
    return patches[a].size.height > patches[b].size.height;
  });
  cv::Point next(0, 0);
  int row_height = 0, used_width = 1;
  for (const std::size_t i : by_height) {
    Patch& patch = patches[i];
    if (next.x + patch.size.width > width) {
      next = {0, next.y + row_height};
      row_height = 0;
    }
    patch.at = next;
    next.x += patch.size.width;
    used_width = std::max(used_width, next.x);
    row_height = std::max(row_height, patch.size.height);
  }
  return {used_width, std::max(1, next.y + row_height)};
}

struct Atlas {
  std::vector<Patch> patches;  // of the charts
  cv::Size size;
};

/// Returns the smallest of some images with all charts; none if all are larger than kMaxSide.
std::optional<Atlas> packed(const TriangleMesh& mesh, const std::vector<MeshChart>& charts,
                            double texel) {
  Atlas atlas;
  double area = 0;
  int widest = 1;
  for (const MeshChart& chart : charts) {
    const Patch& patch = atlas.patches.emplace_back(patch_of(mesh, chart, texel));
    area += patch.size.area();
    widest = std::max(widest, patch.size.width);
  }
  int best_width = 0;
  for (const double elongation : {1.0, 1.1, 1.2, 1.35, 1.5, 1.75, 2.0}) {
    const int width = std::max(widest, static_cast<int>(std::ceil(elongation * std::sqrt(area))));
    const cv::Size size = pack(atlas.patches, width);
    if (std::max(size.width, size.height) > kMaxSide) continue;
    if (best_width > 0 && size.area() >= atlas.size.area()) continue;
    best_width = width;
    atlas.size = size;
  }
  if (best_width == 0) return std::nullopt;
  pack(atlas.patches, best_width);
  return atlas;
}

/// Returns the weights of a triangle's corners at its point nearest to a given one.
Eigen::Vector3f nearest_weights(const std::array<Eigen::Vector2f, 3>& corners,
                                const Eigen::Vector2f& p) {
  const auto cross = [](const Eigen::Vector2f& a, const Eigen::Vector2f& b) {
    return a.x() * b.y() - a.y() * b.x();
  };
  const float area = cross(corners[1] - corners[0], corners[2] - corners[0]);
  if (std::abs(area) > 1e-6F) {
    const Eigen::Vector3f inside(cross(corners[1] - p, corners[2] - p) / area,
                                 cross(corners[2] - p, corners[0] - p) / area,
                                 cross(corners[0] - p, corners[1] - p) / area);
    if (inside.minCoeff() >= 0) return inside;
  }
  Eigen::Vector3f best = Eigen::Vector3f::UnitX();
  float least = std::numeric_limits<float>::max();
  for (std::size_t k = 0; k < 3; ++k) {
    const std::size_t next = (k + 1) % 3;
    const Eigen::Vector2f along = corners[next] - corners[k];
    const float t =
        std::clamp(along.dot(p - corners[k]) / std::max(along.squaredNorm(), 1e-9F), 0.0F, 1.0F);
    const float distance = (corners[k] + t * along - p).squaredNorm();
    if (distance >= least) continue;
    least = distance;
    best.setZero();
    best[static_cast<int>(k)] = 1 - t;
    best[static_cast<int>(next)] = t;
  }
  return best;
}

/// Texels of the image with their points.
struct Texels {
  std::vector<cv::Point> at;  // in the image
  std::vector<Eigen::Vector3f> points;
};

/// Adds the texels of a patch that are on its triangles or at most kBorder away, each with the
/// nearest point of them.
void add_texels(const TriangleMesh& mesh, const MeshChart& chart, const Patch& patch,
                Texels& texels) {
  cv::Mat1f distances(patch.size, kBorder * kBorder);
  cv::Mat3f points(patch.size);
  for (std::size_t i = 0; i < chart.triangles.size(); ++i) {
    const auto& corners = patch.corners[i];
    const auto& triangle = mesh.triangles[chart.triangles[i]];
    const Eigen::Vector2f low = corners[0].cwiseMin(corners[1]).cwiseMin(corners[2]);
    const Eigen::Vector2f high = corners[0].cwiseMax(corners[1]).cwiseMax(corners[2]);
    const int left = std::max(0, static_cast<int>(low.x() - kBorder)),
              top = std::max(0, static_cast<int>(low.y() - kBorder));
    const int right = std::min(patch.size.width - 1, static_cast<int>(high.x() + kBorder) + 1),
              bottom = std::min(patch.size.height - 1, static_cast<int>(high.y() + kBorder) + 1);
    for (int row = top; row <= bottom; ++row) {
      for (int col = left; col <= right; ++col) {
        const Eigen::Vector2f p(static_cast<float>(col), static_cast<float>(row));
        const Eigen::Vector3f w = nearest_weights(corners, p);
        const Eigen::Vector2f nearest = w[0] * corners[0] + w[1] * corners[1] + w[2] * corners[2];
        const float distance = (nearest - p).squaredNorm();
        if (distance >= distances(row, col)) continue;
        distances(row, col) = distance;
        const Eigen::Vector3f point = w[0] * mesh.vertices[triangle[0]] +
                                      w[1] * mesh.vertices[triangle[1]] +
                                      w[2] * mesh.vertices[triangle[2]];
        points(row, col) = {point.x(), point.y(), point.z()};
      }
    }
  }
  for (int row = 0; row < patch.size.height; ++row) {
    for (int col = 0; col < patch.size.width; ++col) {
      if (distances(row, col) >= kBorder * kBorder) continue;
      const cv::Vec3f& p = points(row, col);
      texels.at.push_back(patch.at + cv::Point(col, row));
      texels.points.emplace_back(p[0], p[1], p[2]);
    }
  }
}

void paint(const Texels& texels, const PointColors& colors, cv::Mat3b& image) {
  const std::vector<Rgb> found = colors(texels.points);
  for (std::size_t i = 0; i < found.size(); ++i)
    image(texels.at[i]) = {found[i][2], found[i][1], found[i][0]};
}

/// Returns the triangles with a vertex for each chart that it is in.
TexturedMesh unwrapped(const TriangleMesh& mesh, const std::vector<MeshChart>& charts,
                       const Atlas& atlas) {
  TexturedMesh result;
  const Eigen::Array2f size(static_cast<float>(atlas.size.width),
                            static_cast<float>(atlas.size.height));
  for (std::size_t number = 0; number < charts.size(); ++number) {
    const Patch& patch = atlas.patches[number];
    const Eigen::Vector2f at(static_cast<float>(patch.at.x), static_cast<float>(patch.at.y));
    std::map<std::uint32_t, std::uint32_t> renumbered;
    for (std::size_t i = 0; i < charts[number].triangles.size(); ++i) {
      auto triangle = mesh.triangles[charts[number].triangles[i]];
      for (std::size_t k = 0; k < 3; ++k) {
        const auto next = static_cast<std::uint32_t>(result.mesh.vertices.size());
        const auto [entry, is_new] = renumbered.try_emplace(triangle[k], next);
        if (is_new) {
          result.mesh.vertices.push_back(mesh.vertices[triangle[k]]);
          result.mesh.colors.push_back(mesh.colors[triangle[k]]);
          // The center of the first texel is half a texel from the border of the image.
          result.places.emplace_back((at + patch.corners[i][k]).array() / size + 0.5F / size);
        }
        triangle[k] = entry->second;
      }
      result.mesh.triangles.push_back(triangle);
    }
  }
  return result;
}

}  // namespace

TexturedMesh textured(const TriangleMesh& mesh, double texel, const PointColors& colors) {
  const TraceScope scope("texture");
  const std::vector<MeshChart> charts = charts_of(mesh, kChartSide);
  std::optional<Atlas> atlas;
  while (!(atlas = packed(mesh, charts, texel))) texel *= 1.25;
  TexturedMesh result = unwrapped(mesh, charts, *atlas);
  result.image = cv::Mat3b::zeros(atlas->size);
  Texels texels;
  for (std::size_t i = 0; i < charts.size(); ++i) {
    add_texels(mesh, charts[i], atlas->patches[i], texels);
    if (texels.at.size() < kAtOnce && i + 1 < charts.size()) continue;
    paint(texels, colors, result.image);
    texels = {};
  }
  return result;
}

}  // namespace stillmap
