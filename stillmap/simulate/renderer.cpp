// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/renderer.hpp"

#include "stillmap/base/parallel_for.hpp"
#include "stillmap/simulate/texture_filter.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

namespace stillmap::simulate {
namespace {

constexpr double kNear = 0.05;  // meters
constexpr int kBandRows = 24;   // Number of pixel rows of a job; its buffers fit into the cache.

/// Attributes interpolated over a triangle, divided by depth, which makes them linear on the
/// screen.
enum Channel { kInverseDepth, kU, kV, kLightB, kLightG, kLightR, kChannels };

/// a(x, y) = c + gx x + gy y on the sample grid.
struct Plane {
  float c = 0, gx = 0, gy = 0;
  float at(float x, float y) const { return c + gy * y + gx * x; }
};

/// A triangle on the sample grid, corners from top to bottom.
struct ScreenTriangle {
  std::array<float, 3> x, y;
  std::array<Plane, kChannels> planes;
  std::uint64_t surface;  // Equal for the facets of one surface of one mesh.
  std::uint16_t texture;
  std::uint8_t instance;
};

/// A corner in the camera frame: position, then uv and light.
struct Corner {
  Eigen::Vector3d p;
  std::array<double, 5> attributes;
};

/// The sample grid: column s, row s of it lie at pixel coordinate (s - 1) / 2.
struct Grid {
  explicit Grid(const Camera& seen_by)
      : columns(2 * seen_by.width + 1), rows(2 * seen_by.height + 1), camera(seen_by) {}
  Eigen::Vector2d of(const Eigen::Vector3d& p) const {
    return 2 * camera.project(p) + Eigen::Vector2d::Ones();
  }
  int columns, rows;
  const Camera& camera;
};

Corner between(const Corner& a, const Corner& b) {
  const double s = (kNear - a.p.z()) / (b.p.z() - a.p.z());
  Corner c{a.p + s * (b.p - a.p), {}};
  for (std::size_t i = 0; i < c.attributes.size(); ++i) {
    c.attributes[i] = a.attributes[i] + s * (b.attributes[i] - a.attributes[i]);
  }
  return c;
}

/// Clips geometry nearer than kNear (Sutherland and Hodgman 1974): at most four corners remain.
int clip_near(const std::array<Corner, 3>& in, std::array<Corner, 4>& out) {
  int n = 0;
  for (std::size_t i = 0; i < 3; ++i) {
    const Corner& a = in[i];
    const Corner& b = in[(i + 1) % 3];
    const bool a_in = a.p.z() >= kNear, b_in = b.p.z() >= kNear;
    if (a_in) out[static_cast<std::size_t>(n++)] = a;
    if (a_in != b_in) out[static_cast<std::size_t>(n++)] = between(a, b);
  }
  return n;
}

/// Turns meshes into screen triangles: transform, cull, clip, set up.
class Setup {
 public:
  Setup(const Grid& grid, const Pose& T_world_camera, const Eigen::Matrix<double, 6, 1>& motion)
      : grid_(grid), motion_(motion), moves_(!motion.isZero()) {
    const Pose T_camera_world = T_world_camera.inverse();
    R_ = T_camera_world.rotation();
    t_ = T_camera_world.translation();
  }

  void add(const Mesh& mesh) {
    ++meshes_;
    transform(mesh);
    for (const Face& face : mesh.faces) add(mesh, face);
  }

  std::vector<ScreenTriangle> triangles;

 private:
  void transform(const Mesh& mesh) {
    points_.resize(mesh.vertices.size());
    screen_.resize(mesh.vertices.size());
    for (std::size_t i = 0; i < points_.size(); ++i) {
      points_[i] = R_ * mesh.vertices[i].position.cast<double>() + t_;
      if (moves_) points_[i] = at_time_of_its_row(points_[i]);
      if (points_[i].z() >= kNear) screen_[i] = grid_.of(points_[i]);
    }
  }

