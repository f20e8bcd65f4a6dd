// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/furniture.hpp"
#include "stillmap/simulate/rooms.hpp"

#include <array>

namespace stillmap::simulate {
namespace {

using Eigen::Vector2f, Eigen::Vector3f;
namespace f = furniture;

// Size of each of the four rooms [m].
constexpr float kLength = 7.4F, kWidth = 6.4F, kHeight = 2.7F;
constexpr float kWall = 0.14F, kGap = 1.3F;  // Thickness of the walls and width of a passage [m].
constexpr float kAlong = 1.25F;  // Distance of the path and the passages from the walls [m].

/// Adds floor, ceiling and outer walls.
void build_shell(MeshBuilder& to, const std::array<Palette*, 4>& rooms) {
  // Walls overlap at the corners, so that no ray passes between them.
  constexpr float kOver = 0.1F;
  const Transform I = Transform::Identity();
  const float top = kHeight + kOver, length = 2 * kLength, width = 2 * kWidth;
  for (int i = 0; i < 4; ++i) {
    Palette& p = *rooms[static_cast<std::size_t>(i)];
    const float x = i == 1 || i == 2 ? kLength : 0, y = i >= 2 ? kWidth : 0;
    const Vector3f X(kLength, 0, 0), Y(0, kWidth, 0), Z(0, 0, top + kOver);
    to.quad(I, {x, y + kWidth, 0}, X, -Y, p.floor);
    to.quad(I, {x, y, kHeight}, X, Y, p.ceiling);
    if (y > 0) to.quad(I, {x, width, top}, X, -Z, p.wall);
    if (y == 0) to.quad(I, {x + kLength, 0, top}, -X, -Z, p.wallpaper);
    if (x == 0) to.quad(I, {0, y, top}, Y, -Z, p.accent_wall);
    if (x > 0) to.quad(I, {length, y + kWidth, top}, -Y, -Z, p.wall);
  }
}

/// Adds a wall between two rooms along x from `from` to `to_x`, with a passage around `gap` [m].
void part(MeshBuilder& to, const Transform& T, float length, float gap, const Material& front,
          const Material& back, const Material& edge) {
  BoxSkin skin(edge);
  skin.front = front;
  skin.back = back;
  const float left = gap - kGap / 2, right = length - gap - kGap / 2;
  to.box(T * place(left / 2, 0, 0), {left, kWall, kHeight}, skin);
  to.box(T * place(length - right / 2, 0, 0), {right, kWall, kHeight}, skin);
}

void build_parts(MeshBuilder& to, const std::array<Palette*, 4>& rooms) {
  const Material& white = rooms[0]->white;
  // Rooms 0 and 1, and 3 and 2, are side by side; 1 and 2, and 0 and 3, are one behind the other.
  part(to, place(kLength, 0, 0, 90), kWidth, kWidth - kAlong, rooms[1]->accent_wall, rooms[0]->wall,
       white);
  part(to, place(kLength, kWidth, 0, 90), kWidth, kAlong, rooms[2]->accent_wall, rooms[3]->wall,
       white);
  part(to, place(kLength, kWidth, 0), kLength, kLength - kAlong, rooms[1]->wallpaper,
       rooms[2]->wall, white);
  part(to, place(0, kWidth, 0), kLength, kAlong, rooms[0]->wall, rooms[3]->wallpaper, white);
}

void hang_lamps(MeshBuilder& to, Palette& p, float x0, float y0, Scene& scene) {
  for (const float x : {x0 + 2.2F, x0 + 5.2F}) {
    const float y = y0 + kWidth / 2;
    to.box(place(x, y, kHeight - 0.05F), {1.2F, 0.3F, 0.05F}, {p.white, p.white}, false);
    scene.lighting.lamps.push_back({{x, y, kHeight - 0.1F}, {3.4F, 3.6F, 3.8F}, {0, 0, -1}});
  }
}

/// Furnishes one wall of a room: T is the center of the wall on the floor, facing -y into the room.
void furnish_wall(MeshBuilder& to, Palette& p, const Transform& T, int kind) {
  const auto print = [&](int i) -> const Material& {
    return p.posters[static_cast<std::size_t>(i) % p.posters.size()];
  };
  const auto painting = [&](int i) -> const Material& {
    return p.paintings[static_cast<std::size_t>(i) % p.paintings.size()];
  };
  const auto at = [&](float x, float out, float z) { return T * place(x, -out, z); };
  switch (kind) {
    case 0:
      f::shelf(to, p, at(-1.1F, 0.17F, 0), 1.5F, 2.1F);
      f::cabinet(to, p, at(0.7F, 0.24F, 0), {1.5F, 0.45F, 0.8F}, 1);
      f::plant(to, p, at(0.3F, 0.24F, 0.8F), 0.4F);
      f::book_pile(to, p, at(1.1F, 0.24F, 0.8F), 5);
      f::poster(to, p, at(0.7F, 0, 1.7F), 1.1F, 0.75F, p.map);
      f::poster(to, p, at(2.1F, 0, 1.6F), 0.55F, 0.8F, print(0));
      break;
    case 1:
      f::sofa(to, p, at(-0.5F, 0.46F, 0), 1.7F);
      f::poster(to, p, at(-0.8F, 0, 1.7F), 0.85F, 0.6F, painting(0));
      f::poster(to, p, at(0.3F, 0, 1.65F), 0.55F, 0.8F, print(1));
      f::plant(to, p, at(1.2F, 0.35F, 0), 1.4F);
      f::poster(to, p, at(1.9F, 0, 1.6F), 0.62F, 0.46F, painting(1));
      break;
    case 2:
      f::cabinet(to, p, at(-0.9F, 0.24F, 0), {1.8F, 0.45F, 0.74F}, 2);
      f::printer(to, p, at(-1.2F, 0.24F, 0.74F));
      f::parcel(to, p, at(-0.4F, 0.24F, 0.74F), {0.3F, 0.24F, 0.2F});
      f::poster(to, p, at(-0.9F, 0, 1.65F), 1.4F, 0.9F, p.pin_board);
      f::shelf(to, p, at(1.1F, 0.17F, 0), 1.2F, 1.5F);
      f::poster(to, p, at(1.1F, 0, 2.1F), 0.6F, 0.45F, painting(2));
      f::poster(to, p, at(2.2F, 0, 1.6F), 0.5F, 0.7F, print(2));
      break;
    default:
      f::radiator(to, p, at(-0.6F, 0.08F, 0), 1.4F);
      f::window(to, p, at(-0.6F, 0, 1.0F), 1.6F, 1.2F);
      f::poster(to, p, at(1.0F, 0, 1.65F), 0.55F, 0.8F, print(3));
      f::poster(to, p, at(1.8F, 0, 1.6F), 0.6F, 0.85F, print(4));
      f::parcel(to, p, at(1.5F, 0.4F, 0), {0.5F, 0.45F, 0.4F});
      f::plant(to, p, at(-2.0F, 0.35F, 0), 1.1F);
      break;
  }
}

/// Returns the walls of a room as furnish_wall() takes them: north, east, south, west.
std::array<Transform, 4> walls_of(const Vector2f& corner) {
  const float x = corner.x(), y = corner.y();
  const float middle_x = x + kLength / 2, middle_y = y + kWidth / 2, off = kWall / 2;
  return {place(middle_x, y + kWidth - off, 0), place(x + kLength - off, middle_y, 0, -90),
          place(middle_x, y + off, 0, 180), place(x + off, middle_y, 0, 90)};
}

/// Furnishes the four walls of each room, in a different order in each; passages stay free.
void furnish_walls(MeshBuilder& to, Palette& p, const Vector2f& corner, std::size_t room) {
  const std::array<Transform, 4> walls = walls_of(corner);
  for (std::size_t i = 0; i < 4; ++i)
    furnish_wall(to, p, walls[i], static_cast<int>((room + i) % 4));
}

/// Returns places on the walls next to what hangs there that the path of round_way() faces.
std::vector<Transform> tag_places(const std::array<Vector2f, 4>& corner) {
  struct Wall {
    std::size_t room, wall;  // as in walls_of()
  };
  constexpr std::array kWalls{Wall{0, 0}, Wall{1, 1}, Wall{2, 3}, Wall{3, 0},
                              Wall{0, 1}, Wall{1, 2}, Wall{2, 1}, Wall{3, 3},
                              Wall{0, 2}, Wall{2, 0}, Wall{3, 2}, Wall{2, 2}};
  // Along the wall, by its kind [m].
  constexpr std::array<float, 4> kFree{1.54F, -0.18F, 0.15F, 0.5F};
  std::vector<Transform> places;
  for (const auto& [room, wall] : kWalls)
    places.push_back(walls_of(corner[room])[wall] * place(kFree[(room + wall) % 4], 0, 1.6F));
  return places;
}

/// Adds two desks face to face around the origin.
Mesh desk_group(Palette& p) {
  MeshBuilder to;
  f::set_desk(to, p, place(0, -0.38F, 0), 0);
  f::set_desk(to, p, place(0, 0.38F, 0, 180), 2);
  f::desk_lamp(to, p, place(-0.68F, 0.1F, f::kDeskHeight, -60));
  f::plant(to, p, place(0.68F, 0.02F, f::kDeskHeight), 0.42F);
  f::office_chair(to, p, place(0.05F, 1.12F, 0), 0);
  f::office_chair(to, p, place(-0.1F, -1.12F, 0, 180), 2);
  return to.take();
}

/// The path leads around the center of each room, in through one passage and out through the next.
std::vector<Vector2f> round_way() {
  const std::vector<Vector2f> first = {{kAlong, 4.2F},
                                       {kAlong, kAlong + 0.6F},
                                       {kAlong + 0.6F, kAlong},
                                       {kLength / 2, kAlong},
                                       {kLength - kAlong - 0.6F, kAlong},
                                       {kLength - kAlong, kAlong + 0.6F},
                                       {kLength - kAlong, 4.0F},
                                       {kLength - kAlong + 0.4F, kWidth - kAlong - 0.25F}};
  const auto mirrored = [](const Vector2f& p) { return Vector2f(2 * kLength - p.x(), p.y()); };
  const auto up = [](const Vector2f& p) { return Vector2f(p.x(), 2 * kWidth - p.y()); };
  const std::vector<Vector2f> back(first.rbegin(), first.rend());
  std::vector<Vector2f> way = first;
  for (const Vector2f& p : back) way.push_back(mirrored(p));
  for (const Vector2f& p : first) way.push_back(up(mirrored(p)));
  for (const Vector2f& p : back) way.push_back(up(p));
  return way;
}

}  // namespace

RoomPlan build_flat(Palette& p, Scene& scene) {
  Palette second(p.textures, p.random), third(p.textures, p.random), fourth(p.textures, p.random);
  const std::array<Palette*, 4> rooms{&p, &second, &third, &fourth};
  MeshBuilder to(0.25F);
  build_shell(to, rooms);
  build_parts(to, rooms);
  to.set_grid(0.15F);
  const std::array<Vector2f, 4> corner{Vector2f(0, 0), Vector2f(kLength, 0),
                                       Vector2f(kLength, kWidth), Vector2f(0, kWidth)};
  for (std::size_t i = 0; i < 4; ++i) {
    hang_lamps(to, *rooms[i], corner[i].x(), corner[i].y(), scene);
    furnish_walls(to, *rooms[i], corner[i], i);
  }
  scene.lighting.ambient = {0.36F, 0.35F, 0.34F};
  scene.statics = to.take();
  const Mesh twins = desk_group(p), third_desks = desk_group(second),
             last_desks = desk_group(third);
  const std::array<const Mesh*, 4> desks{&twins, &third_desks, &twins, &last_desks};
  for (std::size_t i = 0; i < 4; ++i) {
    const float turn = i == 2 ? 180 : 90 * static_cast<float>(i);
    append_transformed(*desks[i],
                       place(corner[i].x() + kLength / 2, corner[i].y() + kWidth / 2, 0, turn), 0,
                       scene.statics);
  }
  RoomPlan plan;
  plan.walk = round_way();
  plan.tag_places = tag_places(corner);
  plan.seats = {place(kLength / 2, 1.6F, 0)};
  plan.spots = {place(2.2F, 4.8F, 0, -30), place(5.2F, 4.9F, 0, 20)};
  plan.rise = plan.crowd = plan.walk;
  plan.things = plan.near_things = {.hook = {2.6F, 2.2F, kHeight},
                                    .chair_from = {2.0F, 4.6F},
                                    .chair_to = {4.9F, 5.0F},
                                    .ball_from = {1.75F, 2.25F},
                                    .ball_to = {2.6F, 1.35F}};
  scene.viewpoint = {{1.15, 0.95, 1.45}, {3.7, 3.2, 0.92}};
  scene.room = {Eigen::Vector3d::Zero(), Eigen::Vector3d(2 * kLength, 2 * kWidth, kHeight)};
  return plan;
}

}  // namespace stillmap::simulate
