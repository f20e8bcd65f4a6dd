// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/lighting.hpp"

#include "stillmap/base/parallel_for.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap::simulate {
namespace {

using Eigen::Vector3f;

constexpr float kOffset = 0.015F;      // Distance of a ray's origin above its surface [m].
constexpr float kAmbientReach = 0.9F;  // Maximum distance of ambient occlusion [m].
constexpr int kAmbientRays = 14;       // Number of ambient rays per vertex.
constexpr float kSmall = 0.12F;     // Minimum half size of an object that casts lamp shadows [m].
constexpr float kLampSize = 0.35F;  // Size of a lamp, which bounds the light near it [m].
constexpr float kBounce = 0.3F;     // Minimum share of ambient light in corners.

/// Returns whether the segment from p to p + d intersects the box (slab test, Kay and Kajiya 1986).
bool blocks(const Occluder& box, const Vector3f& p, const Vector3f& d) {
  const Vector3f o = box.T_box_world * p, v = box.T_box_world.linear() * d;
  float near = 0, far = 1;
  for (int i = 0; i < 3; ++i) {
    const float inverse = 1 / (std::abs(v[i]) > 1e-9F ? v[i] : 1e-9F);
    const float a = (-box.half_size[i] - o[i]) * inverse, b = (box.half_size[i] - o[i]) * inverse;
    near = std::max(near, std::min(a, b));
    far = std::min(far, std::max(a, b));
    if (near > far) return false;
  }
  return true;
}

bool any_blocks(const std::vector<const Occluder*>& boxes, const Vector3f& p, const Vector3f& d) {
  return std::any_of(boxes.begin(), boxes.end(),
                     [&](const Occluder* box) { return blocks(*box, p, d); });
}

/// Directions over the upper hemisphere with cosine density (Malley's method on a Fibonacci
/// spiral).
std::vector<Vector3f> cosine_directions() {
  std::vector<Vector3f> directions;
  for (int i = 0; i < kAmbientRays; ++i) {
    const float s = (static_cast<float>(i) + 0.5F) / kAmbientRays;
    const float a = 2.39996323F * static_cast<float>(i);  // the golden angle
    directions.emplace_back(std::sqrt(s) * std::cos(a), std::sqrt(s) * std::sin(a),
                            std::sqrt(1 - s));
  }
  return directions;
}

Vector3f from_lamp(const Lamp& lamp, const Vector3f& p, const Vector3f& n) {
  const Vector3f to_lamp = lamp.position - p;
  const float distance = to_lamp.norm();
  const float cosine = n.dot(to_lamp) / distance;
  if (cosine <= 0) return Vector3f::Zero();
  const bool all_around = lamp.direction.isZero();
  const float emitted = all_around ? 1 : std::max(0.0F, -lamp.direction.dot(to_lamp) / distance);
  return lamp.power * (cosine * emitted / (distance * distance + kLampSize * kLampSize));
}

Vector3f encode(const Vector3f& light) { return light.cwiseMax(0).cwiseSqrt(); }

/// Occluders sorted by their distance to the query points.
class Surroundings {
 public:
  explicit Surroundings(const std::vector<Occluder>& all) {
    for (const Occluder& box : all) {
      all_.push_back(&box);
      if (box.half_size.maxCoeff() > kSmall) large_.push_back(&box);
    }
  }

  /// Returns the occluders within reach of p. Neighboring vertices are consecutive, so the last
  /// result is often reused.
  const std::vector<const Occluder*>& near(const Vector3f& p) {
    constexpr float kSlack = 0.5F;
    if (!near_valid_ || (p - center_).norm() > kSlack) {
      center_ = p;
      near_valid_ = true;
      near_.clear();
      for (const Occluder* box : all_) {
        const Vector3f outside = ((box->T_box_world * p).cwiseAbs() - box->half_size).cwiseMax(0);
        if (outside.norm() < kAmbientReach + kSlack + kOffset) near_.push_back(box);
      }
    }
    return near_;
  }
  const std::vector<const Occluder*>& large() const { return large_; }

 private:
  std::vector<const Occluder*> all_, large_, near_;
  Vector3f center_ = Vector3f::Zero();
  bool near_valid_ = false;
};

float openness(Surroundings& surroundings, const Vector3f& p, const Vector3f& n,
               const std::vector<Vector3f>& directions) {
  const Vector3f t = n.unitOrthogonal(), b = n.cross(t);
  int open = 0;
  for (const Vector3f& d : directions) {
    const Vector3f world = d.x() * t + d.y() * b + d.z() * n;
    open += !any_blocks(surroundings.near(p), p, kAmbientReach * world);
  }
  return static_cast<float>(open) / kAmbientRays;
}

void bake(const Lighting& lighting, const std::vector<Vector3f>& directions,
          Surroundings& surroundings, Vertex& vertex) {
  const Vector3f p = vertex.position + kOffset * vertex.normal;
  const float open = openness(surroundings, p, vertex.normal, directions);
  Vector3f light = vertex.light + lighting.ambient * (kBounce + (1 - kBounce) * open);
  for (const Lamp& lamp : lighting.lamps) {
    const Vector3f direct = from_lamp(lamp, p, vertex.normal);
    if (direct.isZero()) continue;
    if (!any_blocks(surroundings.large(), p, 0.97F * (lamp.position - p))) light += direct;
  }
  vertex.light = encode(light);
}

}  // namespace

void bake_light(const Lighting& lighting, Mesh& mesh, int threads) {
  const auto directions = cosine_directions();
  constexpr std::size_t kBlock = 512;  // vertices
  const std::size_t blocks = (mesh.vertices.size() + kBlock - 1) / kBlock;
  parallel_for(blocks, threads, [&] {
    return [&, surroundings = Surroundings(mesh.occluders)](std::size_t block) mutable {
      const std::size_t end = std::min((block + 1) * kBlock, mesh.vertices.size());
      for (std::size_t k = block * kBlock; k < end; ++k)
        bake(lighting, directions, surroundings, mesh.vertices[k]);
    };
  });
}

void light_mover(const Lighting& lighting, Mesh& mesh) {
  for (Vertex& vertex : mesh.vertices) {
    Vector3f light = lighting.ambient * (0.75F + 0.25F * vertex.normal.z());
    for (const Lamp& lamp : lighting.lamps) {
      light += 0.8F * from_lamp(lamp, vertex.position, vertex.normal);
    }
    vertex.light = encode(light);
  }
}

void darken(const std::vector<ShadowBall>& balls, Mesh& mesh) {
  for (const ShadowBall& ball : balls) {
    const float reach = 4 * ball.radius;
    for (Vertex& vertex : mesh.vertices) {
      const Vector3f d = ball.center - vertex.position;
      const float squared = d.squaredNorm();
      if (squared > reach * reach) continue;
      const float distance = std::max(std::sqrt(squared), ball.radius);
      const float cosine = std::max(0.0F, vertex.normal.dot(d) / distance);
      // Fades out toward the maximum distance, to avoid discontinuities.
      const float fade = 1 - squared / (reach * reach);
      vertex.light *= 1 - 0.75F * cosine * fade * ball.radius * ball.radius / (distance * distance);
    }
  }
}

}  // namespace stillmap::simulate
