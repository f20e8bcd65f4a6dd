// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/mover.hpp"

#include "stillmap/simulate/furniture.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f, Eigen::Vector3f;

/// Returns a smooth oscillation between 0 and 1, for a ratio of time to the duration of one way.
float to_and_fro(double seconds, double one_way) {
  return static_cast<float>(0.5 - 0.5 * std::cos(std::numbers::pi * seconds / one_way));
}

/// Returns the area-weighted centroid of the surface of all parts at a time, independent of the
/// subdivision of a part.
Eigen::Vector3d centroid_at(const Mover& mover, double seconds) {
  const auto poses = mover.T_world_part(seconds);
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  double total = 0;
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const Mesh& mesh = mover.parts[i].mesh;
    Eigen::Vector3d moment = Eigen::Vector3d::Zero();
    double area = 0;
    for (const Face& face : mesh.faces) {
      const auto corner = [&](int k) -> Eigen::Vector3d {
        return mesh.vertices[face.vertices[static_cast<std::size_t>(k)]].position.cast<double>();
      };
      const Eigen::Vector3d a = corner(0), b = corner(1), c = corner(2);
      const double twice_area = (b - a).cross(c - a).norm();
      moment += twice_area * (a + b + c) / 3;
      area += twice_area;
    }
    sum += Eigen::Isometry3d(poses[i].matrix().cast<double>()).linear() * moment +
           area * poses[i].translation().cast<double>();
    total += area;
  }
  return sum / total;
}

}  // namespace

PosedMover pose_at(const Mover& mover, double seconds) {
  PosedMover posed;
  const auto poses = mover.T_world_part(seconds);
  for (std::size_t i = 0; i < poses.size(); ++i) {
    append_transformed(mover.parts[i].mesh, poses[i], static_cast<std::uint8_t>(mover.id),
                       posed.mesh);
    for (const ShadowBall& ball : mover.parts[i].shadows) {
      posed.shadows.push_back({poses[i] * ball.center, ball.radius});
    }
  }
  posed.box.setEmpty();
  for (const Vertex& v : posed.mesh.vertices) posed.box.extend(v.position.cast<double>());
  posed.centroid = centroid_at(mover, seconds);
  return posed;
}

Eigen::Vector3d velocity_at(const Mover& mover, double seconds) {
  constexpr double kStep = 1e-3;
  return (centroid_at(mover, seconds + kStep) - centroid_at(mover, seconds - kStep)) / (2 * kStep);
}

Mover make_crate(int id, const Vector3f& pivot, Palette& palette) {
  constexpr float kRope = 0.75F, kSize = 0.34F;
  MeshBuilder builder(1);
  const std::array rope{Ring{{0, 0, -kRope}, 0.012F, 0.012F}, Ring{{0, 0, 0}, 0.012F, 0.012F}};
  builder.loft(Transform::Identity(), rope, palette.fabrics[3], 8);
  builder.ellipsoid(place(0, 0, -kRope), {0.03F, 0.02F, 0.06F}, palette.steel, 10);
  builder.box(place(0, 0, -kRope - 0.05F - kSize), {1.25F * kSize, kSize, kSize}, palette.crate);
  const Vector3f middle(0, 0, -kRope - 0.05F - kSize / 2);
  Mover mover{id, false, "crate", {{builder.take(), {{middle, kSize / 2}}}}, {}};
  mover.T_world_part = [pivot](double t) {
    constexpr double kPeriod = 2.1;  // of a pendulum of 1.1 m: 2 pi sqrt(l / g)
    const auto w = 2 * std::numbers::pi / kPeriod;
    Transform T = Transform::Identity();
    T.translate(pivot);
    T.rotate(Eigen::AngleAxisf(static_cast<float>(0.34 * std::sin(w * t)), Vector3f::UnitY()));
    T.rotate(Eigen::AngleAxisf(static_cast<float>(0.14 * std::cos(w * t)), Vector3f::UnitX()));
    T.rotate(Eigen::AngleAxisf(static_cast<float>(0.6 * std::sin(0.7 * t)), Vector3f::UnitZ()));
    return std::vector{T};
  };
  return mover;
}

Mover make_pushed_chair(int id, const Vector2f& from, const Vector2f& to, Palette& palette) {
  MeshBuilder builder(0.2F);
  furniture::office_chair(builder, palette, Transform::Identity(), 1);
  Mover mover{
      id,
      false,
      "chair",
      {{builder.take(), {{{0, 0, 0.4F}, 0.22F}, {{0, 0, 0.1F}, 0.14F}, {{0, 0.2F, 0.7F}, 0.16F}}}},
      {}};
  mover.T_world_part = [from, to](double t) {
    const Vector2f p = from + to_and_fro(t + 0.4, 3.4) * (to - from);
    return std::vector{place(p.x(), p.y(), 0, static_cast<float>(60 + 40 * std::sin(0.8 * t)))};
  };
  return mover;
}

