// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/furniture.hpp"
#include "stillmap/simulate/rooms.hpp"

#include <optional>

namespace stillmap::simulate {
namespace {

using Eigen::Vector3f;
namespace f = furniture;

constexpr float kLength = 6.4F, kWidth = 5.6F, kHeight = 2.7F;  // along x, y, z
constexpr float kDeskX = 3.6F, kDeskY = 3.25F;                  // Center of the two desks [m].

/// Builds pieces of furniture as they stand at a visit. All others look as at the other visit.
class RearrangedPieces {
 public:
  RearrangedPieces(int visit, MeshBuilder& to, Palette& p, Scene& scene)
      : visit_(visit), to_(to), p_(p), scene_(scene) {}

  /// @param first, second  places at the visits; none: the piece is not there
  /// @param build          adds the piece at a place to a mesh
  template <typename Build>
  void add(const char* name, const std::optional<Transform>& first,
           const std::optional<Transform>& second, const Build& build) {
    const Random random = p_.random;  // so that a piece looks the same at both places
    if (const auto& here = visit_ == 1 ? first : second) build(to_, *here);
    p_.random = random;
    const Eigen::AlignedBox3f second_box = box_of(second, build);
    p_.random = random;
    // What comes next has the random numbers that it has at the first visit.
    const Eigen::AlignedBox3f first_box = box_of(first, build);
    scene_.rearranged.push_back({name, first_box, second_box});
  }

 private:
  template <typename Build>
  Eigen::AlignedBox3f box_of(const std::optional<Transform>& place, const Build& build) {
    Eigen::AlignedBox3f box;
    if (!place) return box;
    MeshBuilder piece(to_.grid());
    build(piece, *place);
    for (const Vertex& v : piece.mesh().vertices) box.extend(v.position);
    return box;
  }

