// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/figure.hpp"

#include "stillmap/simulate/figure_body.hpp"
#include "stillmap/simulate/furniture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f, Eigen::Vector3f;
constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kDegree = kPi / 180;

struct Arm {
  float raise = 0, spread = 0, elbow = 0;  ///< Angles forward, sideways, bend [degrees].
  Vector3f toward{0, -1, 0.2F};            ///< Bending direction of the elbow, in the torso's frame
};
struct Foot {
  Vector3f ankle;    ///< World position [m].
  Vector3f forward;  ///< Horizontal direction, world frame.
  float pitch = 0;   ///< Angle, toes down [degrees].
};
struct Posture {
  Transform T_world_pelvis;   ///< Level; faces -y.
  float lean = 0, twist = 0;  ///< Angles of the torso forward and to the left [degrees].
  float nod = 0, turn = 0;    ///< Angles of the head [degrees].
  std::array<Arm, 2> arms;    ///< Left, right.
  std::array<Foot, 2> feet;
};

/// Returns the frame of a limb: its bone along -z from `origin`, its front (-y) as close to `front`
/// as possible.
Transform limb_frame(const Vector3f& origin, const Vector3f& bone, const Vector3f& front) {
  const Vector3f z = -bone.normalized();
  const Vector3f y = -(front - front.dot(z) * z).normalized();
  Transform T = Transform::Identity();
  T.linear().col(0) = y.cross(z);
  T.linear().col(1) = y;
  T.linear().col(2) = z;
  T.translation() = origin;
  return T;
}

Transform turned(const Transform& T, float degrees, const Vector3f& axis) {
  return T * Eigen::AngleAxisf(degrees * kDegree, axis);
}

/// Two-bone inverse kinematics: the knee for a hip, an ankle and the direction it bends to.
Vector3f knee_between(const Vector3f& hip, const Vector3f& ankle, const Vector3f& front,
                      float scale) {
  const float a = kThigh * scale, b = kShank * scale;
  const float d = std::clamp((ankle - hip).norm(), 0.2F, a + b - 1e-3F);
  const Vector3f along = (ankle - hip).normalized();
  const Vector3f bend = (front - front.dot(along) * along).normalized();
  const float s = (a * a - b * b + d * d) / (2 * d);
  return hip + s * along + std::sqrt(std::max(0.0F, a * a - s * s)) * bend;
}

void pose_arm(const Posture& posture, const Transform& torso, int side, float scale,
              std::vector<Transform>& T) {
  const Arm& arm = posture.arms[static_cast<std::size_t>(side)];
  const float outward = side == 0 ? 1.0F : -1.0F;
  const float raise = arm.raise * kDegree, spread = arm.spread * kDegree,
              bend = arm.elbow * kDegree;
  const Vector3f upper(outward * std::sin(spread), -std::sin(raise) * std::cos(spread),
                       -std::cos(raise) * std::cos(spread));
  const Vector3f sideways = (arm.toward - arm.toward.dot(upper) * upper).normalized();
  const Vector3f fore = std::cos(bend) * upper + std::sin(bend) * sideways;
  const Vector3f shoulder =
      torso * Vector3f(outward * kShoulderHalf * scale, 0, kShoulderHeight * scale);
  const Vector3f front = torso.linear() * sideways;
  const Vector3f elbow = shoulder + kUpperArm * scale * (torso.linear() * upper);
  const Vector3f hint = bend > 0.05F ? front : Vector3f(torso.linear() * Vector3f(0, -1, 0));
  T[static_cast<std::size_t>(kLeftUpperArm + side)] = limb_frame(shoulder, elbow - shoulder, hint);
  T[static_cast<std::size_t>(kLeftForearm + side)] = limb_frame(
      elbow, torso.linear() * fore, bend > 0.05F ? Vector3f(-(torso.linear() * upper)) : hint);
}

