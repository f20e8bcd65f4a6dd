// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/furniture.hpp"

#include <array>
#include <cmath>
#include <numbers>

namespace stillmap::simulate::furniture {
namespace {

using Eigen::Vector3f;
constexpr float kPi = std::numbers::pi_v<float>;

Transform tilted(const Transform& T, float degrees, const Vector3f& axis) {
  return T * Eigen::AngleAxisf(degrees * kPi / 180, axis);
}

/// Adds a thin rod from a to b.
void rod(MeshBuilder& to, const Transform& T, const Vector3f& a, const Vector3f& b, float radius,
         const Material& material, int sides = 8) {
  Transform local = T;
  local.translate(a);
  local.rotate(Eigen::Quaternionf::FromTwoVectors(Vector3f::UnitZ(), b - a));
  const float length = (b - a).norm();
  const std::array rings{Ring{{0, 0, 0}, radius, radius}, Ring{{0, 0, length}, radius, radius}};
  to.loft(local, rings, material, sides);
}

/// Names the geometry that is added within its scope.
class Named {
 public:
  Named(MeshBuilder& to, const char* class_name)
      : to_(to), first_(to.mesh().vertices.size()), class_name_(class_name) {}
  ~Named() { to_.name_since(first_, class_name_); }
  Named(const Named&) = delete;
  Named& operator=(const Named&) = delete;

