// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mesh.hpp"
#include "stillmap/simulate/paint.hpp"
#include "stillmap/simulate/random.hpp"
#include "stillmap/simulate/texture.hpp"

#include <vector>

namespace stillmap::simulate {

/// The materials of a furnished room. Painting them fills the texture list of a scene.
struct Palette {
  Palette(Textures& into, Random& dice);

  /// Adds an image to the scene's textures.
  /// @param meters  length of one repeat [m]; 0: stretched once over the face
  Material add(const cv::Mat& bgr, float meters = 0);

  Textures& textures;
  Random& random;

  Material floor, wall, accent_wall, wallpaper, ceiling, rug;
  Material oak, walnut, white, black, gray, steel, glow;
  Material door, radiator, window, whiteboard, pin_board, map, clock, keyboard;
  Material leaf, soil, cardboard, crate, ball;
  std::vector<Material> fabrics, posters, paintings, screens, papers, covers, spines, pots, mugs,
      drawers;
};

}  // namespace stillmap::simulate
