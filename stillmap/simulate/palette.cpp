// SPDX-License-Identifier: Apache-2.0
#include "stillmap/simulate/palette.hpp"

namespace stillmap::simulate {
namespace {

constexpr int kSpineColumns = 16, kSpineRows = 4;

/// Returns one material per spine of an atlas, slightly inside its borders.
std::vector<Material> cut_spines(const Material& atlas) {
  std::vector<Material> spines;
  const float width = 1.0F / kSpineColumns, height = 1.0F / kSpineRows, inset = 0.02F;
  for (int i = 0; i < kSpineColumns * kSpineRows; ++i) {
    const float u = width * static_cast<float>(i % kSpineColumns);
    const float v = height * static_cast<float>(i / kSpineColumns);
    Material spine = atlas;
    spine.window = {u + inset * width, v + inset * height, u + (1 - inset) * width,
                    v + (1 - inset) * height};
    spines.push_back(spine);
  }
  return spines;
}

}  // namespace

Material Palette::add(const cv::Mat& bgr, float meters) {
  textures.emplace_back(bgr);
  Material material;
  material.texture = static_cast<int>(textures.size()) - 1;
  material.meters = meters;
  return material;
}

Palette::Palette(Textures& into, Random& dice) : textures(into), random(dice) {
  floor = add(paint::planks(random), 2);
  wall = add(paint::plaster({196, 208, 212}, random), 2);
  accent_wall = add(paint::bricks(random), 1.6F);
  wallpaper = add(paint::wallpaper(random), 1);
  ceiling = add(paint::ceiling_tiles(random), 1.2F);
  rug = add(paint::rug(random));
  oak = add(paint::wood({110, 160, 205}, random), 1);
  walnut = add(paint::wood({52, 80, 118}, random), 1);
  white = add(paint::plain({222, 224, 224}, random), 0.5F);
  black = add(paint::plain({42, 40, 40}, random), 0.5F);
  gray = add(paint::plain({128, 126, 124}, random), 0.5F);
  steel = add(paint::steel(random), 0.5F);
  glow = add(cv::Mat(8, 8, CV_8UC3, cv::Scalar(250, 253, 255)));
  glow.emission = 1.6F;
  door = add(paint::door(random));
  radiator = add(paint::radiator(random));
  window = add(paint::window_view(random));
  window.emission = 0.75F;
  whiteboard = add(paint::whiteboard(random));
  pin_board = add(paint::pin_board(random));
  map = add(paint::world_map(random));
  clock = add(paint::clock_face());
  keyboard = add(paint::keyboard(random));
  leaf = add(paint::leaf(random));
  soil = add(paint::soil(random), 0.2F);
  cardboard = add(paint::cardboard(random));
  crate = add(paint::hazard_crate(random));
  ball = add(paint::ball(random));
  for (const cv::Scalar& color : {cv::Scalar(140, 84, 48), cv::Scalar(60, 62, 160),
                                  cv::Scalar(76, 122, 70), cv::Scalar(70, 66, 64)}) {
    fabrics.push_back(add(paint::fabric(color, random), 0.25F));
  }
  for (int i = 0; i < 9; ++i) posters.push_back(add(paint::poster(i, random)));
  for (int i = 0; i < 5; ++i) paintings.push_back(add(paint::painting(i % 3, random)));
  for (int i = 0; i < 6; ++i) {
    screens.push_back(add(paint::screen(i, random)));
    screens.back().emission = 0.5F;
  }
  for (int i = 0; i < 4; ++i) papers.push_back(add(paint::paper(random)));
  for (int i = 0; i < 6; ++i) covers.push_back(add(paint::book_cover(random)));
  spines = cut_spines(add(paint::book_spines(kSpineColumns, kSpineRows, random)));
  for (int i = 0; i < 3; ++i) pots.push_back(add(paint::pot(random)));
  for (int i = 0; i < 4; ++i) mugs.push_back(add(paint::mug(random)));
  drawers.push_back(add(paint::drawers({206, 210, 212}, 3, random)));
  drawers.push_back(add(paint::drawers({84, 126, 168}, 4, random)));
  drawers.push_back(add(paint::drawers({120, 104, 92}, 2, random)));
}

}  // namespace stillmap::simulate