  /// The point in the frame of the camera at the time when the row that shows it is read. The
  /// motion is that of exp(-s motion), to second order: 1e-5 of the depth at 0.05 rad.
  Eigen::Vector3d at_time_of_its_row(const Eigen::Vector3d& p) const {
    const Eigen::Vector3d v = motion_.head<3>(), w = motion_.tail<3>();
    const Eigen::Vector3d velocity = -(v + w.cross(p)), acceleration = -w.cross(velocity);
    const double height = grid_.camera.height;
    Eigen::Vector3d moved = p;
    for (int iteration = 0; iteration < 3 && moved.z() >= kNear; ++iteration) {
      const double row = grid_.camera.project(moved).y();
      const double s = std::clamp((row - (height - 1) / 2) / height, -1.0, 1.0);
      moved = p + s * velocity + 0.5 * s * s * acceleration;
    }
    return moved;
  }

  Corner corner(const Mesh& mesh, std::uint32_t index) const {
    const Vertex& v = mesh.vertices[index];
    return {points_[index], {v.uv.x(), v.uv.y(), v.light.x(), v.light.y(), v.light.z()}};
  }

  void add(const Mesh& mesh, const Face& face) {
    const auto [a, b, c] = face.vertices;
    const int behind =
        (points_[a].z() < kNear) + (points_[b].z() < kNear) + (points_[c].z() < kNear);
    if (behind == 3) return;
    if (behind == 0) {
      if (!visible({screen_[a], screen_[b], screen_[c]}, face.two_sided)) return;
      emit({corner(mesh, a), corner(mesh, b), corner(mesh, c)},
           {screen_[a], screen_[b], screen_[c]}, face);
      return;
    }
    std::array<Corner, 4> cut;
    const int n = clip_near({corner(mesh, a), corner(mesh, b), corner(mesh, c)}, cut);
    for (int i = 1; i + 1 < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const std::array<Eigen::Vector2d, 3> screen{grid_.of(cut[0].p), grid_.of(cut[k].p),
                                                  grid_.of(cut[k + 1].p)};
      if (visible(screen, face.two_sided)) emit({cut[0], cut[k], cut[k + 1]}, screen, face);
    }
  }

  static double twice_area(const std::array<Eigen::Vector2d, 3>& s) {
    return (s[1].x() - s[0].x()) * (s[2].y() - s[0].y()) -
           (s[2].x() - s[0].x()) * (s[1].y() - s[0].y());
  }

  /// Counter-clockwise fronts have a negative area, as y points down.
  bool visible(const std::array<Eigen::Vector2d, 3>& s, bool two_sided) const {
    const auto [left, right] = std::minmax({s[0].x(), s[1].x(), s[2].x()});
    const auto [top, bottom] = std::minmax({s[0].y(), s[1].y(), s[2].y()});
    if (right < 0 || left > grid_.columns - 1 || bottom < 0 || top > grid_.rows - 1) return false;
    const double area = twice_area(s);
    return two_sided ? std::abs(area) > 1e-9 : area < -1e-9;
  }

  void emit(const std::array<Corner, 3>& corners, const std::array<Eigen::Vector2d, 3>& s,
            const Face& face) {
    ScreenTriangle t{};
    std::array<std::size_t, 3> order{0, 1, 2};
    std::sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) {
      return s[a].y() < s[b].y() || (s[a].y() == s[b].y() && s[a].x() < s[b].x());
    });
    for (std::size_t i = 0; i < 3; ++i) {
      t.x[i] = static_cast<float>(s[order[i]].x());
      t.y[i] = static_cast<float>(s[order[i]].y());
    }
    for (std::size_t k = 0; k < kChannels; ++k) {
      std::array<double, 3> a{};
      for (std::size_t i = 0; i < 3; ++i) {
        a[i] = (k == kInverseDepth ? 1 : corners[i].attributes[k - 1]) / corners[i].p.z();
      }
      t.planes[k] = plane(a, s);
    }
    t.surface = static_cast<std::uint64_t>(meshes_) << 32 | face.surface;
    t.texture = face.texture;
    t.instance = face.instance;
    triangles.push_back(t);
  }

