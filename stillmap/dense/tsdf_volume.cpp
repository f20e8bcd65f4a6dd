// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/tsdf_volume.hpp"

#include "stillmap/base/parallel_for.hpp"
#include "stillmap/dense/depth_weight.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

namespace stillmap {
namespace {

/// Minimum weight of a voxel of the mesh; a view from a distance of z meters weighs 1 / z^4. The
/// pixels were chosen before; this is for voxels that only few rays pass behind the surface.
constexpr double kMinWeight = 1e-4;

constexpr int kSide = TsdfVolume::kSide;
/// Maximum weight of a voxel, so that new views keep changing it.
constexpr float kMaxWeight = 200;
constexpr std::uint32_t kNoVertex = std::numeric_limits<std::uint32_t>::max();

constexpr int place(int x, int y, int z) { return x + kSide * (y + kSide * z); }

// Returns the block of a voxel along one axis, by a division that rounds down.
int block_of(int i) { return i >= 0 ? i / kSide : -((kSide - 1 - i) / kSide); }

Lattice block_of(const Lattice& voxel) {
  return {block_of(voxel.x()), block_of(voxel.y()), block_of(voxel.z())};
}

}  // namespace

TsdfVolume::TsdfVolume(const MeshOptions& options) : options_(options) {}

void TsdfVolume::integrate(const DenseView& view, const Pose& T_world_camera,
                           const cv::Mat1b& surface) {
  allocate(view, T_world_camera, surface);
  const Pose T_camera_world = T_world_camera.inverse();
  const double side = options_.voxel * kSide, radius = 0.87 * side;  // half a diagonal
  const Camera& camera = view.camera;
  const auto update_block = [&](std::size_t i) {
    const Voxel number = index_.voxel(static_cast<std::uint32_t>(i));
    const Eigen::Vector3d center = T_camera_world * center_of(number, side);
    if (center.z() < radius) return;
    const Eigen::Vector2d pixel = camera.project(center);
    const double margin = -1.5 * radius * camera.fx / (center.z() - 0.9 * radius);
    if (!camera.contains(pixel.x(), pixel.y(), margin)) return;
    update(blocks_[i], corner_of(number, side), view, T_camera_world, surface);
  };
  parallel_lanes(blocks_.size(), all_threads(), update_block);
}

// Adds blocks along the rays to all surfaces, up to the truncation distance.
void TsdfVolume::allocate(const DenseView& view, const Pose& T_world_camera,
                          const cv::Mat1b& surface) {
  const Eigen::Matrix3d R = T_world_camera.rotation();
  const double side = options_.voxel * kSide, step = side / 2;
  for (int row = 0; row < view.depth.rows; ++row) {
    for (int col = 0; col < view.depth.cols; ++col) {
      if (surface(row, col) == 0) continue;
      const double z = view.depth(row, col) * double{DenseView::kDepthUnit};
      const Eigen::Vector3d ray = view.camera.unproject(col, row, 1);
      for (double s = -options_.truncation; s <= options_.truncation + 0.5 * step; s += step) {
        const auto block = voxel_at(R * (ray * (z + s)) + T_world_camera.translation(), side);
        if (!block) continue;
        if (index_.add(*block) == blocks_.size()) blocks_.emplace_back();
      }
    }
  }
}

void TsdfVolume::update(Block& block, const Eigen::Vector3d& corner, const DenseView& view,
                        const Pose& T_camera_world, const cv::Mat1b& surface) {
  const Camera& camera = view.camera;
  const DepthWeight weight(camera.depth_sensor);
  const Eigen::Matrix3f R = T_camera_world.rotation().cast<float>();
  const Eigen::Vector3f origin = (T_camera_world * corner).cast<float>();
  const auto edge = static_cast<float>(options_.voxel);
  const auto fx = static_cast<float>(camera.fx), fy = static_cast<float>(camera.fy);
  const auto cx = static_cast<float>(camera.cx), cy = static_cast<float>(camera.cy);
  for (int i = 0; i < static_cast<int>(block.size()); ++i) {
    const Eigen::Vector3f offset(static_cast<float>(i % kSide),
                                 static_cast<float>(i / kSide % kSide),
                                 static_cast<float>(i / kSide / kSide));
    const Eigen::Vector3f p = origin + R * (edge * offset);  // Samples are at the lower corners.
    if (p.z() < 0.1F) continue;
    const float u = fx * p.x() / p.z() + cx, v = fy * p.y() / p.z() + cy;
    if (!(u > -0.5F && v > -0.5F)) continue;
    const int col = static_cast<int>(u + 0.5F), row = static_cast<int>(v + 0.5F);
    if (col >= view.depth.cols || row >= view.depth.rows) continue;
    const float z = view.depth(row, col) * DenseView::kDepthUnit;
    if (z <= 0) continue;
    update_voxel(block[static_cast<std::size_t>(i)], z - p.z(), weight.at(z),
                 surface(row, col) != 0);
  }
}

// Updates a voxel that is `ahead` [m] in front of the depth measured on its ray, which has
// `weight`.
void TsdfVolume::update_voxel(Voxel8& voxel, float ahead, float weight, bool on_surface) const {
  const auto truncation = static_cast<float>(options_.truncation);
  const bool free = ahead > truncation;
  if (ahead < -truncation || (!free && !on_surface)) return;
  const float share = weight / (voxel.weight + weight);
  voxel.distance += share * (std::min(1.0F, ahead / truncation) - voxel.distance);
  voxel.weight = std::min(kMaxWeight, voxel.weight + weight);
}

const TsdfVolume::Voxel8* TsdfVolume::at(const Lattice& voxel) const {
  const Lattice block = block_of(voxel);
  const std::uint32_t number = index_.find(voxel_of(block));
  if (number == VoxelIndex::kNone) return nullptr;
  const Lattice inner = voxel - kSide * block;
  return &blocks_[number][static_cast<std::size_t>(place(inner.x(), inner.y(), inner.z()))];
}

/// Extracts the surface of a volume.
class SurfaceNets {
 public:
  explicit SurfaceNets(const TsdfVolume& volume) : volume_(volume) {}