Mover make_ball(int id, const Vector2f& from, const Vector2f& to, Palette& palette) {
  constexpr float kRadius = 0.13F;
  MeshBuilder builder(1);
  builder.ellipsoid(Transform::Identity(), Vector3f::Constant(kRadius), palette.ball, 28);
  Mover mover{id, false, "ball", {{builder.take(), {{{0, 0, 0}, kRadius}}}}, {}};
  mover.T_world_part = [from, to](double t) {
    const float rolled = to_and_fro(t + 0.3, 2.2) * (to - from).norm();
    const Vector2f along = (to - from).normalized();
    const Vector2f p = from + rolled * along;
    Transform T = place(p.x(), p.y(), kRadius);
    T.rotate(Eigen::AngleAxisf(rolled / kRadius, Vector3f(-along.y(), along.x(), 0)));
    return std::vector{T};
  };
  return mover;
}

Mover make_hook(int id, const Trolley& trolley, double pace, bool loaded, Palette& palette) {
  constexpr float kBlock = 0.3F;
  const float kRope = loaded ? 0.45F : 1.3F;
  MeshBuilder builder(1);
  for (const float x : {-0.07F, 0.07F}) {
    const std::array rope{Ring{{x, 0, -kRope}, 0.012F, 0.012F}, Ring{{x, 0, 0.4F}, 0.012F, 0.012F}};
    builder.loft(Transform::Identity(), rope, palette.fabrics[3], 8);
  }
  builder.box(place(0, 0, -kRope - kBlock), {kBlock, 0.16F, kBlock}, palette.crate);
  const float z = -kRope - kBlock;
  const std::array hook{Ring{{0, 0, z}, 0.03F, 0.03F}, Ring{{0, 0, z - 0.12F}, 0.03F, 0.03F},
                        Ring{{0.09F, 0, z - 0.22F}, 0.035F, 0.03F},
                        Ring{{0, 0, z - 0.3F}, 0.035F, 0.03F},
                        Ring{{-0.09F, 0, z - 0.22F}, 0.015F, 0.015F}};
  builder.loft(Transform::Identity(), hook, palette.steel, 10);
  const Vector3f middle(0, 0, -kRope - kBlock / 2);
  std::vector<ShadowBall> shadows{{middle, kBlock / 2}};
  if (loaded) {
    const Vector3f load(1.45F, 0.82F, 0.65F);  // sides [m]
    const float bottom = z - 0.3F - load.z();
    builder.box(place(0, 0, bottom), load, palette.crate);
    for (const float x : {-0.4F, 0.0F, 0.4F})
      shadows.push_back({{x, 0, bottom + load.z() / 2}, load.z() / 2});
  }
  Mover mover{id, false, "hook", {{builder.take(), shadows}}, {}};
  mover.T_world_part = [trolley, pace](double t) {
    constexpr double kPeriod = 2.5;               // of a pendulum of 1.55 m: 2 pi sqrt(l / g)
    const Vector3f offset(-0.25F, 1.75F, 0.45F);  // from the camera to the pulleys [m]
    const auto w = 2 * std::numbers::pi / kPeriod;
    Transform T = Transform::Identity();
    T.translate(Vector3f(trolley.at(t * pace).cast<float>() + offset));
    T.rotate(Eigen::AngleAxisf(static_cast<float>(0.16 * std::sin(w * t)), Vector3f::UnitY()));
    T.rotate(Eigen::AngleAxisf(static_cast<float>(0.1 * std::cos(w * t)), Vector3f::UnitX()));
    return std::vector{T};
  };
  return mover;
}

Mover make_vehicle(int id, const Vector2f& from, const Vector2f& to, Palette& palette) {
  constexpr float kLength = 1.3F, kWidth = 0.75F, kDeck = 0.45F;
  MeshBuilder builder(0.3F);
  builder.box(place(0, 0, 0.12F), {kLength, kWidth, kDeck - 0.12F}, palette.crate);
  builder.box(place(-0.45F, 0, kDeck), {0.3F, kWidth, 0.6F}, palette.drawers[1]);
  builder.box(place(0.25F, 0.02F, kDeck, 8), {0.6F, 0.5F, 0.4F}, palette.cardboard);
  for (const float x : {-0.45F, 0.45F}) {
    for (const float y : {-0.3F, 0.3F})
      builder.cylinder(place(x, y, 0), 0.12F, 0.12F, 0.13F, palette.black, palette.black);
  }
  Mover mover{id,
              false,
              "vehicle",
              {{builder.take(), {{{-0.4F, 0, 0.2F}, 0.3F}, {{0.4F, 0, 0.2F}, 0.3F}}}},
              {}};
  mover.T_world_part = [from, to](double t) {
    constexpr double kMeanSpeed = 0.6;  // m/s
    const Vector2f way = to - from;
    const Vector2f p = from + to_and_fro(t, way.norm() / kMeanSpeed) * way;
    const auto yaw = static_cast<float>(std::atan2(way.y(), way.x()) * 180 / std::numbers::pi);
    return std::vector{place(p.x(), p.y(), 0, yaw)};
  };
  return mover;
}

}  // namespace stillmap::simulate