void pose_leg(const Posture& posture, int side, float scale, std::vector<Transform>& T) {
  const Foot& foot = posture.feet[static_cast<std::size_t>(side)];
  const float outward = side == 0 ? 1.0F : -1.0F;
  const Transform& pelvis = posture.T_world_pelvis;
  const Vector3f hip = pelvis * Vector3f(outward * kHipHalf * scale, 0, -0.03F * scale);
  const Vector3f front = pelvis.linear() * Vector3f(0, -1, 0);
  const Vector3f knee = knee_between(hip, foot.ankle, front, scale);
  const Vector3f shin = knee + kShank * scale * (foot.ankle - knee).normalized();
  T[static_cast<std::size_t>(kLeftThigh + side)] = limb_frame(hip, knee - hip, front);
  T[static_cast<std::size_t>(kLeftShank + side)] = limb_frame(knee, shin - knee, front);
  T[static_cast<std::size_t>(kLeftFoot + side)] =
      turned(limb_frame(shin, -Vector3f::UnitZ(), foot.forward), foot.pitch, Vector3f::UnitX());
}

std::vector<Transform> part_poses(const Posture& posture, float scale) {
  std::vector<Transform> T(kParts);
  T[kPelvis] = posture.T_world_pelvis;
  const Transform torso = turned(turned(posture.T_world_pelvis, posture.twist, Vector3f::UnitZ()),
                                 posture.lean, Vector3f::UnitX());
  T[kTorso] = torso;
  const Transform neck = torso * Eigen::Translation3f(0, 0.01F * scale, kNeckHeight * scale);
  T[kHead] = turned(turned(turned(neck, -0.7F * posture.lean, Vector3f::UnitX()), posture.turn,
                           Vector3f::UnitZ()),
                    posture.nod, Vector3f::UnitX());
  for (const int side : {0, 1}) {
    pose_arm(posture, torso, side, scale, T);
    pose_leg(posture, side, scale, T);
  }
  return T;
}

Mover make_person(int id, int number, Palette& palette,
                  std::function<Posture(double, float)> posture) {
  FigureBody body = make_figure_body(number, palette);
  Mover mover{id, true, "person", std::move(body.parts), {}};
  mover.T_world_part = [posture = std::move(posture), scale = body.scale](double t) {
    return part_poses(posture(t, scale), scale);
  };
  return mover;
}

float wave(double t, double period, double phase = 0) {
  return static_cast<float>(std::sin(2 * std::numbers::pi * (t / period + phase)));
}

float smooth(float s) { return s * s * (3 - 2 * s); }

/// Returns the foot of one side after the body has walked `arc`. Foot k is planted at arc k * kStep
/// while the body is between 0.6 steps before and 0.6 steps behind it, then swings to k + 2.
Foot walking_foot(const Path& path, double arc, int side, float scale) {
  const float outward = side == 0 ? 1.0F : -1.0F;
  const double pair = std::floor((arc / kStep - side + 0.6) / 2);
  const double k = 2 * pair + side;
  const auto p = static_cast<float>(arc / kStep - k);  // -0.6 .. 1.4
  const float swing = std::clamp((p - 0.6F) / 0.8F, 0.0F, 1.0F);
  const float push = smooth(std::clamp((p - 0.15F) / 0.45F, 0.0F, 1.0F));
  const float land = smooth(std::clamp((p + 0.6F) / 0.2F, 0.0F, 1.0F));
  const double at = (k + 2 * static_cast<double>(smooth(swing))) * kStep;
  const Vector2f heading = path.heading(at);
  const Vector2f place = path.at(at) + outward * 0.085F * Vector2f(-heading.y(), heading.x());
  const float toe_up = swing > 0 ? smooth(swing) : 1 - land;  // heel first
  const float pitch = swing > 0 ? 38 * (1 - smooth(swing)) - 16 * toe_up : 38 * push - 16 * toe_up;
  const float lift =
      0.055F * std::sin(kPi * swing) + 0.17F * std::sin(kDegree * std::max(0.0F, pitch));
  return {{place.x(), place.y(), (kAnkle + lift) * scale}, {heading.x(), heading.y(), 0}, pitch};
}