  TriangleMesh mesh() {
    vertices_of_.resize(volume_.blocks_.size());
    const std::vector<std::uint32_t> order = volume_.index_.sorted();
    for (const std::uint32_t block : order) make_vertices(block);
    for (const std::uint32_t block : order) make_faces(block);
    return std::move(mesh_);
  }

 private:
  using Voxel8 = TsdfVolume::Voxel8;
  using Cube = std::array<const Voxel8*, 8>;  // corner i: x bit 0, y bit 1, z bit 2

  /// Returns the eight voxels from `voxel` on, which has place `i` in a block; null where there is
  /// none.
  Cube cube_at(const TsdfVolume::Block& block, int i, const Lattice& voxel) const {
    Cube cube;
    const bool inside =
        i % kSide < kSide - 1 && i / kSide % kSide < kSide - 1 && i / kSide / kSide < kSide - 1;
    for (int corner = 0; corner < 8 && inside; ++corner) {
      const int step = place(corner & 1, corner >> 1 & 1, corner >> 2 & 1);
      cube[static_cast<std::size_t>(corner)] = &block[static_cast<std::size_t>(i + step)];
    }
    if (inside) return cube;
    for (int corner = 0; corner < 8; ++corner) {
      cube[static_cast<std::size_t>(corner)] =
          volume_.at(voxel + Lattice(corner & 1, corner >> 1 & 1, corner >> 2 & 1));
    }
    return cube;
  }

  /// Returns whether the surface is between two neighbors. The other voxels around need not be
  /// known, so that the surface reaches to the last ray along an outline; but free space in front
  /// of one surface beside the unknown behind another is none.
  static bool is_crossed(const Voxel8* a, const Voxel8* b) {
    constexpr float kMaxStep = 1.9F;
    if (a == nullptr || b == nullptr || a->weight < kMinWeight || b->weight < kMinWeight)
      return false;
    return (a->distance < 0) != (b->distance < 0) && std::abs(a->distance - b->distance) < kMaxStep;
  }

