// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/furniture.hpp"
#include "stillmap/simulate/rooms.hpp"

#include <array>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f, Eigen::Vector3f;
namespace f = furniture;

constexpr float kLength = 10.0F, kWidth = 13.0F, kHeight = 5.5F;  // along x, y, z [m]
// Size of a container [m].
constexpr float kBoxLength = 2.0F, kBoxWidth = 1.0F, kBoxHeight = 1.1F;
/// Height of the camera below the trolley, and its angle below the horizon.
constexpr double kCameraHeight = 2.7, kDescent = 0.73;  // meters, radians (42 degrees)

void build_shell(MeshBuilder& to, Palette& p, const Material& ground) {
  // Walls overlap at the corners, so that no ray passes between them.
  constexpr float kOver = 0.1F;
  const Transform I = Transform::Identity();
  const Vector3f X(kLength + 2 * kOver, 0, 0), Y(0, kWidth + 2 * kOver, 0),
      Z(0, 0, kHeight + 2 * kOver);
  const float top = kHeight + kOver;
  to.quad(I, {-kOver, kWidth + kOver, 0}, X, -Y, ground);
  to.quad(I, {-kOver, -kOver, kHeight}, X, Y, p.ceiling);
  to.quad(I, {-kOver, kWidth, top}, X, -Z, p.accent_wall);
  to.quad(I, {kLength + kOver, 0, top}, -X, -Z, p.wall);
  to.quad(I, {0, -kOver, top}, Y, -Z, p.accent_wall);
  to.quad(I, {kLength, kWidth + kOver, top}, -Y, -Z, p.accent_wall);
}

void hang_lamps(Scene& scene) {
  for (const float x : {2.5F, 7.5F}) {
    for (const float y : {2.2F, 6.5F, 10.8F}) {
      scene.lighting.lamps.push_back({{x, y, kHeight - 0.2F}, {7.4F, 7.8F, 8.0F}, {0, 0, -1}});
    }
  }
  scene.lighting.ambient = {0.4F, 0.4F, 0.39F};
}

/// Adds containers with a number each, some with parcels or a plant on top.
class Containers {
 public:
  Containers(MeshBuilder& to, Palette& palette) : to_(to), p_(palette) {
    for (const cv::Scalar& color : {cv::Scalar(150, 92, 40), cv::Scalar(56, 60, 168),
                                    cv::Scalar(84, 126, 62), cv::Scalar(52, 128, 196)}) {
      sides_.push_back(p_.add(paint::container_side(color, p_.random)));
      roofs_.push_back(p_.add(paint::container_roof(color, p_.random)));
    }
  }

  void add(const Transform& T) {
    const std::size_t kind = count_++ % sides_.size();
    BoxSkin skin(sides_[kind]);
    skin.top = roofs_[kind];
    to_.box(T, {kBoxLength, kBoxWidth, kBoxHeight}, skin);
    if (count_ % 3 == 0)
      f::parcel(to_, p_, T * place(-0.4F, 0.1F, kBoxHeight, 20), {0.5F, 0.4F, 0.3F});
    if (count_ % 3 == 1) {
      f::parcel(to_, p_, T * place(0.5F, 0, kBoxHeight, -10), {0.45F, 0.4F, 0.35F});
      f::book_pile(to_, p_, T * place(-0.5F, 0.1F, kBoxHeight, 30), 4);
    }
  }

 private:
  MeshBuilder& to_;
  Palette& p_;
  std::vector<Material> sides_, roofs_;
  std::size_t count_ = 0;
};

/// Adds a pallet with parcels.
void pallet(MeshBuilder& to, Palette& p, const Transform& T) {
  to.box(T, {1.2F, 0.8F, 0.14F}, p.oak);
  f::parcel(to, p, T * place(-0.28F, 0.05F, 0.14F, 4), {0.55F, 0.6F, 0.5F});
  f::parcel(to, p, T * place(0.32F, -0.05F, 0.14F, -7), {0.5F, 0.55F, 0.36F});
  f::parcel(to, p, T * place(0.3F, 0, 0.5F, 12), {0.36F, 0.3F, 0.26F});
}

void barrel(MeshBuilder& to, Palette& p, float x, float y, int color) {
  to.cylinder(place(x, y, 0), 0.29F, 0.29F, 0.88F, p.covers[static_cast<std::size_t>(color) % 6],
              p.steel);
}

/// Marks lanes and places on the ground.
void mark_ground(MeshBuilder& to, Palette& p) {
  const Material stripe = p.add(paint::hazard_crate(p.random));
  const auto flat = [&](float x, float y, float length, float width, const Material& material) {
    to.quad(place(x, y, 0.004F), {-length / 2, width / 2, 0}, {length, 0, 0}, {0, -width, 0},
            material);
  };
  for (int i = 0; i < 9; ++i) {
    const float x = 1.4F + 3.5F * static_cast<float>(i % 3),
                y = 3.4F + 3.4F * static_cast<float>(i / 3);
    flat(x, y, 0.8F, 0.8F, p.add(paint::floor_sign(i + 1, p.random)));
  }
  for (const float x : {2.6F, 6.6F}) {
    for (float y = 2; y < kWidth - 1; y += 1.3F) flat(x, y, 0.12F, 0.8F, p.white);
  }
  for (const float y : {5.1F, 8.6F}) flat(kLength / 2, y, 1.2F, 0.4F, stripe);
}

