// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <array>
#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include <Eigen/Core>
#include <Eigen/Geometry>

namespace stillmap::simulate {

using Transform = Eigen::Isometry3f;

/// A vertex of a triangle mesh.
struct Vertex {
  Eigen::Vector3f position, normal;  ///< Position [m] and unit normal.
  Eigen::Vector2f uv;                ///< Texture coordinates.
  /// Factor on the texture's B, G, R, see bake_light(); before: the light that it emits.
  Eigen::Vector3f light{0, 0, 0};
};

/// A triangle, counter-clockwise seen from its front.
struct Face {
  std::array<std::uint32_t, 3> vertices;
  std::uint16_t texture = 0;  ///< Index into Textures.
  std::uint8_t instance = 0;  ///< Instance, 0: static; else the id of a mover.
  bool two_sided = false;     ///< Whether it is visible from behind.
  std::uint32_t surface = 0;  ///< Equal for all facets of one smooth surface of a mesh.
};

/// A solid box for ambient occlusion and shadows.
struct Occluder {
  Transform T_box_world;
  Eigen::Vector3f half_size;  ///< Half size [m].
};

/// Position of an object of a known class.
struct NamedObject {
  std::string class_name;   ///< COCO class name.
  Eigen::AlignedBox3f box;  ///< Axis-aligned bounding box in the world frame [m].
};

struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<Face> faces;
  std::vector<Occluder> occluders;
  std::vector<NamedObject> things;
};

/// A texture and its mapping to a face.
struct Material {
  int texture = 0;   ///< Index of the texture; -1: no face.
  float meters = 0;  ///< Length of one repeat [m]; 0: stretched once over the face.
  /// u0 v0 u1 v1: the part of the texture used when stretched.
  Eigen::Vector4f window{0, 0, 1, 1};
  float emission = 0;  ///< Emitted light [share of full scale].
};

/// Materials of the six sides of a box, seen along its +y axis.
struct BoxSkin {
  BoxSkin(const Material& all)
      : front(all), back(all), left(all), right(all), top(all), bottom(all) {}
  BoxSkin(const Material& face, const Material& rest)
      : front(face), back(rest), left(rest), right(rest), top(rest), bottom(rest) {}
  Material front, back, left, right, top, bottom;
};

/// One ring of a loft: an ellipse around `center` in the x-y plane of the loft.
struct Ring {
  Eigen::Vector3f center;
  float radius_x = 0, radius_y = 0;
};

/// Returns a rotation by `yaw_degrees` about z followed by a translation [m].
Transform place(float x, float y, float z, float yaw_degrees = 0);

/// Adds primitives to a mesh. Every primitive is given in its own frame `T` (meters, z up).
class MeshBuilder {
 public:
  /// @param grid  longest edge of a facet [m]; light is computed at the corners of facets only
  explicit MeshBuilder(float grid = 0.15F) : grid_(grid) {}

  /// A parallelogram: `corner` is the upper left one, `right` and `down` its edges seen from the
  /// front.
  void quad(const Transform& T, const Eigen::Vector3f& corner, const Eigen::Vector3f& right,
            const Eigen::Vector3f& down, const Material& material, bool two_sided = false);
  /// A box standing on the origin of T, centered in x and y. Casts shadows.
  void box(const Transform& T, const Eigen::Vector3f& size, const BoxSkin& skin,
           bool casts_shadow = true);
  /// An upright cylinder or truncated cone standing on the origin of T.
  void cylinder(const Transform& T, float bottom_radius, float top_radius, float height,
                const Material& side, const Material& cap, int sides = 20);
  /// An ellipsoid around the origin of T. Its texture wraps around once, top to bottom; u = 0.5 is
  /// -y.
  void ellipsoid(const Transform& T, const Eigen::Vector3f& radii, const Material& material,
                 int sides = 20);
  /// A tube through `rings`, from the first (texture v = 1) to the last (v = 0); u = 0.5 is -y. The
  /// ends are open: use a ring of radius 0 to close one.
  void loft(const Transform& T, std::span<const Ring> rings, const Material& material,
            int sides = 16);
  /// A two-sided strip between two edges, such as a leaf.
  void patch(const Transform& T, std::span<const Eigen::Vector3f> left,
             std::span<const Eigen::Vector3f> right, const Material& material);
  /// Sets the longest edge of the facets of subsequent quads and boxes [m].
  void set_grid(float grid) { grid_ = grid; }
  float grid() const { return grid_; }
  /// An invisible box that casts shadows, centered on its frame.
  void occluder(const Transform& T_world_box, const Eigen::Vector3f& size);

  /// Names the geometry added since there were `first` vertices.
  void name_since(std::size_t first, const char* class_name);

  const Mesh& mesh() const { return mesh_; }
  Mesh take() { return std::move(mesh_); }

 private:
  void add_grid(int columns, int rows, int texture, bool two_sided, std::uint32_t first);

  float grid_;
  std::uint32_t surfaces_ = 0;
  Mesh mesh_;
};

/// Appends the mesh transformed by T, with the given instance for all faces.
void append_transformed(const Mesh& mesh, const Transform& T, std::uint8_t instance, Mesh& to);

}  // namespace stillmap::simulate
