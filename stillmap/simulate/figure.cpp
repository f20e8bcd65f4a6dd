// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/figure.hpp"

#include "stillmap/simulate/furniture.hpp"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f, Eigen::Vector3f;
constexpr float kPi = std::numbers::pi_v<float>;
constexpr float kDegree = kPi / 180;

// Segment lengths of an adult of 1.75 m, metres (after Winter 2009, Biomechanics, figure 4.1).
constexpr float kThigh = 0.43F, kShank = 0.43F, kAnkle = 0.08F, kHipHalf = 0.095F;
constexpr float kUpperArm = 0.29F, kForearm = 0.26F, kShoulderHalf = 0.195F,
                kShoulderHeight = 0.49F;
constexpr float kNeckHeight = 0.56F, kStandingPelvis = 0.90F, kStep = 0.5F;

/// Parts in the order of Mover::parts. Left is +x, as the figure faces -y.
enum Part {
  kPelvis,
  kTorso,
  kHead,
  kLeftUpperArm,
  kRightUpperArm,
  kLeftForearm,
  kRightForearm,
  kLeftThigh,
  kRightThigh,
  kLeftShank,
  kRightShank,
  kLeftFoot,
  kRightFoot,
  kParts
};

struct Arm {
  float raise = 0, spread = 0, elbow = 0;  ///< degrees: forward, sideways, bend
  Vector3f towards{0, -1, 0.2F};           ///< where the elbow bends to, in the torso's frame
};
struct Foot {
  Vector3f ankle;    ///< world
  Vector3f forward;  ///< world, level
  float pitch = 0;   ///< degrees, toes down
};
struct Posture {
  Transform T_world_pelvis;   ///< level; faces -y
  float lean = 0, twist = 0;  ///< degrees, of the torso: forward, to the left
  float nod = 0, turn = 0;    ///< degrees, of the head
  std::array<Arm, 2> arms;    ///< left, right
  std::array<Foot, 2> feet;
};

/// A limb's frame: its bone points along -z from `origin`, its front (-y) as near to `front` as can
/// be.
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
  const Vector3f sideways = (arm.towards - arm.towards.dot(upper) * upper).normalized();
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

/// Who this person is: clothes, skin, hair, height.
struct Looks {
  float scale;
  Material shirt, sleeve, forearm, trousers, shoe, face, skin, hair;
};

Looks dress(int number, Palette& palette) {
  Random& random = palette.random;
  const std::array skins{cv::Scalar(140, 172, 222), cv::Scalar(78, 108, 164),
                         cv::Scalar(120, 156, 206), cv::Scalar(52, 74, 116)};
  const std::array hairs{cv::Scalar(30, 44, 66), cv::Scalar(18, 18, 22), cv::Scalar(70, 120, 160),
                         cv::Scalar(22, 28, 36)};
  const auto k = static_cast<std::size_t>(number) % skins.size();
  const int kind = number + 2;
  const cv::Mat shirt = paint::shirt(kind, random);
  Looks looks{.scale = random.real(0.96, 1.05),
              .shirt = palette.add(shirt),
              .sleeve = palette.add(paint::sleeve(kind, shirt)),
              .forearm = {},
              .trousers = palette.add(paint::trousers(number, random)),
              .shoe = palette.add(paint::shoe(random)),
              .face = palette.add(paint::face(skins[k], hairs[k], random)),
              .skin = palette.add(paint::skin(skins[k], random)),
              .hair = palette.add(paint::hair(hairs[k], random))};
  looks.forearm = kind % 5 == 2 ? looks.skin : looks.sleeve;
  return looks;
}

/// Builds the parts of a figure; lengths below are for scale 1.
class Tailor {
 public:
  explicit Tailor(const Looks& looks) : looks_(looks) {}

  std::vector<RigidPart> parts() const {
    std::vector<RigidPart> parts;
    parts.push_back(pelvis());
    parts.push_back(torso());
    parts.push_back(head());
    for (int i = 0; i < 2; ++i) parts.push_back(upper_arm());
    for (int i = 0; i < 2; ++i) parts.push_back(forearm());
    for (int i = 0; i < 2; ++i) parts.push_back(thigh());
    for (int i = 0; i < 2; ++i) parts.push_back(shank());
    for (int i = 0; i < 2; ++i) parts.push_back(foot());
    return parts;
  }

 private:
  /// height, half width, half depth, shift forward
  using Profile = std::vector<std::array<float, 4>>;

