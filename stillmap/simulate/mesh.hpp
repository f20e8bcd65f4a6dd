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

/// A corner of a triangle mesh.
struct Vertex {
  Eigen::Vector3f position, normal;  ///< meters; unit length
  Eigen::Vector2f uv;                ///< texture coordinates
  /// What the texture's B, G, R are multiplied with, see bake_light(); before: the light it emits
  /// itself.
  Eigen::Vector3f light{0, 0, 0};
};

/// A triangle: counter-clockwise as seen from its front.
struct Face {
  std::array<std::uint32_t, 3> vertices;
  std::uint16_t texture = 0;  ///< index into Textures
  std::uint8_t instance = 0;  ///< 0: static; else the id of a mover
  bool two_sided = false;     ///< seen from behind as well
  std::uint32_t surface = 0;  ///< equal for all facets of one smooth surface of a mesh
};

/// A solid box that keeps light away. Used for ambient occlusion and shadows only.
struct Occluder {
  Transform T_box_world;
  Eigen::Vector3f half_size;  ///< meters
};

/// Where a thing of a class that networks know stands.
struct NamedObject {
  std::string class_name;   ///< COCO's
  Eigen::AlignedBox3f box;  ///< around its vertices, along the world's axes [m]
};

struct Mesh {
  std::vector<Vertex> vertices;
  std::vector<Face> faces;
  std::vector<Occluder> occluders;
  std::vector<NamedObject> things;
};

/// A texture and how it is laid on a face.
struct Material {
  int texture = 0;                     ///< -1: no face at all
  float meters = 0;                    ///< length of one repeat; 0: stretched once over the face
  Eigen::Vector4f window{0, 0, 1, 1};  ///< u0 v0 u1 v1: the part of the texture used when stretched
  float emission = 0;                  ///< shines by itself: light of the full scale
};

/// The six sides of a box as seen by one who looks along its +y axis.
struct BoxSkin {
  BoxSkin(const Material& all)
      : front(all), back(all), left(all), right(all), top(all), bottom(all) {}
  BoxSkin(const Material& face, const Material& rest)
      : front(face), back(rest), left(rest), right(rest), top(rest), bottom(rest) {}
  Material front, back, left, right, top, bottom;
};

/// One ring of a loft: an ellipse around `center` in the loft's x-y plane.
struct Ring {
  Eigen::Vector3f center;
  float radius_x = 0, radius_y = 0;
};

/// A motion: first a turn by `yaw_degrees` about z, then a shift.
Transform place(float x, float y, float z, float yaw_degrees = 0);

/// Adds primitives to a mesh. Every primitive is given in the frame `T` of its own (meters, z up).
class MeshBuilder {
 public:
  /// @param grid longest edge of a facet, meters: light is known at the corners of the facets only
  explicit MeshBuilder(float grid = 0.15F) : grid_(grid) {}

  /// A parallelogram: `corner` upper left, `right` and `down` its edges as seen from its front.
  void quad(const Transform& T, const Eigen::Vector3f& corner, const Eigen::Vector3f& right,
            const Eigen::Vector3f& down, const Material& material, bool two_sided = false);
  /// A box that stands on the origin of T, centered in x and y. Casts shadows.
  void box(const Transform& T, const Eigen::Vector3f& size, const BoxSkin& skin,
           bool casts_shadow = true);
  /// An upright cylinder or cone frustum that stands on the origin of T.
  void cylinder(const Transform& T, float bottom_radius, float top_radius, float height,
                const Material& side, const Material& cap, int sides = 20);
  /// An ellipsoid around the origin of T. Its texture goes once around, top to bottom; u = 0.5 is
  /// -y.
  void ellipsoid(const Transform& T, const Eigen::Vector3f& radii, const Material& material,
                 int sides = 20);
  /// A tube through `rings`, from the first (texture v = 1) to the last (v = 0); u = 0.5 is -y. The
  /// ends stay open: end in a ring of radius 0 to close one.
  void loft(const Transform& T, std::span<const Ring> rings, const Material& material,
            int sides = 16);
  /// A strip between two edges, two-sided: a leaf.
  void patch(const Transform& T, std::span<const Eigen::Vector3f> left,
             std::span<const Eigen::Vector3f> right, const Material& material);
  /// Longest edge of the facets of quads and boxes from now on [m].
  void set_grid(float grid) { grid_ = grid; }
  float grid() const { return grid_; }
  /// Something that casts shadows only: a box centered on its frame.
  void occluder(const Transform& T_world_box, const Eigen::Vector3f& size);

  /// All that was added since there were `first` vertices is a thing of this class.
  void name_since(std::size_t first, const char* class_name);

  const Mesh& mesh() const { return mesh_; }
  Mesh take() { return std::move(mesh_); }

 private:
  void add_grid(int columns, int rows, int texture, bool two_sided, std::uint32_t first);

  float grid_;
  std::uint32_t surfaces_ = 0;
  Mesh mesh_;
};

/// The mesh in another frame, all faces with the given instance.
void append_transformed(const Mesh& mesh, const Transform& T, std::uint8_t instance, Mesh& to);

}  // namespace stillmap::simulate