  static Plane plane(const std::array<double, 3>& a, const std::array<Eigen::Vector2d, 3>& s) {
    const double scale = 1 / twice_area(s);
    const Eigen::Vector2d d1 = s[1] - s[0], d2 = s[2] - s[0];
    const double gx = ((a[1] - a[0]) * d2.y() - (a[2] - a[0]) * d1.y()) * scale;
    const double gy = ((a[2] - a[0]) * d1.x() - (a[1] - a[0]) * d2.x()) * scale;
    return {static_cast<float>(a[0] - gx * s[0].x() - gy * s[0].y()), static_cast<float>(gx),
            static_cast<float>(gy)};
  }

  const Grid& grid_;
  Eigen::Matrix<double, 6, 1> motion_;
  bool moves_;
  int meshes_ = 0;
  Eigen::Matrix3d R_;
  Eigen::Vector3d t_;
  std::vector<Eigen::Vector3d> points_;
  std::vector<Eigen::Vector2d> screen_;
};

/// Visible triangle at each sample of some rows of the grid.
class VisibilityBuffer {
 public:
  VisibilityBuffer(int columns, int rows)
      : columns_(columns),
        inverse_depth_(static_cast<std::size_t>(columns * rows)),
        ids_(inverse_depth_.size()) {}

  /// Renders the rows [first, last) of the grid; `step` 2 renders every other row only.
  void draw(const std::vector<ScreenTriangle>& triangles, const std::vector<std::uint32_t>& visible,
            int first, int last) {
    first_ = first;
    std::fill(inverse_depth_.begin(), inverse_depth_.end(), 0.0F);
    std::fill(ids_.begin(), ids_.end(), -1);
    for (const std::uint32_t id : visible) draw(triangles[id], static_cast<int>(id), first, last);
  }

  const float* inverse_depth(int row) const { return inverse_depth_.data() + offset(row); }
  const int* ids(int row) const { return ids_.data() + offset(row); }

 private:
  std::size_t offset(int row) const { return static_cast<std::size_t>((row - first_) * columns_); }

  /// The x where the edge from corner i to corner k crosses row y. An edge has the same ends in the
  /// same order in both triangles that share it, so that they share the crossing to the bit: no
  /// cracks, no overlap.
  static float crossing(const ScreenTriangle& t, std::size_t i, std::size_t k, float y) {
    return t.x[i] + (y - t.y[i]) * ((t.x[k] - t.x[i]) / (t.y[k] - t.y[i]));
  }

  void draw(const ScreenTriangle& t, int id, int first, int last) {
    const int top = std::max(first, static_cast<int>(std::ceil(std::max(t.y[0], -1.0F))));
    const int bottom =
        std::min(last, static_cast<int>(std::ceil(std::min(t.y[2], static_cast<float>(last)))));
    for (int row = top; row < bottom; ++row) {
      const auto y = static_cast<float>(row);
      const float a = crossing(t, 0, 2, y);
      const float b = y < t.y[1] ? crossing(t, 0, 1, y) : crossing(t, 1, 2, y);
      const auto limit = static_cast<float>(columns_);
      const int left = static_cast<int>(std::ceil(std::clamp(std::min(a, b), 0.0F, limit)));
      const int right = static_cast<int>(std::ceil(std::clamp(std::max(a, b), 0.0F, limit)));
      draw_span(t.planes[kInverseDepth], id, row, left, right);
    }
  }

  void draw_span(const Plane& plane, int id, int row, int left, int right) {
    float* depth = inverse_depth_.data() + offset(row);
    int* ids = ids_.data() + offset(row);
    const float start = plane.c + plane.gy * static_cast<float>(row);
    for (int x = left; x < right; ++x) {
      const float w = start + plane.gx * static_cast<float>(x);
      const bool nearer = w > depth[x];
      depth[x] = nearer ? w : depth[x];
      ids[x] = nearer ? id : ids[x];
    }
  }

  int columns_, first_ = 0;
  std::vector<float> inverse_depth_;
  std::vector<int> ids_;
};

