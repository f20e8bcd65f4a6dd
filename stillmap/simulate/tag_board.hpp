// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/palette.hpp"
#include "stillmap/simulate/scene.hpp"

#include <span>

namespace stillmap::simulate {

/// Hangs the AprilTags 0, 1, 2, ... of family tag36h11 in a scene, each printed with its white
/// margin on a light board of 0.256 m x 0.256 m x 12 mm. Adds them to the statics (not lit yet) and
/// the tags of the scene. Uses no random numbers, so that all else looks as without tags.
/// @param places  one per tag: the center of the board on the surface behind it, facing -y
void hang_tags(std::span<const Transform> places, Palette& palette, Scene& scene);

}  // namespace stillmap::simulate