  void make_vertices(std::uint32_t number) {
    vertices_of_[number].fill(kNoVertex);
    const Lattice corner = kSide * lattice_of(volume_.index_.voxel(number));
    for (int i = 0; i < kSide * kSide * kSide; ++i) {
      const Lattice voxel = corner + Lattice(i % kSide, i / kSide % kSide, i / kSide / kSide);
      vertices_of_[number][static_cast<std::size_t>(i)] =
          add_vertex(voxel, cube_at(volume_.blocks_[number], i, voxel));
    }
  }

  /// Adds the mean of the intersections with the edges of the cube at `voxel`, if there are any.
  std::uint32_t add_vertex(const Lattice& voxel, const Cube& cube) {
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    float crossings = 0;
    for (int a = 0; a < 8; ++a) {
      for (int axis = 0; axis < 3; ++axis) {
        const int b = a | 1 << axis;
        const Voxel8 *low = cube[static_cast<std::size_t>(a)],
                     *high = cube[static_cast<std::size_t>(b)];
        if (b == a || !is_crossed(low, high)) continue;
        Eigen::Vector3f p(static_cast<float>(a & 1), static_cast<float>(a >> 1 & 1),
                          static_cast<float>(a >> 2 & 1));
        p[axis] += low->distance / (low->distance - high->distance);
        sum += p;
        crossings += 1;
      }
    }
    if (crossings == 0) return kNoVertex;
    const auto edge = static_cast<float>(volume_.options_.voxel);
    mesh_.vertices.push_back(edge * (voxel.cast<float>() + sum / crossings));
    mesh_.colors.push_back({});
    return static_cast<std::uint32_t>(mesh_.vertices.size() - 1);
  }

  std::uint32_t vertex_at(const Lattice& voxel) const {
    const Lattice block = block_of(voxel);
    const std::uint32_t number = volume_.index_.find(voxel_of(block));
    if (number == VoxelIndex::kNone) return kNoVertex;
    const Lattice inner = voxel - kSide * block;
    return vertices_of_[number][static_cast<std::size_t>(place(inner.x(), inner.y(), inner.z()))];
  }

  /// Adds the faces around the crossed edges that begin in the block, from the vertices of the four
  /// cubes that share an edge.
  void make_faces(std::uint32_t number) {
    const Lattice corner = kSide * lattice_of(volume_.index_.voxel(number));
    const auto& block = volume_.blocks_[number];
    for (int i = 0; i < static_cast<int>(block.size()); ++i) {
      const auto& from = block[static_cast<std::size_t>(i)];
      if (from.weight < kMinWeight) continue;
      const Lattice voxel = corner + Lattice(i % kSide, i / kSide % kSide, i / kSide / kSide);
      for (int axis = 0; axis < 3; ++axis) {
        if (!is_crossed(&from, volume_.at(voxel + Lattice::Unit(axis)))) continue;
        add_face(voxel, axis, from.distance < 0);
      }
    }
  }

  void add_face(const Lattice& voxel, int axis, bool outwards) {
    const Lattice u = Lattice::Unit((axis + 1) % 3), v = Lattice::Unit((axis + 2) % 3);
    std::array<std::uint32_t, 4> ring{vertex_at(voxel - u - v), vertex_at(voxel - v),
                                      vertex_at(voxel), vertex_at(voxel - u)};
    if (std::find(ring.begin(), ring.end(), kNoVertex) != ring.end()) return;
    if (!outwards) std::swap(ring[1], ring[3]);
    // Cut along the shorter diagonal.
    const auto& p = mesh_.vertices;
    const bool first =
        (p[ring[0]] - p[ring[2]]).squaredNorm() <= (p[ring[1]] - p[ring[3]]).squaredNorm();
    const std::size_t s = first ? 0 : 1;
    mesh_.triangles.push_back({ring[s], ring[s + 1], ring[(s + 2) % 4]});
    mesh_.triangles.push_back({ring[s], ring[(s + 2) % 4], ring[(s + 3) % 4]});
  }

  const TsdfVolume& volume_;
  std::vector<std::array<std::uint32_t, kSide * kSide * kSide>> vertices_of_;
  TriangleMesh mesh_;
};

TriangleMesh TsdfVolume::mesh() const { return SurfaceNets(*this).mesh(); }

}  // namespace stillmap