Footprint footprint(const ScreenTriangle& t, const Texture& texture, float x, float y, float z) {
  const Plane& w = t.planes[kInverseDepth];
  const float u = t.planes[kU].at(x, y) * z, v = t.planes[kV].at(x, y) * z;
  const float step = 2 * z;  // a pixel is two samples wide
  const Eigen::Vector2f dx((t.planes[kU].gx - u * w.gx) * step,
                           (t.planes[kV].gx - v * w.gx) * step);
  const Eigen::Vector2f dy((t.planes[kU].gy - u * w.gy) * step,
                           (t.planes[kV].gy - v * w.gy) * step);
  const auto texels2 = [&](const Eigen::Vector2f& d) {
    const float du = d.x() * static_cast<float>(texture.width());
    const float dv = d.y() * static_cast<float>(texture.height());
    return du * du + dv * dv;
  };
  const float a = texels2(dx), b = texels2(dy);
  return a > b ? Footprint{u, v, dx, a, b} : Footprint{u, v, dy, b, a};
}

/// Returns the color of a triangle at a position of the sample grid.
Eigen::Vector3f shade(const ScreenTriangle& t, const Texture& texture, float x, float y) {
  const float z = 1 / t.planes[kInverseDepth].at(x, y);
  const Eigen::Vector3f light(t.planes[kLightB].at(x, y), t.planes[kLightG].at(x, y),
                              t.planes[kLightR].at(x, y));
  return filtered(texture, footprint(t, texture, x, y, z)).cwiseProduct(light) * z;
}

/// The jobs of one image: bands of pixel rows, each rendered and shaded separately.
class Painter {
 public:
  Painter(const Grid& grid, const std::vector<ScreenTriangle>& triangles, const Textures& textures,
          Rendering& to)
      : grid_(grid), triangles_(triangles), textures_(textures), to_(to) {
    bands_ = (grid.camera.height + kBandRows - 1) / kBandRows;
    sort_into_bands();
  }

  void run(int threads) {
    parallel_for(static_cast<std::size_t>(bands_), threads, [&] {
      return [this, buffer = VisibilityBuffer(grid_.columns, 2 * kBandRows + 1)](
                 std::size_t band) mutable { paint(static_cast<int>(band), buffer); };
    });
  }

 private:
  /// First and last grid row of a band, both included: one row more than its pixels own, to either
  /// side.
  int first_row(int band) const { return 2 * band * kBandRows; }
  int last_row(int band) const { return std::min(grid_.rows - 1, 2 * (band + 1) * kBandRows); }

  void sort_into_bands() {
    members_.resize(static_cast<std::size_t>(bands_));
    for (std::uint32_t id = 0; id < triangles_.size(); ++id) {
      const ScreenTriangle& t = triangles_[id];
      const float low = std::max(t.y[0], 0.0F);
      const float high = std::min(t.y[2], static_cast<float>(grid_.rows));
      const int from = std::max(0, (static_cast<int>(low) - 1) / (2 * kBandRows) - 1);
      const int to = std::min(bands_ - 1, static_cast<int>(high) / (2 * kBandRows));
      for (int band = from; band <= to; ++band) {
        if (high < static_cast<float>(first_row(band))) break;
        if (low <= static_cast<float>(last_row(band))) {
          members_[static_cast<std::size_t>(band)].push_back(id);
        }
      }
    }
  }

  void paint(int band, VisibilityBuffer& buffer) {
    buffer.draw(triangles_, members_[static_cast<std::size_t>(band)], first_row(band),
                last_row(band) + 1);
    const int end = std::min(grid_.camera.height, (band + 1) * kBandRows);
    for (int y = band * kBandRows; y < end; ++y) {
      write_truth(y, buffer);
      if (!to_.color.empty()) write_color(y, buffer);
    }
  }

  void write_truth(int y, const VisibilityBuffer& buffer) {
    const float* inverse_depth = buffer.inverse_depth(2 * y + 1);
    const int* ids = buffer.ids(2 * y + 1);
    auto* depth = to_.depth.ptr<float>(y);
    auto* instances = to_.instances.ptr<std::uint8_t>(y);
    for (int x = 0; x < grid_.camera.width; ++x) {
      const int id = ids[2 * x + 1];
      depth[x] = id < 0 ? 0 : 1 / inverse_depth[2 * x + 1];
      instances[x] = id < 0 ? 0 : triangles_[static_cast<std::size_t>(id)].instance;
    }
  }