void furnish_walls(MeshBuilder& to, Palette& p) {
  f::poster(to, p, place(2.0F, kWidth, 1.7F), 1.5F, 0.9F, p.map);
  f::poster(to, p, place(5.0F, kWidth, 1.8F), 2.2F, 1.1F, p.whiteboard);
  f::door(to, p, place(8.2F, kWidth, 0));
  for (int i = 0; i < 4; ++i) {
    const float y = 3.2F + 2.6F * static_cast<float>(i);
    const auto print = static_cast<std::size_t>(i);
    f::poster(to, p, place(0, y, 1.7F, 90), 0.8F, 1.1F, p.posters[print]);
    f::poster(to, p, place(kLength, y, 1.7F, -90), 0.8F, 1.1F, p.posters[print + 4]);
    f::shelf(to, p, place(kLength - 0.2F, y + 1.2F, 0, -90), 1.5F, 1.8F);
    f::shelf(to, p, place(0.2F, y + 1.2F, 0, 90), 1.5F, 1.8F);
  }
}

/// A container on the ground: its center [m], and its yaw [degrees].
struct Stand {
  float x, y, yaw;
};
constexpr std::array kStands{Stand{1.7F, 4.6F, 90}, Stand{5.0F, 4.2F, 0},  Stand{8.5F, 5.4F, 90},
                             Stand{5.0F, 6.9F, 6},  Stand{1.7F, 8.2F, 90}, Stand{8.6F, 8.6F, 80},
                             Stand{4.9F, 10.2F, 0}, Stand{7.4F, 11.6F, 0}, Stand{2.2F, 11.4F, -8}};

/// Returns one place on every container, on the side that the camera below the trolley sees.
std::vector<Transform> tag_places() {
  // Below the name of its owner [m].
  constexpr float kUp = 0.49F, kAlong = -0.3F;
  std::vector<Transform> places;
  for (const Stand& stand : kStands) {
    const Transform T = place(stand.x, stand.y, 0, stand.yaw);
    places.push_back(stand.yaw > 45 ? T * place(-kBoxLength / 2, 0, kUp, -90)
                                    : T * place(kAlong, -kBoxWidth / 2, kUp));
  }
  return places;
}

void fill_yard(MeshBuilder& to, Palette& p) {
  Containers containers(to, p);
  for (const Stand& stand : kStands) containers.add(place(stand.x, stand.y, 0, stand.yaw));
  pallet(to, p, place(5.0F, 7.95F, 0, 10));
  pallet(to, p, place(9.2F, 10.6F, 0, 80));
  pallet(to, p, place(6.4F, 3.4F, 0, -15));
  pallet(to, p, place(3.2F, 3.0F, 0, 40));
  barrel(to, p, 9.2F, 7.0F, 0);
  barrel(to, p, 6.4F, 9.9F, 2);
  barrel(to, p, 1.5F, 6.4F, 1);
  barrel(to, p, 7.2F, 4.0F, 3);
  barrel(to, p, 1.2F, 6.2F, 4);
}

}  // namespace

RoomPlan build_yard(Palette& p, Scene& scene) {
  MeshBuilder to(0.25F);
  build_shell(to, p, p.add(paint::concrete(p.random), 3));
  hang_lamps(scene);
  to.set_grid(0.2F);
  mark_ground(to, p);
  furnish_walls(to, p);
  fill_yard(to, p);
  scene.statics = to.take();
  scene.room = {Eigen::Vector3d::Zero(), Eigen::Vector3d(kLength, kWidth, kHeight)};
  scene.trolley = Trolley{.start = {3.4, 1.2, kCameraHeight}};
  const Eigen::Vector3d ahead(0, std::cos(kDescent), -std::sin(kDescent));
  scene.viewpoint = {scene.trolley->start, scene.trolley->start + ahead};
  RoomPlan plan;
  // Around the container in the middle, next to the lanes of the vehicles.
  plan.walk = {{3.65F, 5.6F}, {3.65F, 7.6F}, {4.1F, 8.9F}, {5.7F, 8.9F},
               {6.45F, 7.9F}, {6.45F, 6.0F}, {5.5F, 5.4F}, {4.3F, 5.3F}};
  plan.walk_start = 2;
  plan.tag_places = tag_places();
  plan.seats = {place(5.0F, 2.0F, 0)};
  plan.spots = {place(3.9F, 5.6F, 0), place(6.2F, 5.4F, 0), place(5.8F, 8.6F, 0)};
  plan.rise = plan.crowd = plan.walk;
  plan.vehicles = {{{2.75F, 4.4F}, {2.75F, 10.0F}}, {{7.4F, 5.2F}, {7.4F, 10.2F}}};
  return plan;
}

}  // namespace stillmap::simulate