/// Returns the posture at time t after `arc` along the path.
Posture walking(const Path& path, double arc, double t, float scale) {
  const Vector2f at = path.at(arc), heading = path.heading(arc);
  const float yaw = std::atan2(heading.y(), heading.x()) / kDegree + 90;
  const float bob = 0.016F * wave(arc, kStep, 0.25), sway = 0.02F * wave(arc, 2 * kStep, 0.25);
  Posture posture;
  posture.T_world_pelvis =
      place(at.x(), at.y(), kStandingPelvis * scale + bob, yaw) * place(sway, 0, 0);
  const float swing = wave(arc, 2 * kStep, 0.25);  // 1 where the left foot is below the body.
  const float ahead = wave(arc, 2 * kStep);        // The same a quarter of a stride later.
  posture.lean = 4;
  posture.twist = 6 * ahead;
  posture.turn = -5 * ahead + 16 * wave(t, 5.3);
  posture.nod = 4 + 3 * swing;
  posture.arms[0] = {.raise = -22 * -ahead, .spread = 8, .elbow = 22 + 12 * ahead};
  posture.arms[1] = {.raise = -22 * ahead, .spread = 8, .elbow = 22 - 12 * ahead};
  for (const int side : {0, 1}) {
    posture.feet[static_cast<std::size_t>(side)] = walking_foot(path, arc, side, scale);
  }
  return posture;
}

Posture walking(const Walking& w, double t, float scale) {
  return walking(w.path, w.start + w.speed * t, t, scale);
}

/// A sitting person who types, looks around, and sometimes gestures with the right hand.
Posture sitting(const Sitting& s, double t, float scale, double phase) {
  const auto sway = [&](double period, double offset = 0) {
    return s.liveliness * wave(t, period, offset);
  };
  Posture posture;
  posture.T_world_pelvis = s.seat * place(0.01F * sway(5.1, phase), 0.02F,
                                          furniture::kSeatHeight + 0.1F, 5 * sway(7.3, phase));
  posture.lean = 5 + 4 * sway(6.1, phase);
  posture.twist = 6 * sway(8.7, phase);
  posture.turn = 26 * sway(6.7, phase);
  posture.nod = 7 + 6 * sway(3.1, phase);
  const float speak = s.liveliness * smooth(std::clamp(2 * wave(t, 9, phase), 0.0F, 1.0F));
  posture.arms[0] = {.raise = 34 + 3 * sway(0.9), .spread = 10, .elbow = 62 + 5 * sway(0.45)};
  posture.arms[1] = {.raise = 34 + speak * 22,
                     .spread = 10 + 12 * speak,
                     .elbow = 62 + 5 * sway(0.52) + speak * (30 + 16 * sway(1.1)),
                     .toward = {0, -1, 0.2F + 0.6F * speak}};
  const Vector3f front = s.seat.linear() * Vector3f(0, -1, 0);
  for (const float side : {1.0F, -1.0F}) {
    posture.feet[side > 0 ? 0 : 1] = {s.seat * Vector3f(side * 0.13F, -0.42F, kAnkle * scale),
                                      front, 0};
  }
  return posture;
}

float between(float a, float b, float s) { return a + s * (b - a); }

Transform between(const Transform& a, const Transform& b, float s) {
  Transform T = Transform::Identity();
  T.linear() =
      Eigen::Quaternionf(a.linear()).slerp(s, Eigen::Quaternionf(b.linear())).toRotationMatrix();
  T.translation() = a.translation() + s * (b.translation() - a.translation());
  return T;
}

Arm between(const Arm& a, const Arm& b, float s) {
  return {.raise = between(a.raise, b.raise, s),
          .spread = between(a.spread, b.spread, s),
          .elbow = between(a.elbow, b.elbow, s),
          .toward = a.toward + s * (b.toward - a.toward)};
}

/// A step from one position to another.
Foot between(const Foot& a, const Foot& b, float s) {
  Foot foot{a.ankle + s * (b.ankle - a.ankle),
            (a.forward + s * (b.forward - a.forward)).normalized(), between(a.pitch, b.pitch, s)};
  foot.ankle.z() += 0.06F * std::sin(kPi * s);
  return foot;
}