  int visit_;
  MeshBuilder& to_;
  Palette& p_;
  Scene& scene_;
};

void build_shell(MeshBuilder& to, Palette& p) {
  // Walls overlap at the corners, so that no ray passes between them.
  constexpr float kOver = 0.1F;
  const Transform I = Transform::Identity();
  const Vector3f X(kLength + 2 * kOver, 0, 0), Y(0, kWidth + 2 * kOver, 0),
      Z(0, 0, kHeight + 2 * kOver);
  const float top = kHeight + kOver;
  to.quad(I, {-kOver, kWidth + kOver, 0}, X, -Y, p.floor);
  to.quad(I, {-kOver, -kOver, kHeight}, X, Y, p.ceiling);
  to.quad(I, {-kOver, kWidth, top}, X, -Z, p.wall);
  to.quad(I, {kLength + kOver, 0, top}, -X, -Z, p.wallpaper);
  to.quad(I, {0, -kOver, top}, Y, -Z, p.wall);
  to.quad(I, {kLength, kWidth + kOver, top}, -Y, -Z, p.accent_wall);
  const auto board = [&](const Transform& T, float length) {
    to.box(T, {length, 0.03F, 0.09F}, p.white, false);
  };
  board(place(kLength / 2, kWidth - 0.01F, 0), kLength);
  board(place(kLength / 2, 0.01F, 0), kLength);
  board(place(0.01F, kWidth / 2, 0, 90), kWidth);
  board(place(kLength - 0.01F, kWidth / 2, 0, 90), kWidth);
}

void hang_lamps(MeshBuilder& to, Palette& p, Scene& scene) {
  for (const float x : {1.9F, 4.7F}) {
    for (const float y : {1.6F, 4.0F}) {
      to.box(place(x, y, kHeight - 0.05F), {1.2F, 0.3F, 0.05F}, {p.white, p.white}, false);
      to.quad(place(x, y, kHeight - 0.052F), {-0.57F, -0.12F, 0}, {1.14F, 0, 0}, {0, 0.24F, 0},
              p.glow);
      scene.lighting.lamps.push_back({{x, y, kHeight - 0.1F}, {2.0F, 2.2F, 2.3F}, {0, 0, -1}});
    }
  }
  scene.lighting.lamps.push_back(
      {{1.6F, kWidth - 0.15F, 1.6F}, {1.7F, 1.45F, 1.2F}, {0, -1, -0.2F}});
  scene.lighting.ambient = {0.36F, 0.35F, 0.34F};
}

void furnish_middle(MeshBuilder& to, Palette& p, RearrangedPieces& pieces) {
  BoxSkin rug(p.rug);
  to.box(place(kDeskX - 0.1F, kDeskY - 0.1F, 0), {3.3F, 2.6F, 0.012F}, rug, false);
  f::set_desk(to, p, place(kDeskX, kDeskY - 0.38F, 0), 0);
  f::set_desk(to, p, place(kDeskX, kDeskY + 0.38F, 0, 180), 2);
  f::desk_lamp(to, p, place(kDeskX - 0.68F, kDeskY + 0.1F, f::kDeskHeight, -60));
  f::plant(to, p, place(kDeskX + 0.68F, kDeskY + 0.02F, f::kDeskHeight), 0.42F);
  pieces.add("bin", place(kDeskX - 1.0F, kDeskY - 0.7F, 0), place(1.6F, 2.6F, 0),
             [&](MeshBuilder& mesh, const Transform& T) { f::bin(mesh, p, T); });
}

void furnish_north(MeshBuilder& to, Palette& p, RearrangedPieces& pieces) {
  const float wall = kWidth;
  f::window(to, p, place(1.6F, wall, 1.0F), 1.9F, 1.2F);
  f::radiator(to, p, place(1.6F, wall - 0.08F, 0), 1.5F);
  f::shelf(to, p, place(3.65F, wall - 0.17F, 0), 1.5F, 2.1F);
  f::shelf(to, p, place(5.1F, wall - 0.17F, 0), 1.2F, 1.4F);
  f::plant(to, p, place(5.4F, wall - 0.18F, 1.4F), 0.45F);
  f::book_pile(to, p, place(4.8F, wall - 0.18F, 1.4F, 10), 5);
  f::poster(to, p, place(5.1F, wall, 2.2F), 0.85F, 0.6F, p.paintings[0]);
  f::poster(to, p, place(6.05F, wall, 1.75F), 0.5F, 0.7F, p.posters[5]);
  pieces.add("plant in the corner", place(6.0F, wall - 0.4F, 0), std::nullopt,
             [&](MeshBuilder& mesh, const Transform& T) { f::plant(mesh, p, T, 1.3F); });
  f::poster(to, p, place(2.76F, wall, 1.75F), 0.24F, 0.34F, p.posters[6]);
}

void furnish_east(MeshBuilder& to, Palette& p, RearrangedPieces& pieces) {
  const float wall = kLength;
  f::cabinet(to, p, place(wall - 0.24F, 1.9F, 0, -90), {1.8F, 0.45F, 0.82F}, 1);
  pieces.add("printer", place(wall - 0.25F, 1.45F, 0.82F, -90), std::nullopt,
             [&](MeshBuilder& mesh, const Transform& T) { f::printer(mesh, p, T); });
  f::book_pile(to, p, place(wall - 0.24F, 2.05F, 0.82F, -80), 6);
  f::plant(to, p, place(wall - 0.24F, 2.5F, 0.82F), 0.5F);
  f::poster(to, p, place(wall, 1.9F, 1.75F, -90), 1.5F, 0.78F, p.map);
  pieces.add("shelf", place(wall - 0.17F, 3.6F, 0, -90), place(0.17F, 3.75F, 0, 90),
             [&](MeshBuilder& mesh, const Transform& T) { f::shelf(mesh, p, T, 1.3F, 1.75F); });
  f::poster(to, p, place(wall, 3.2F, 2.2F, -90), 0.5F, 0.7F, p.posters[0]);
  f::poster(to, p, place(wall, 3.95F, 2.25F, -90), 0.68F, 0.5F, p.paintings[2]);
  f::poster(to, p, place(wall, 4.75F, 1.65F, -90), 0.55F, 0.8F, p.posters[3]);
  f::cabinet(to, p, place(wall - 0.28F, 4.7F, 0, -90), {0.6F, 0.5F, 0.7F}, 0);
  f::desk_lamp(to, p, place(wall - 0.28F, 4.6F, 0.7F, -90));
  f::poster(to, p, place(wall, 0.55F, 1.7F, -90), 0.55F, 0.8F, p.posters[1]);
  f::parcel(to, p, place(wall - 0.4F, 0.45F, 0, 12), {0.5F, 0.45F, 0.4F});
  f::parcel(to, p, place(wall - 0.42F, 0.42F, 0.4F, -8), {0.36F, 0.3F, 0.26F});
}

void furnish_south(MeshBuilder& to, Palette& p) {
  f::door(to, p, place(5.1F, 0, 0, 180));
  f::poster(to, p, place(3.6F, 0, 1.55F, 180), 1.5F, 0.95F, p.pin_board);
  f::cabinet(to, p, place(3.5F, 0.25F, 0, 180), {1.8F, 0.42F, 0.74F}, 2);
  f::book_pile(to, p, place(3.0F, 0.24F, 0.74F, 190), 5);
  f::plant(to, p, place(4.1F, 0.24F, 0.74F), 0.45F);
  f::parcel(to, p, place(3.6F, 0.24F, 0.74F, 170), {0.3F, 0.22F, 0.2F});
  f::poster(to, p, place(2.3F, 0, 1.6F, 180), 0.55F, 0.8F, p.posters[2]);
  f::poster(to, p, place(1.5F, 0, 1.7F, 180), 0.55F, 0.8F, p.posters[4]);
  f::poster(to, p, place(0.7F, 0, 1.6F, 180), 0.7F, 0.52F, p.paintings[1]);
  f::poster(to, p, place(4.42F, 0, 2.2F, 180), 0.32F, 0.32F, p.clock);
}

void furnish_west(MeshBuilder& to, Palette& p, RearrangedPieces& pieces) {
  pieces.add("sofa", place(0.46F, 3.6F, 0, 90), place(0.46F, 2.0F, 0, 90),
             [&](MeshBuilder& mesh, const Transform& T) { f::sofa(mesh, p, T, 1.7F); });
  f::poster(to, p, place(0, 3.55F, 1.6F, 90), 1.6F, 0.95F, p.whiteboard);
  f::plant(to, p, place(0.4F, 5.15F, 0), 1.5F);
  f::poster(to, p, place(0, 2.1F, 1.6F, 90), 0.6F, 0.85F, p.posters[7]);
  f::poster(to, p, place(0, 1.2F, 1.65F, 90), 0.6F, 0.85F, p.posters[8]);
  f::poster(to, p, place(0, 0.45F, 1.6F, 90), 0.62F, 0.46F, p.paintings[3]);
  f::poster(to, p, place(0, 4.85F, 1.7F, 90), 0.62F, 0.46F, p.paintings[4]);
}

/// Returns places that are seen at both visits, next to what hangs on the walls.
std::vector<Transform> tag_places() {
  constexpr float kOnDoor = 0.041F, kOnPinBoard = 0.022F;  // in front of the wall [m]
  return {place(kLength, 0.985F, 1.55F, -90),
          place(4.54F, kWidth, 1.73F),
          place(0, 2.575F, 1.55F, 90),
          place(2.71F, 0, 1.6F, 180),
          place(kLength, 5.3F, 1.75F, -90),
          place(0, 5.38F, 1.8F, 90),
          place(0, 1.65F, 1.6F, 90),
          place(0.19F, 0, 1.6F, 180),
          place(kLength, 2.8F, 1.6F, -90),
          place(5.1F, kOnDoor, 1.335F, 180),
          place(3.15F, kOnPinBoard, 1.8F, 180),
          place(3.95F, kOnPinBoard, 1.75F, 180)};
}

}  // namespace

RoomPlan build_office(int visit, Palette& p, Scene& scene) {
  MeshBuilder to(0.18F);
  RearrangedPieces pieces(visit, to, p, scene);
  build_shell(to, p);
  to.set_grid(0.15F);
  hang_lamps(to, p, scene);
  furnish_middle(to, p, pieces);
  furnish_north(to, p, pieces);
  furnish_east(to, p, pieces);
  furnish_south(to, p);
  furnish_west(to, p, pieces);
  pieces.add("parcel", std::nullopt, place(3.3F, 0.85F, 0, 30),
             [&](MeshBuilder& mesh, const Transform& T) {
               f::parcel(mesh, p, T, {0.45F, 0.35F, 0.3F});
             });
  pieces.add("cabinet", std::nullopt, place(2.5F, kWidth - 0.27F, 0),
             [&](MeshBuilder& mesh, const Transform& T) {
               f::cabinet(mesh, p, T, {0.6F, 0.5F, 0.7F}, 0);
             });
  RoomPlan plan;
  plan.seats = {place(kDeskX + 0.05F, kDeskY + 1.12F, 0),
                place(kDeskX - 0.1F, kDeskY - 1.12F, 0, 180)};
  f::office_chair(to, p, plan.seats[0], 0);
  f::office_chair(to, p, plan.seats[1], 2);
  plan.tag_places = tag_places();
  plan.spots = {place(2.5F, 3.35F, 0, -29),  place(5.72F, 2.75F, 0, -68), place(2.5F, 5.3F, 0, -17),
                place(5.72F, 4.35F, 0, -53), place(5.5F, 0.9F, 0, -90),   place(1.3F, 4.4F, 0, 0)};
  plan.walk = {{2.45F, 1.75F}, {3.6F, 1.55F}, {4.9F, 1.75F}, {5.3F, 3.2F},
               {4.9F, 4.75F},  {3.6F, 4.95F}, {2.25F, 4.7F}, {1.95F, 3.2F}};
  plan.walk_start = 7.2F;
  plan.rise = {{2.8F, 2.0F},  {2.1F, 2.4F}, {1.95F, 3.2F}, {2.25F, 4.7F}, {3.6F, 4.95F},
               {4.9F, 4.75F}, {5.3F, 3.2F}, {4.9F, 1.75F}, {3.6F, 1.5F},  {2.9F, 1.6F}};
  plan.crowd = {{1.5F, 1.23F}, {0.9F, 2.0F}, {1.6F, 3.1F}, {2.2F, 4.7F},  {3.6F, 4.95F},
                {4.9F, 4.75F}, {5.3F, 3.2F}, {4.9F, 1.6F}, {3.6F, 1.05F}, {2.3F, 0.5F}};
  plan.things = {.hook = {kDeskX - 0.35F, kDeskY - 0.1F, kHeight},
                 .chair_from = {2.95F, 1.15F},
                 .chair_to = {4.9F, 1.2F},
                 .ball_from = {1.75F, 2.25F},
                 .ball_to = {2.6F, 1.35F}};
  plan.near_things = {.hook = {1.95F, 2.1F, 2.35F},
                      .chair_from = {1.95F, 2.5F},
                      .chair_to = {2.8F, 1.5F},
                      .ball_from = {2.45F, 2.8F},
                      .ball_to = {2.6F, 4.0F}};
  scene.statics = to.take();
  scene.viewpoint = {{1.15, 0.95, 1.45}, {3.55, 2.9, 0.92}};
  scene.room = {Eigen::Vector3d::Zero(), Eigen::Vector3d(kLength, kWidth, kHeight)};
  return plan;
}

}  // namespace stillmap::simulate