 private:
  MeshBuilder& to_;
  std::size_t first_;
  const char* class_name_;
};

}  // namespace

void desk(MeshBuilder& to, Palette& palette, const Transform& T, float width, float depth) {
  const Named named(to, "dining table");
  constexpr float kTop = 0.035F, kLeg = 0.05F;
  to.box(T * place(0, 0, kDeskHeight - kTop), {width, depth, kTop}, palette.oak);
  for (const float x : {-1.0F, 1.0F}) {
    for (const float y : {-1.0F, 1.0F}) {
      to.box(T * place(x * (width / 2 - 0.06F), y * (depth / 2 - 0.06F), 0),
             {kLeg, kLeg, kDeskHeight - kTop}, palette.steel);
    }
  }
  to.box(T * place(0, depth / 2 - 0.04F, 0.3F), {width - 0.2F, 0.02F, 0.38F}, palette.white);
  to.box(T * place(width / 2 - 0.33F, 0.03F, 0.02F), {0.4F, depth - 0.2F, 0.56F},
         {palette.drawers[0], palette.white});
}

void monitor(MeshBuilder& to, Palette& palette, const Transform& T, int screen) {
  const Named named(to, "tv");
  to.box(T, {0.24F, 0.18F, 0.015F}, palette.black);
  to.box(T * place(0, 0.03F, 0.015F), {0.06F, 0.03F, 0.16F}, palette.black);
  const Transform panel = tilted(T * place(0, 0, 0.12F), -4, Vector3f::UnitX());
  to.box(panel, {0.56F, 0.035F, 0.34F}, palette.black);
  const Material& print =
      palette.screens[static_cast<std::size_t>(screen) % palette.screens.size()];
  to.quad(panel, {-0.268F, -0.019F, 0.328F}, {0.536F, 0, 0}, {0, 0, -0.31F}, print);
  to.box(panel * place(0, 0.02F, 0.1F), {0.3F, 0.02F, 0.16F}, palette.gray);
  const Transform label = panel * place(0.06F, 0.031F, 0.13F, 180);
  to.quad(label, {0, 0, 0.1F}, {0.12F, 0, 0}, {0, 0, -0.08F}, palette.random.pick(palette.papers));
}

void keyboard(MeshBuilder& to, Palette& palette, const Transform& T) {
  const Named named(to, "keyboard");
  BoxSkin skin(palette.black);
  skin.top = palette.keyboard;
  to.box(T, {0.44F, 0.14F, 0.02F}, skin);
  to.ellipsoid(T * place(0.31F, -0.01F, 0.012F), {0.032F, 0.055F, 0.022F}, palette.black, 12);
}

void mug(MeshBuilder& to, Palette& palette, const Transform& T) {
  const Named named(to, "cup");
  to.cylinder(T, 0.038F, 0.042F, 0.095F, palette.random.pick(palette.mugs), palette.soil, 16);
  to.box(T * place(0.052F, 0, 0.02F), {0.025F, 0.012F, 0.055F}, palette.white, false);
}

void desk_lamp(MeshBuilder& to, Palette& palette, const Transform& T) {
  to.cylinder(T, 0.09F, 0.085F, 0.02F, palette.steel, palette.steel);
  rod(to, T, {0, 0, 0.02F}, {0.06F, 0.1F, 0.3F}, 0.01F, palette.steel);
  rod(to, T, {0.06F, 0.1F, 0.3F}, {0.0F, -0.12F, 0.46F}, 0.01F, palette.steel);
  const Transform head = tilted(T * place(0, -0.12F, 0.38F), 12, Vector3f::UnitX());
  const std::array rings{Ring{{0, 0, 0}, 0.09F, 0.09F}, Ring{{0, 0, 0.07F}, 0.06F, 0.06F},
                         Ring{{0, 0, 0.12F}, 0.03F, 0.03F}, Ring{{0, 0, 0.13F}, 0, 0}};
  to.loft(head, rings, palette.fabrics[1]);
}

void paper(MeshBuilder& to, Palette& palette, const Transform& T) {
  BoxSkin skin(palette.white);
  skin.top = palette.random.pick(palette.papers);
  to.box(T, {0.21F, 0.297F, 0.003F}, skin, false);
}

void book_pile(MeshBuilder& to, Palette& palette, const Transform& T, int count) {
  const Named named(to, "book");
  Random& random = palette.random;
  float z = 0;
  for (int i = 0; i < count; ++i) {
    const float height = random.real(0.018, 0.045);
    BoxSkin skin(palette.papers[0]);
    // A lying book is rotated by 90 degrees, so that its title is horizontal.
    skin.front = random.pick(palette.spines);
    std::swap(skin.front.window[0], skin.front.window[2]);
    skin.top = random.pick(palette.covers);
    skin.left = skin.right = skin.back = palette.white;
    to.box(T * place(random.real(-0.01, 0.01), random.real(-0.01, 0.01), z, random.real(-14, 14)),
           {random.real(0.15, 0.19), random.real(0.21, 0.25), height}, skin);
    z += height;
  }
}

void book_row(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height) {
  Random& random = palette.random;
  const float grid = to.grid();
  to.set_grid(0.4F);
  float x = -width / 2;
  while (true) {
    const float thick = random.real(0.022, 0.06);
    if (x + thick > width / 2) break;
    if (random.chance(0.06)) {
      x += random.real(0.05, 0.14);
      continue;
    }
    const float tall = height * random.real(0.7, 0.95), deep = random.real(0.17, 0.23);
    BoxSkin skin(random.pick(palette.spines), palette.white);
    skin.left = skin.right = skin.front;
    skin.back.texture = skin.bottom.texture = -1;
    to.box(T * place(x + thick / 2, -0.12F + deep / 2, 0), {thick - 0.002F, deep, tall}, skin,
           false);
    x += thick;
  }
  to.set_grid(grid);
  // One shadow caster for the row, slightly behind the spines.
  to.occluder(T * Eigen::Translation3f(0, 0.03F, 0.4F * height), {width, 0.22F, 0.8F * height});
}

void pencil_cup(MeshBuilder& to, Palette& palette, const Transform& T) {
  Random& random = palette.random;
  to.cylinder(T, 0.036F, 0.036F, 0.1F, random.pick(palette.mugs), palette.black, 14);
  for (int i = 0; i < 7; ++i) {
    const float a = random.real(0, 2 * kPi);
    const Vector3f foot(0.02F * std::cos(a), 0.02F * std::sin(a), 0.05F);
    rod(to, T, foot,
        foot + Vector3f(0.03F * std::cos(a), 0.03F * std::sin(a), random.real(0.08, 0.13)), 0.004F,
        random.pick(palette.covers), 6);
  }
}

void office_chair(MeshBuilder& to, Palette& palette, const Transform& T, int fabric) {
  const Named named(to, "chair");
  const Material& cloth =
      palette.fabrics[static_cast<std::size_t>(fabric) % palette.fabrics.size()];
  for (int i = 0; i < 5; ++i) {
    const float a = 2 * kPi * static_cast<float>(i) / 5;
    const Vector3f tip(0.27F * std::cos(a), 0.27F * std::sin(a), 0.07F);
    rod(to, T, {0, 0, 0.1F}, tip, 0.022F, palette.steel);
    to.ellipsoid(T * place(tip.x(), tip.y(), 0.032F), {0.03F, 0.03F, 0.032F}, palette.black, 10);
  }
  to.cylinder(T * place(0, 0, 0.08F), 0.03F, 0.025F, 0.33F, palette.steel, palette.steel, 12);
  to.box(T * place(0, 0, kSeatHeight - 0.07F), {0.47F, 0.45F, 0.07F}, cloth);
  const Transform back = tilted(T * place(0, 0.23F, kSeatHeight + 0.08F), -8, Vector3f::UnitX());
  const std::array rings{
      Ring{{0, 0, 0}, 0.16F, 0.02F},         Ring{{0, -0.01F, 0.05F}, 0.21F, 0.035F},
      Ring{{0, 0, 0.26F}, 0.23F, 0.04F},     Ring{{0, 0.01F, 0.46F}, 0.21F, 0.035F},
      Ring{{0, 0.02F, 0.52F}, 0.15F, 0.02F}, Ring{{0, 0.02F, 0.53F}, 0, 0}};
  to.loft(back, rings, cloth, 20);
  to.occluder(back * Eigen::Translation3f(0, 0, 0.26F), {0.42F, 0.06F, 0.5F});
  rod(to, T, {0, 0.16F, kSeatHeight - 0.03F}, {0, 0.25F, kSeatHeight + 0.2F}, 0.025F,
      palette.black);
  for (const float side : {-1.0F, 1.0F}) {
    rod(to, T, {side * 0.25F, 0.04F, kSeatHeight - 0.03F},
        {side * 0.26F, 0.04F, kSeatHeight + 0.18F}, 0.016F, palette.black);
    to.box(T * place(side * 0.26F, 0, kSeatHeight + 0.18F), {0.05F, 0.26F, 0.03F}, palette.black);
  }
}

void shelf(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height) {
  constexpr float kDepth = 0.3F, kBoard = 0.022F;
  for (const float side : {-1.0F, 1.0F}) {
    to.box(T * place(side * (width - kBoard) / 2, 0, 0), {kBoard, kDepth, height}, palette.walnut);
  }
  to.box(T * place(0, kDepth / 2 - 0.008F, 0), {width, 0.012F, height}, palette.walnut);
  const int levels = static_cast<int>(std::round(height / 0.36F));
  const float pitch = (height - kBoard) / static_cast<float>(levels);
  for (int i = 0; i <= levels; ++i) {
    const Transform board = T * place(0, 0, pitch * static_cast<float>(i));
    to.box(board, {width, kDepth, kBoard}, palette.walnut);
    if (i == levels) break;
    const Transform row = board * place(0, 0, kBoard);
    const float room = width - 2 * kBoard;
    if (i % 3 == 2) {  // Some books and objects next to them.
      book_row(to, palette, row * place(-room / 4, 0, 0), room / 2 - 0.02F, pitch - 0.04F);
      parcel(to, palette, row * place(room / 4, -0.02F, 0, 8), {room / 4, 0.18F, pitch * 0.6F});
      mug(to, palette, row * place(room / 2 - 0.09F, -0.04F, 0));
    } else {
      book_row(to, palette, row, room, pitch - 0.04F);
    }
  }
}

void cabinet(MeshBuilder& to, Palette& palette, const Transform& T, const Vector3f& size,
             int drawers) {
  const Material& front =
      palette.drawers[static_cast<std::size_t>(drawers) % palette.drawers.size()];
  const int columns = std::max(1, static_cast<int>(std::round(size.x() / 0.6F)));
  const float width = size.x() / static_cast<float>(columns);
  for (int i = 0; i < columns; ++i) {
    const float x = (static_cast<float>(i) + 0.5F) * width - size.x() / 2;
    to.box(T * place(x, 0, 0.06F), {width - 0.004F, size.y(), size.z() - 0.09F},
           {front, palette.white});
  }
  to.box(T * place(0, 0.02F, 0), {size.x() - 0.04F, size.y() - 0.06F, 0.06F}, palette.black);
  to.box(T * place(0, 0, size.z() - 0.03F), {size.x() + 0.02F, size.y() + 0.02F, 0.03F},
         palette.oak);
}

void plant(MeshBuilder& to, Palette& palette, const Transform& T, float height) {
  const Named named(to, "potted plant");
  Random& random = palette.random;
  const float pot = 0.25F * height, radius = 0.13F * std::sqrt(height);
  to.cylinder(T, 0.75F * radius, radius, pot, random.pick(palette.pots), palette.soil);
  const int leaves = 40 + static_cast<int>(60 * height);
  for (int i = 0; i < leaves; ++i) {
    const float s = random.real(0.15, 1);
    const float length = height * random.real(0.2, 0.4), width = 0.22F * length;
    Transform stem = T * place(0, 0, pot + s * 0.7F * (height - pot), random.real(0, 360));
    const float rise = random.real(0.2, 1.2) * length * s, droop = random.real(0.2, 0.7) * length;
    const Vector3f a(0.01F, 0, -0.3F * s * (height - pot)), b(length / 2, 0, rise),
        c(length, 0, rise - droop / 2), d(1.25F * length, 0, rise - droop);
    const std::array left{Vector3f(a + Vector3f(0, -0.004F, 0)),
                          Vector3f(b + Vector3f(0, -width / 2, 0.01F)),
                          Vector3f(c + Vector3f(0, -width / 2, 0)), d};
    const std::array right{Vector3f(a + Vector3f(0, 0.004F, 0)),
                           Vector3f(b + Vector3f(0, width / 2, 0.01F)),
                           Vector3f(c + Vector3f(0, width / 2, 0)), d};
    to.patch(stem, left, right, palette.leaf);
  }
  to.occluder(T * Eigen::Translation3f(0, 0, 0.7F * height),
              {0.35F * height, 0.35F * height, 0.3F * height});
}

void parcel(MeshBuilder& to, Palette& palette, const Transform& T, const Vector3f& size) {
  to.box(T, size, palette.cardboard);
}

void printer(MeshBuilder& to, Palette& palette, const Transform& T) {
  to.box(T, {0.44F, 0.38F, 0.2F}, {palette.gray, palette.white});
  to.box(T * place(0, 0.02F, 0.2F), {0.42F, 0.32F, 0.06F}, palette.black);
  to.quad(T, {-0.18F, -0.192F, 0.17F}, {0.12F, 0, 0}, {0, 0, -0.06F}, palette.screens[1]);
  to.box(T * place(0.05F, -0.24F, 0.05F), {0.24F, 0.12F, 0.008F}, palette.black);
  paper(to, palette, T * place(0.05F, -0.22F, 0.058F));
}

void bin(MeshBuilder& to, Palette& palette, const Transform& T) {
  to.cylinder(T, 0.11F, 0.14F, 0.3F, palette.steel, palette.black);
  for (int i = 0; i < 4; ++i) {
    Random& random = palette.random;
    to.ellipsoid(
        T * place(random.real(-0.06, 0.06), random.real(-0.06, 0.06), 0.3F, random.real(0, 180)),
        {0.06F, 0.05F, 0.045F}, random.pick(palette.papers), 10);
  }
}

void sofa(MeshBuilder& to, Palette& palette, const Transform& T, float width) {
  const Named named(to, "couch");
  const Material& cloth = palette.fabrics[2];
  to.box(T * place(0, 0, 0.08F), {width, 0.8F, 0.32F}, cloth);
  to.box(T * place(0, 0.32F, 0.4F), {width, 0.18F, 0.4F}, cloth);
  for (const float side : {-1.0F, 1.0F}) {
    to.box(T * place(side * (width / 2 - 0.08F), 0, 0.4F), {0.16F, 0.8F, 0.18F}, cloth);
    const Transform cushion =
        tilted(T * place(side * width / 4, 0.1F, 0.56F, 14 * side), -20, Vector3f::UnitX());
    to.ellipsoid(cushion, {0.21F, 0.09F, 0.2F}, palette.posters[side > 0 ? 2 : 4], 20);
  }
}

void poster(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height,
            const Material& print) {
  to.box(T * place(0, -0.011F, -height / 2), {width, 0.02F, height}, {print, palette.walnut},
         false);
}

void window(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height) {
  to.quad(T, {-width / 2, -0.01F, height}, {width, 0, 0}, {0, 0, -height}, palette.window);
  for (int i = 0; i <= 3; ++i) {
    const float x = (static_cast<float>(i) / 3 - 0.5F) * width;
    to.box(T * place(x, -0.03F, 0), {0.05F, 0.06F, height}, palette.white);
  }
  for (const float z : {-0.04F, 0.62F * height, height}) {
    to.box(T * place(0, -0.03F, z), {width + 0.08F, 0.062F, 0.05F}, palette.white);
  }
  to.box(T * place(0, -0.1F, -0.06F), {width + 0.16F, 0.22F, 0.03F}, palette.oak);
}

void door(MeshBuilder& to, Palette& palette, const Transform& T) {
  to.box(T * place(0, -0.02F, 0), {0.9F, 0.04F, 2.05F}, {palette.door, palette.walnut});
  for (const float side : {-1.0F, 1.0F}) {
    to.box(T * place(side * 0.49F, -0.03F, 0), {0.08F, 0.06F, 2.12F}, palette.white);
  }
  to.box(T * place(0, -0.03F, 2.05F), {1.06F, 0.06F, 0.08F}, palette.white);
  rod(to, T, {0.36F, -0.04F, 1.02F}, {0.36F, -0.1F, 1.02F}, 0.012F, palette.steel);
  rod(to, T, {0.37F, -0.09F, 1.02F}, {0.25F, -0.09F, 1.02F}, 0.012F, palette.steel);
}

void radiator(MeshBuilder& to, Palette& palette, const Transform& T, float width) {
  to.box(T * place(0, 0, 0.12F), {width, 0.1F, 0.55F}, {palette.radiator, palette.white});
}

void set_desk(MeshBuilder& to, Palette& p, const Transform& T, int screens) {
  desk(to, p, T, 1.6F, 0.75F);
  const auto on = [&](float x, float y, float yaw = 0) {
    return T * place(x, y, kDeskHeight, yaw);
  };
  monitor(to, p, on(-0.32F, 0.2F, 6), screens);
  monitor(to, p, on(0.3F, 0.22F, -8), screens + 1);
  keyboard(to, p, on(-0.05F, -0.14F, 3));
  mug(to, p, on(0.46F, -0.08F, 40));
  paper(to, p, on(-0.5F, -0.18F, 18));
  paper(to, p, on(-0.44F, -0.12F, -7) * place(0, 0, 0.003F));
  book_pile(to, p, on(0.66F, -0.2F, 20), 4);
  pencil_cup(to, p, on(-0.7F, 0.02F));
}

}  // namespace stillmap::simulate::furniture
