// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/figure_body.hpp"

#include <array>

namespace stillmap::simulate {
namespace {

using Eigen::Vector3f;

/// Appearance of a person: clothes, skin, hair, height.
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

/// Builds the parts of a figure; the lengths below are for scale 1.
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
  /// Sections of a body part: height, half width, half depth, shift forward [m].
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

}  // namespace

FigureBody make_figure_body(int number, Palette& palette) {
  const Looks looks = dress(number, palette);
  return {looks.scale, Tailor(looks).parts()};
}

}  // namespace stillmap::simulate
