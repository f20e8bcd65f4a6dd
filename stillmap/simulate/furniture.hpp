// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/palette.hpp"

/// Furniture. Every piece is placed by `T`: its base is at the origin of the frame, centered in x
/// and y, and its front faces -y; lengths are in meters.
namespace stillmap::simulate::furniture {

constexpr float kDeskHeight = 0.74F;
constexpr float kSeatHeight = 0.46F;

/// Objects of a desk: screens, a keyboard, a mug, papers, books and pencils.
void set_desk(MeshBuilder& to, Palette& palette, const Transform& T, int screens);
void desk(MeshBuilder& to, Palette& palette, const Transform& T, float width, float depth);
void monitor(MeshBuilder& to, Palette& palette, const Transform& T, int screen);
void keyboard(MeshBuilder& to, Palette& palette, const Transform& T);
void mug(MeshBuilder& to, Palette& palette, const Transform& T);
void desk_lamp(MeshBuilder& to, Palette& palette, const Transform& T);
void paper(MeshBuilder& to, Palette& palette, const Transform& T);
/// A pile of `count` books.
void book_pile(MeshBuilder& to, Palette& palette, const Transform& T, int count);
/// A row of upright books with some binders and gaps.
void book_row(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height);
void pencil_cup(MeshBuilder& to, Palette& palette, const Transform& T);
void office_chair(MeshBuilder& to, Palette& palette, const Transform& T, int fabric);
void shelf(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height);
void cabinet(MeshBuilder& to, Palette& palette, const Transform& T, const Eigen::Vector3f& size,
             int drawers);
void plant(MeshBuilder& to, Palette& palette, const Transform& T, float height);
void parcel(MeshBuilder& to, Palette& palette, const Transform& T, const Eigen::Vector3f& size);
void printer(MeshBuilder& to, Palette& palette, const Transform& T);
void bin(MeshBuilder& to, Palette& palette, const Transform& T);
void sofa(MeshBuilder& to, Palette& palette, const Transform& T, float width);
/// A framed poster on a wall: T is its center, on the wall, facing -y.
void poster(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height,
            const Material& print);
/// A window in the wall: T is the center of its lower edge.
void window(MeshBuilder& to, Palette& palette, const Transform& T, float width, float height);
void door(MeshBuilder& to, Palette& palette, const Transform& T);
void radiator(MeshBuilder& to, Palette& palette, const Transform& T, float width);

}  // namespace stillmap::simulate::furniture
