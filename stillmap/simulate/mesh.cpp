// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/mesh.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f, Eigen::Vector3f;
constexpr float kPi = std::numbers::pi_v<float>;

int pieces(float length, float grid) {
  return std::max(1, static_cast<int>(std::ceil(length / grid - 1e-3F)));
}

/// Returns the texture coordinates of a fraction (s, t) of a face of the given extent [m].
Vector2f coordinates(const Material& material, float s, float t, float width, float height) {
  if (material.meters > 0) return {s * width / material.meters, t * height / material.meters};
  const auto& w = material.window;
  return {w[0] + s * (w[2] - w[0]), w[1] + t * (w[3] - w[1])};
}

/// Returns the outward normal of a loft at ring i: normal to the ring's tangent and to the line to
/// the next ring.
Vector3f loft_normal(std::span<const Ring> rings, std::size_t i, float angle) {
  const auto at = [&](std::size_t k) -> Vector3f {
    const Ring& r = rings[k];
    return r.center + Vector3f(r.radius_x * std::sin(angle), -r.radius_y * std::cos(angle), 0);
  };
  const Vector3f up = at(std::min(i + 1, rings.size() - 1)) - at(i == 0 ? 0 : i - 1);
  const Ring& widest = rings[i].radius_x > 1e-4F
                           ? rings[i]
                           : rings[i == 0 ? 1 : i - 1];  // a tip uses the normal of its neighbor
  const Vector3f around(widest.radius_x * std::cos(angle), widest.radius_y * std::sin(angle), 0);
  const Vector3f normal = around.cross(up);
  return normal.squaredNorm() > 1e-12F ? Vector3f(normal.normalized()) : Vector3f::UnitZ();
}

}  // namespace

Transform place(float x, float y, float z, float yaw_degrees) {
  Transform T = Transform::Identity();
  T.translate(Vector3f(x, y, z));
  T.rotate(Eigen::AngleAxisf(yaw_degrees * kPi / 180, Vector3f::UnitZ()));
  return T;
}

void MeshBuilder::add_grid(int columns, int rows, int texture, bool two_sided,
                           std::uint32_t first) {
  const auto index = [&](int r, int c) {
    return first + static_cast<std::uint32_t>(r * (columns + 1) + c);
  };
  const auto id = static_cast<std::uint16_t>(texture);
  ++surfaces_;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      const auto a = index(r, c), b = index(r, c + 1), d = index(r + 1, c), e = index(r + 1, c + 1);
      mesh_.faces.push_back({{a, d, e}, id, 0, two_sided, surfaces_});
      mesh_.faces.push_back({{a, e, b}, id, 0, two_sided, surfaces_});
    }
  }
}

void MeshBuilder::quad(const Transform& T, const Vector3f& corner, const Vector3f& right,
                       const Vector3f& down, const Material& material, bool two_sided) {
  if (material.texture < 0) return;
  const float width = right.norm(), height = down.norm();
  const int columns = pieces(width, grid_), rows = pieces(height, grid_);
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  const Vector3f normal = T.linear() * down.cross(right).normalized();
  for (int r = 0; r <= rows; ++r) {
    for (int c = 0; c <= columns; ++c) {
      const float s = static_cast<float>(c) / static_cast<float>(columns);
      const float t = static_cast<float>(r) / static_cast<float>(rows);
      mesh_.vertices.push_back({T * Vector3f(corner + s * right + t * down), normal,
                                coordinates(material, s, t, width, height),
                                Vector3f::Constant(material.emission)});
    }
  }
  add_grid(columns, rows, material.texture, two_sided, first);
}

void MeshBuilder::box(const Transform& T, const Vector3f& size, const BoxSkin& skin,
                      bool casts_shadow) {
  const float x = size.x() / 2, y = size.y() / 2, z = size.z();
  const Vector3f X(size.x(), 0, 0), Y(0, size.y(), 0), Z(0, 0, size.z());
  quad(T, {-x, -y, z}, X, -Z, skin.front);
  quad(T, {x, y, z}, -X, -Z, skin.back);
  quad(T, {-x, y, z}, -Y, -Z, skin.left);
  quad(T, {x, -y, z}, Y, -Z, skin.right);
  quad(T, {-x, y, z}, X, -Y, skin.top);
  quad(T, {-x, -y, 0}, X, Y, skin.bottom);
  if (casts_shadow) occluder(T * Eigen::Translation3f(0, 0, z / 2), size);
}

void MeshBuilder::occluder(const Transform& T_world_box, const Vector3f& size) {
  mesh_.occluders.push_back({T_world_box.inverse(), size / 2});
}

