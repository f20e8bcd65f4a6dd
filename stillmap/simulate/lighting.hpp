// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mesh.hpp"

#include <vector>

namespace stillmap::simulate {

/// A small lamp. Its light falls off with the cosine to `direction`; a zero direction radiates in
/// all directions.
struct Lamp {
  Eigen::Vector3f position;  ///< World position [m].
  Eigen::Vector3f power;     ///< Power (B G R); 1 lights a white surface 1 m below to full scale.
  Eigen::Vector3f direction = Eigen::Vector3f::Zero();
};

struct Lighting {
  Eigen::Vector3f ambient{0.3F, 0.3F, 0.3F};  ///< Ambient light (B G R) [share of full scale].
  std::vector<Lamp> lamps;
};

/// A sphere that occludes ambient light: the soft contact shadow of a moving object.
struct ShadowBall {
  Eigen::Vector3f center;  ///< World position [m].
  float radius = 0;        ///< Radius [m].
};

/// Computes the light of every vertex: lamps with shadows and ambient light with occlusion, both
/// from the mesh's own occluders. Light is stored as its square root: textures contain display
/// values, and with a display gamma of 2 the square roots multiply like light.
/// @param threads number of threads; the result does not depend on it
void bake_light(const Lighting& lighting, Mesh& mesh, int threads = 1);

/// Computes the light of a moving object, without shadows.
void light_mover(const Lighting& lighting, Mesh& mesh);

/// Darkens the vertices of a lit mesh near the spheres. Occlusion of a sphere: Quilez 2006, "Sphere
/// ambient occlusion": cos(angle to its center) * radius^2 / distance^2.
void darken(const std::vector<ShadowBall>& balls, Mesh& mesh);

}  // namespace stillmap::simulate