  void loft(MeshBuilder& to, const Profile& profile, const Material& material,
            int sides = 18) const {
    std::vector<Ring> rings;
    for (const auto& [z, x, y, forward] : profile) {
      rings.push_back(
          {looks_.scale * Vector3f(0, -forward, z), looks_.scale * x, looks_.scale * y});
    }
    to.loft(Transform::Identity(), rings, material, sides);
  }

  RigidPart pelvis() const {
    MeshBuilder to;
    loft(to,
         {{-0.13F, 0.02F, 0.02F, 0},
          {-0.11F, 0.11F, 0.09F, 0},
          {-0.05F, 0.165F, 0.12F, 0},
          {0.03F, 0.168F, 0.118F, 0},
          {0.08F, 0.155F, 0.108F, 0}},
         looks_.trousers);
    return {to.take(), {{{0, 0, -0.05F}, 0.17F}}};
  }

  RigidPart torso() const {
    MeshBuilder to;
    loft(to,
         {{-0.02F, 0.17F, 0.122F, 0},
          {0.1F, 0.16F, 0.115F, 0.005F},
          {0.22F, 0.15F, 0.108F, 0},
          {0.34F, 0.17F, 0.12F, 0.005F},
          {0.43F, 0.187F, 0.115F, 0},
          {0.49F, 0.185F, 0.1F, -0.005F},
          {0.53F, 0.135F, 0.08F, -0.01F},
          {0.56F, 0.075F, 0.065F, -0.01F},
          {0.575F, 0.06F, 0.058F, -0.01F}},
         looks_.shirt, 24);
    return {to.take(), {{{0, 0, 0.25F}, 0.2F}}};
  }

  RigidPart head() const {
    MeshBuilder to;
    const float s = looks_.scale;
    loft(to, {{-0.05F, 0.056F, 0.06F, 0}, {0.09F, 0.052F, 0.055F, 0.01F}}, looks_.skin, 14);
    loft(to,
         {{0.035F, 0.0F, 0.0F, 0.045F},
          {0.045F, 0.03F, 0.04F, 0.04F},
          {0.065F, 0.05F, 0.068F, 0.025F},
          {0.1F, 0.066F, 0.088F, 0.016F},
          {0.15F, 0.076F, 0.098F, 0.01F},
          {0.19F, 0.077F, 0.1F, 0.006F},
          {0.225F, 0.07F, 0.09F, 0.0F},
          {0.255F, 0.045F, 0.06F, 0},
          {0.268F, 0, 0, 0}},
         looks_.face, 24);
    to.ellipsoid(place(0, -0.112F * s, 0.135F * s), s * Vector3f(0.014F, 0.02F, 0.026F),
                 looks_.skin, 10);
    for (const float side : {-1.0F, 1.0F}) {
      to.ellipsoid(place(side * 0.079F * s, 0.0F, 0.145F * s), s * Vector3f(0.012F, 0.022F, 0.034F),
                   looks_.skin, 10);
    }
    loft(to,
         {{0.07F, 0.05F, 0.05F, -0.05F},
          {0.11F, 0.075F, 0.075F, -0.038F},
          {0.17F, 0.084F, 0.09F, -0.027F},
          {0.205F, 0.085F, 0.102F, -0.012F},
          {0.24F, 0.072F, 0.095F, 0.0F},
          {0.27F, 0.045F, 0.06F, 0},
          {0.286F, 0, 0, 0}},
         looks_.hair, 20);
    return {to.take(), {}};
  }

  RigidPart upper_arm() const {
    MeshBuilder to;
    loft(to,
         {{-0.31F, 0.03F, 0.03F, 0},
          {-0.29F, 0.045F, 0.045F, 0},
          {-0.16F, 0.05F, 0.052F, 0},
          {-0.05F, 0.057F, 0.06F, 0},
          {0.0F, 0.056F, 0.06F, 0},
          {0.035F, 0.035F, 0.04F, 0},
          {0.045F, 0, 0, 0}},
         looks_.sleeve);
    return {to.take(), {}};
  }

  RigidPart forearm() const {
    MeshBuilder to;
    const float s = looks_.scale;
    loft(to,
         {{-0.265F, 0.026F, 0.03F, 0},
          {-0.2F, 0.032F, 0.034F, 0},
          {-0.08F, 0.042F, 0.042F, 0},
          {0.0F, 0.042F, 0.042F, 0},
          {0.035F, 0.02F, 0.02F, 0},
          {0.04F, 0, 0, 0}},
         looks_.forearm, 16);
    to.ellipsoid(place(0, 0, -0.33F * s), s * Vector3f(0.02F, 0.042F, 0.085F), looks_.skin, 14);
    to.ellipsoid(place(0, -0.045F * s, -0.31F * s), s * Vector3f(0.014F, 0.016F, 0.042F),
                 looks_.skin, 10);
    return {to.take(), {{{0, 0, -0.3F}, 0.06F}}};
  }