/// Interpolates between two postures, s from 0 to 1; the left foot steps first, then the right one.
Posture between(const Posture& a, const Posture& b, float s) {
  Posture posture;
  posture.T_world_pelvis = between(a.T_world_pelvis, b.T_world_pelvis, smooth(s));
  // The torso bends forward to get up.
  posture.lean = between(a.lean, b.lean, smooth(s)) + 18 * std::sin(kPi * s);
  posture.twist = between(a.twist, b.twist, s);
  posture.nod = between(a.nod, b.nod, s);
  posture.turn = between(a.turn, b.turn, s);
  for (const std::size_t side : {0U, 1U}) {
    const float begin = side == 0 ? 0.25F : 0.55F;
    const float step = smooth(std::clamp((s - begin) / 0.4F, 0.0F, 1.0F));
    posture.arms[side] = between(a.arms[side], b.arms[side], smooth(s));
    posture.feet[side] = between(a.feet[side], b.feet[side], step);
  }
  return posture;
}

/// Returns the arc length since getting up [m]; the first second accelerates.
double arc_from_rest(double seconds, double speed) {
  return seconds < 1 ? 0.5 * speed * seconds * seconds : speed * (seconds - 0.5);
}

Posture rising(const Rising& r, double t, float scale, double phase) {
  constexpr double kGettingUp = 1.8;  // seconds
  if (t <= r.at) return sitting(r.before, t, scale, phase);
  const double up = (t - r.at) / kGettingUp;
  if (up >= 1) {
    return walking(r.path, arc_from_rest(t - r.at - kGettingUp, r.speed), t, scale);
  }
  return between(sitting(r.before, t, scale, phase), walking(r.path, 0, t, scale),
                 static_cast<float>(up));
}

Posture waving(const Waving& w, double t, float scale, double phase) {
  Posture posture;
  const float sway = 0.03F * wave(t, 4.3, phase);
  posture.T_world_pelvis =
      w.place * place(sway, 0, (kStandingPelvis + 0.01F) * scale, 8 * wave(t, 6.1, phase));
  posture.lean = 2 + 2 * wave(t, 5.3, phase);
  posture.twist = 5 * wave(t, 4.9, phase);
  posture.turn = 14 * wave(t, 5.9, phase);
  posture.arms[0] = {
      .raise = 8 + 6 * wave(t, 3.9, phase), .spread = 10, .elbow = 18 + 8 * wave(t, 2.9)};
  posture.arms[1] = {.raise = 20,
                     .spread = 62 + 8 * wave(t, 1.3, 0.2),
                     .elbow = 105,
                     .toward = {0.75F * wave(t, 1.3, phase) - 0.1F, -0.3F, 1}};
  const Vector3f front = w.place.linear() * Vector3f(0, -1, 0);
  for (const float side : {1.0F, -1.0F}) {
    posture.feet[side > 0 ? 0 : 1] = {w.place * Vector3f(side * 0.12F, 0, kAnkle * scale), front,
                                      0};
  }
  return posture;
}

}  // namespace

Mover make_walker(int id, int number, const Walking& walk, Palette& palette) {
  return make_person(id, number, palette,
                     [walk](double t, float scale) { return walking(walk, t, scale); });
}

Mover make_sitter(int id, int number, const Sitting& sit, Palette& palette) {
  return make_person(id, number, palette, [sit, phase = 0.31 * number](double t, float scale) {
    return sitting(sit, t, scale, phase);
  });
}

Mover make_riser(int id, int number, const Rising& rise, Palette& palette) {
  return make_person(id, number, palette, [rise, phase = 0.31 * number](double t, float scale) {
    return rising(rise, t, scale, phase);
  });
}

Mover make_waver(int id, int number, const Waving& wave, Palette& palette) {
  return make_person(id, number, palette, [wave, phase = 0.37 * number](double t, float scale) {
    return waving(wave, t, scale, phase);
  });
}

}  // namespace stillmap::simulate