  void write_color(int y, const VisibilityBuffer& buffer) {
    const std::array rows{buffer.ids(2 * y), buffer.ids(2 * y + 1), buffer.ids(2 * y + 2)};
    auto* out = to_.color.ptr<cv::Vec3f>(y);
    for (int x = 0; x < grid_.camera.width; ++x) {
      const Eigen::Vector3f color = pixel(rows, 2 * x + 1, 2 * y + 1);
      out[x] = {color.x(), color.y(), color.z()};
    }
  }

  Eigen::Vector3f shade_at(int id, int x, int y) const {
    if (id < 0) return Eigen::Vector3f::Zero();
    const ScreenTriangle& t = triangles_[static_cast<std::size_t>(id)];
    return shade(t, textures_[t.texture], static_cast<float>(x), static_cast<float>(y));
  }

  bool same_surface(int a, int b) const {
    return a == b || (a >= 0 && b >= 0 &&
                      triangles_[static_cast<std::size_t>(a)].surface ==
                          triangles_[static_cast<std::size_t>(b)].surface);
  }

  /// Returns the color of the pixel around (x, y) of the grid: every surface among its nine samples
  /// is shaded once, at its sample of largest weight, and weighted by the tent weights of its
  /// samples.
  Eigen::Vector3f pixel(const std::array<const int*, 3>& rows, int x, int y) const {
    struct Share {
      int id, x, y;
      float weight;
    };
    // The samples of largest weight first: center, sides, corners.
    static constexpr std::array<std::array<int, 3>, 9> kSamples{{{0, 0, 4},
                                                                 {-1, 0, 2},
                                                                 {1, 0, 2},
                                                                 {0, -1, 2},
                                                                 {0, 1, 2},
                                                                 {-1, -1, 1},
                                                                 {1, -1, 1},
                                                                 {-1, 1, 1},
                                                                 {1, 1, 1}}};
    const int middle = rows[1][x];
    const auto all_middle = [&](const int* row) {
      return row[x - 1] == middle && row[x] == middle && row[x + 1] == middle;
    };
    if (all_middle(rows[0]) && all_middle(rows[1]) && all_middle(rows[2]))
      return shade_at(middle, x, y);
    std::array<Share, 9> shares;
    std::size_t count = 0;
    for (const auto& [dx, dy, weight] : kSamples) {
      const int id = rows[static_cast<std::size_t>(dy + 1)][x + dx];
      std::size_t i = 0;
      while (i < count && !same_surface(shares[i].id, id)) ++i;
      if (i == count) shares[count++] = {id, x + dx, y + dy, 0};
      shares[i].weight += static_cast<float>(weight);
    }
    Eigen::Vector3f sum = Eigen::Vector3f::Zero();
    for (std::size_t i = 0; i < count; ++i) {
      sum += shares[i].weight / 16 * shade_at(shares[i].id, shares[i].x, shares[i].y);
    }
    return sum;
  }

  const Grid& grid_;
  const std::vector<ScreenTriangle>& triangles_;
  const Textures& textures_;
  Rendering& to_;
  int bands_;
  std::vector<std::vector<std::uint32_t>> members_;
};

}  // namespace

Rendering render(const Camera& camera, const Pose& T_world_camera,
                 std::span<const Mesh* const> meshes, const Textures& textures,
                 const RenderOptions& options) {
  const cv::Size size(camera.width, camera.height);
  Rendering result{{}, cv::Mat(size, CV_32FC1), cv::Mat(size, CV_8UC1)};
  if (options.color) result.color.create(size, CV_32FC3);
  const Grid grid(camera);
  Setup setup(grid, T_world_camera, options.motion);
  for (const Mesh* mesh : meshes) setup.add(*mesh);
  Painter(grid, setup.triangles, textures, result).run(options.threads);
  return result;
}

}  // namespace stillmap::simulate