  RigidPart thigh() const {
    MeshBuilder to;
    loft(to,
         {{-0.46F, 0.03F, 0.03F, 0},
          {-0.43F, 0.06F, 0.064F, 0},
          {-0.25F, 0.072F, 0.08F, 0},
          {-0.06F, 0.086F, 0.096F, 0},
          {0.04F, 0.075F, 0.085F, 0},
          {0.07F, 0, 0, 0}},
         looks_.trousers);
    return {to.take(), {{{0, 0, -0.3F}, 0.09F}}};
  }

  RigidPart shank() const {
    MeshBuilder to;
    loft(to,
         {{-0.42F, 0.052F, 0.058F, 0},
          {-0.36F, 0.05F, 0.055F, 0},
          {-0.15F, 0.058F, 0.064F, -0.01F},
          {-0.02F, 0.058F, 0.062F, 0},
          {0.04F, 0.04F, 0.04F, 0},
          {0.055F, 0, 0, 0}},
         looks_.trousers);
    return {to.take(), {}};
  }

  RigidPart foot() const {
    MeshBuilder to;
    const float s = looks_.scale;
    to.ellipsoid(place(0, -0.075F * s, -0.04F * s), s * Vector3f(0.047F, 0.14F, 0.04F), looks_.shoe,
                 18);
    to.ellipsoid(place(0, 0, -0.02F * s), s * Vector3f(0.04F, 0.055F, 0.055F), looks_.shoe, 14);
    return {to.take(), {{{0, -0.06F, -0.03F}, 0.1F}}};
  }

  Looks looks_;
};

Mover make_person(int id, int number, Palette& palette,
                  std::function<Posture(double, float)> posture) {
  const Looks looks = dress(number, palette);
  Mover mover{id, true, "person", Tailor(looks).parts(), {}};
  mover.T_world_part = [posture = std::move(posture), scale = looks.scale](double t) {
    return part_poses(posture(t, scale), scale);
  };
  return mover;
}

float wave(double t, double period, double phase = 0) {
  return static_cast<float>(std::sin(2 * std::numbers::pi * (t / period + phase)));
}

float smooth(float s) { return s * s * (3 - 2 * s); }

/// The foot of one side when the body has walked `arc`. Foot k stands on arc k * kStep from when
/// the body is 0.6 steps before it until 0.6 steps behind it, then swings ahead to k + 2.
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

Posture walking(const Walking& w, double t, float scale) {
  const double arc = w.start + w.speed * t;
  const Vector2f at = w.path.at(arc), heading = w.path.heading(arc);
  const float yaw = std::atan2(heading.y(), heading.x()) / kDegree + 90;
  const float bob = 0.016F * wave(arc, kStep, 0.25), sway = 0.02F * wave(arc, 2 * kStep, 0.25);
  Posture posture;
  posture.T_world_pelvis =
      place(at.x(), at.y(), kStandingPelvis * scale + bob, yaw) * place(sway, 0, 0);
  const float swing = wave(arc, 2 * kStep, 0.25);  // 1 where the left foot stands below the body
  const float ahead = wave(arc, 2 * kStep);        // and this a quarter of a stride later
  posture.lean = 4;
  posture.twist = 6 * ahead;
  posture.turn = -5 * ahead + 16 * wave(t, 5.3);
  posture.nod = 4 + 3 * swing;
  posture.arms[0] = {.raise = -22 * -ahead, .spread = 8, .elbow = 22 + 12 * ahead};
  posture.arms[1] = {.raise = -22 * ahead, .spread = 8, .elbow = 22 - 12 * ahead};
  for (const int side : {0, 1}) {
    posture.feet[static_cast<std::size_t>(side)] = walking_foot(w.path, arc, side, scale);
  }
  return posture;
}