void MeshBuilder::cylinder(const Transform& T, float bottom_radius, float top_radius, float height,
                           const Material& side, const Material& cap, int sides) {
  const int steps = pieces(height, 2 * grid_);
  std::vector<Ring> rings;
  for (int i = 0; i <= steps; ++i) {
    const float s = static_cast<float>(i) / static_cast<float>(steps);
    const float r = bottom_radius + s * (top_radius - bottom_radius);
    rings.push_back({{0, 0, s * height}, r, r});
  }
  loft(T, rings, side, sides);
  const std::array top{Ring{{0, 0, height}, top_radius, top_radius}, Ring{{0, 0, height}, 0, 0}};
  const std::array bottom{Ring{{0, 0, 0}, 0, 0}, Ring{{0, 0, 0}, bottom_radius, bottom_radius}};
  loft(T, top, cap, sides);
  loft(T, bottom, cap, sides);
  const float r = 0.8F * std::min(bottom_radius, top_radius);
  occluder(T * Eigen::Translation3f(0, 0, height / 2), {2 * r, 2 * r, height});
}

void MeshBuilder::ellipsoid(const Transform& T, const Vector3f& radii, const Material& material,
                            int sides) {
  const int steps = sides / 2;
  std::vector<Ring> rings;
  for (int i = 0; i <= steps; ++i) {
    const float a = kPi * (static_cast<float>(i) / static_cast<float>(steps) - 0.5F);
    const float c = std::max(0.0F, std::cos(a));
    rings.push_back({{0, 0, radii.z() * std::sin(a)}, radii.x() * c, radii.y() * c});
  }
  loft(T, rings, material, sides);
  occluder(T, 1.3F * radii);
}

void MeshBuilder::loft(const Transform& T, std::span<const Ring> rings, const Material& material,
                       int sides) {
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  float length = 0, girth = 0;
  for (std::size_t i = 0; i < rings.size(); ++i) {
    if (i > 0) length += (rings[i].center - rings[i - 1].center).norm();
    girth = std::max(girth, kPi * (rings[i].radius_x + rings[i].radius_y));
  }
  const int rows = static_cast<int>(rings.size()) - 1;
  for (int r = 0; r <= rows; ++r) {
    const auto i =
        static_cast<std::size_t>(rows - r);  // from the top down, like texture coordinates
    for (int c = 0; c <= sides; ++c) {
      const float s = static_cast<float>(c) / static_cast<float>(sides);
      const float angle = 2 * kPi * (s - 0.5F);
      const Vector3f p = rings[i].center + Vector3f(rings[i].radius_x * std::sin(angle),
                                                    -rings[i].radius_y * std::cos(angle), 0);
      mesh_.vertices.push_back(
          {T * p, T.linear() * loft_normal(rings, i, angle),
           coordinates(material, s, static_cast<float>(r) / static_cast<float>(rows), girth,
                       length)});
    }
  }
  add_grid(sides, rows, material.texture, false, first);
}

void MeshBuilder::patch(const Transform& T, std::span<const Vector3f> left,
                        std::span<const Vector3f> right, const Material& material) {
  const auto first = static_cast<std::uint32_t>(mesh_.vertices.size());
  const int rows = static_cast<int>(left.size()) - 1;
  for (std::size_t i = 0; i < left.size(); ++i) {
    const Vector3f along = left[std::min(i + 1, left.size() - 1)] - left[i == 0 ? 0 : i - 1];
    Vector3f normal = along.cross(right[i] - left[i]);
    if (normal.norm() < 1e-9F) normal = Vector3f::UnitZ();
    if (normal.z() < 0) normal = -normal;
    normal.normalize();
    const float t = static_cast<float>(i) / static_cast<float>(rows);
    mesh_.vertices.push_back({T * left[i], T.linear() * normal, coordinates(material, 0, t, 0, 0)});
    mesh_.vertices.push_back(
        {T * right[i], T.linear() * normal, coordinates(material, 1, t, 0, 0)});
  }
  add_grid(1, rows, material.texture, true, first);
}

void MeshBuilder::name_since(std::size_t first, const char* class_name) {
  NamedObject object{class_name, {}};
  for (std::size_t i = first; i < mesh_.vertices.size(); ++i) {
    object.box.extend(mesh_.vertices[i].position);
  }
  mesh_.things.push_back(object);
}

void append_transformed(const Mesh& mesh, const Transform& T, std::uint8_t instance, Mesh& to) {
  const auto first = static_cast<std::uint32_t>(to.vertices.size());
  for (const Vertex& v : mesh.vertices) {
    to.vertices.push_back({T * v.position, T.linear() * v.normal, v.uv, v.light});
  }
  const std::uint32_t surfaces = to.faces.empty() ? 0 : to.faces.back().surface;
  for (Face face : mesh.faces) {
    for (auto& v : face.vertices) v += first;
    face.surface += surfaces;
    face.instance = instance;
    to.faces.push_back(face);
  }
}

}  // namespace stillmap::simulate
