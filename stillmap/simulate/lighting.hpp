// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mesh.hpp"

#include <vector>

namespace stillmap::simulate {

/// A small lamp. Its light falls off with the cosine to `direction`; a zero direction shines all
/// around.
struct Lamp {
  Eigen::Vector3f position;  ///< meters, world
  Eigen::Vector3f power;     ///< B G R; 1 lights a white surface 1 m below to full scale
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();
};

struct Lighting {
  Eigen::Vector3f ambient{0.3F, 0.3F, 0.3F};  ///< B G R, of the full scale
  std::vector<Lamp> lamps;
};

/// A ball that takes ambient light away from what is near it: a moving thing's soft contact shadow.
struct ShadowBall {
  Eigen::Vector3f center;  ///< meters, world
  float radius = 0;        ///< meters
};

/// Sets the light of every vertex: lamps with shadows, ambient light with occlusion, both against
/// the mesh's own occluders. Light is stored as its square root: textures hold display values, and
/// with a display gamma of 2 the square roots multiply like the light itself.
void bake_light(const Lighting& lighting, Mesh& mesh);

/// The same for a thing that moves through the scene: without shadows.
void light_mover(const Lighting& lighting, Mesh& mesh);

/// Darkens the vertices of a baked mesh near the balls. Occlusion of a ball: Quilez 2006, "Sphere
/// ambient occlusion": cos(angle to its center) * radius^2 / distance^2.
void darken(const std::vector<ShadowBall>& balls, Mesh& mesh);

}  // namespace stillmap::simulate