/// Sits and types, looks around, and speaks with the right hand now and then.
Posture sitting(const Sitting& s, double t, float scale, double phase) {
  Posture posture;
  posture.T_world_pelvis = s.seat * place(0.01F * wave(t, 5.1, phase), 0.02F,
                                          furniture::kSeatHeight + 0.1F, 5 * wave(t, 7.3, phase));
  posture.lean = 5 + 4 * wave(t, 6.1, phase);
  posture.twist = 6 * wave(t, 8.7, phase);
  posture.turn = 26 * wave(t, 6.7, phase);
  posture.nod = 7 + 6 * wave(t, 3.1, phase);
  const float speak = smooth(std::clamp(2 * wave(t, 9, phase), 0.0F, 1.0F));
  posture.arms[0] = {.raise = 34 + 3 * wave(t, 0.9), .spread = 10, .elbow = 62 + 5 * wave(t, 0.45)};
  posture.arms[1] = {.raise = 34 + speak * 22,
                     .spread = 10 + 12 * speak,
                     .elbow = 62 + 5 * wave(t, 0.52) + speak * (30 + 16 * wave(t, 1.1)),
                     .towards = {0, -1, 0.2F + 0.6F * speak}};
  const Vector3f front = s.seat.linear() * Vector3f(0, -1, 0);
  for (const float side : {1.0F, -1.0F}) {
    posture.feet[side > 0 ? 0 : 1] = {s.seat * Vector3f(side * 0.13F, -0.42F, kAnkle * scale),
                                      front, 0};
  }
  return posture;
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
                     .towards = {0.75F * wave(t, 1.3, phase) - 0.1F, -0.3F, 1}};
  const Vector3f front = w.place.linear() * Vector3f(0, -1, 0);
  for (const float side : {1.0F, -1.0F}) {
    posture.feet[side > 0 ? 0 : 1] = {w.place * Vector3f(side * 0.12F, 0, kAnkle * scale), front,
                                      0};
  }
  return posture;
}

/// A point on the Catmull-Rom spline between b and c.
Vector2f catmull_rom(const Vector2f& a, const Vector2f& b, const Vector2f& c, const Vector2f& d,
                     float s) {
  return 0.5F * (2 * b + (c - a) * s + (2 * a - 5 * b + 4 * c - d) * s * s +
                 (3 * b - a - 3 * c + d) * s * s * s);
}

}  // namespace

Path::Path(const std::vector<Vector2f>& corners) {
  constexpr int kFine = 200;
  constexpr float kSpacing = 0.01F;
  const std::size_t n = corners.size();
  std::vector<Vector2f> fine;
  for (std::size_t i = 0; i < n; ++i) {
    for (int k = 0; k < kFine; ++k) {
      fine.push_back(catmull_rom(corners[(i + n - 1) % n], corners[i], corners[(i + 1) % n],
                                 corners[(i + 2) % n], static_cast<float>(k) / kFine));
    }
  }
  fine.push_back(fine.front());
  std::vector<float> walked{0};
  for (std::size_t i = 1; i < fine.size(); ++i) {
    walked.push_back(walked.back() + (fine[i] - fine[i - 1]).norm());
  }
  length_ = walked.back();
  const auto count = static_cast<std::size_t>(std::lround(length_ / kSpacing));
  std::size_t i = 1;
  for (std::size_t k = 0; k < count; ++k) {
    const float arc = length_ * static_cast<float>(k) / static_cast<float>(count);
    while (walked[i] < arc) ++i;
    const float s = (arc - walked[i - 1]) / (walked[i] - walked[i - 1]);
    points_.push_back(fine[i - 1] + s * (fine[i] - fine[i - 1]));
  }
}

Vector2f Path::at(double arc) const {
  const double turn = arc / length_ - std::floor(arc / length_);
  const double s = turn * static_cast<double>(points_.size());
  const auto i = static_cast<std::size_t>(s) % points_.size();
  const auto f = static_cast<float>(s - std::floor(s));
  return points_[i] + f * (points_[(i + 1) % points_.size()] - points_[i]);
}

Vector2f Path::heading(double arc) const { return (at(arc + 0.15) - at(arc - 0.15)).normalized(); }

Mover make_walker(int id, int number, const Walking& walk, Palette& palette) {
  return make_person(id, number, palette,
                     [walk](double t, float scale) { return walking(walk, t, scale); });
}

Mover make_sitter(int id, int number, const Sitting& sit, Palette& palette) {
  return make_person(id, number, palette, [sit, phase = 0.31 * number](double t, float scale) {
    return sitting(sit, t, scale, phase);
  });
}

Mover make_waver(int id, int number, const Waving& wave, Palette& palette) {
  return make_person(id, number, palette, [wave, phase = 0.37 * number](double t, float scale) {
    return waving(wave, t, scale, phase);
  });
}

}  // namespace stillmap::simulate
