// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/random.hpp"

#include <opencv2/core.hpp>

/// Procedural images for the surfaces of rendered scenes: 8UC3 BGR, seeded. Colors are cv::Scalar
/// in the order B G R, 0..255.
namespace stillmap::simulate::paint {

/// Tileable value noise (sum of octaves, each twice as fine and half as strong): 32FC1, about
/// -1..1. `cells`: lattice cells of the coarsest octave over the width and the height.
cv::Mat noise(cv::Size size, cv::Size cells, int octaves, Random& random);
/// Returns base * (1 + strength * value) for every pixel of a 32FC1 field.
cv::Mat tint(const cv::Mat& field, const cv::Scalar& base, double strength);
/// Returns a saturated, not too dark color.
cv::Scalar vivid(Random& random);
/// Returns a typical color of books and clothes.
cv::Scalar muted(Random& random);
/// Returns the color times `factor`.
cv::Scalar shade(const cv::Scalar& color, double factor);

// Surfaces (tileable)
cv::Mat planks(Random& random);                           ///< Oak floor, 2 m.
cv::Mat wood(const cv::Scalar& base, Random& random);     ///< Veneer, 1 m, grain along u.
cv::Mat bricks(Random& random);                           ///< 1.6 m.
cv::Mat plaster(const cv::Scalar& base, Random& random);  ///< 2 m.
cv::Mat wallpaper(Random& random);                        ///< Damask-like motif, 1 m.
cv::Mat ceiling_tiles(Random& random);                    ///< 1.2 m, tiles of 0.6 m.
cv::Mat fabric(const cv::Scalar& base, Random& random);   ///< Woven, 0.25 m.
cv::Mat plain(const cv::Scalar& base, Random& random);    ///< Speckled plastic or lacquer, 0.5 m.
cv::Mat steel(Random& random);                            ///< Brushed, 0.5 m.
cv::Mat cardboard(Random& random);  ///< Parcel side with tape and label, once.
cv::Mat leaf(Random& random);       ///< One leaf.
cv::Mat soil(Random& random);       ///< 0.2 m.
cv::Mat pot(Random& random);        ///< Glazed pot with a band pattern, once.

// Surfaces of a yard (the first tileable, 3 m; the others laid once over a face)
cv::Mat concrete(Random& random);
cv::Mat floor_sign(int number, Random& random);
cv::Mat container_side(const cv::Scalar& color, Random& random);
cv::Mat container_roof(const cv::Scalar& color, Random& random);

// Prints (laid once over a face)
cv::Mat rug(Random& random);
cv::Mat poster(int kind, Random& random);    ///< Kinds 0..5, portrait.
cv::Mat painting(int kind, Random& random);  ///< Kinds 0..2, landscape format.
cv::Mat world_map(Random& random);
cv::Mat whiteboard(Random& random);
cv::Mat pin_board(Random& random);
cv::Mat window_view(Random& random);
cv::Mat screen(int kind, Random& random);  ///< Kinds 0..3: code, page, chart, photo.
cv::Mat keyboard(Random& random);
cv::Mat paper(Random& random);                               ///< A printed sheet.
cv::Mat book_spines(int columns, int rows, Random& random);  ///< An atlas of spines.
cv::Mat book_cover(Random& random);
cv::Mat clock_face();
cv::Mat mug(Random& random);
cv::Mat door(Random& random);
cv::Mat drawers(const cv::Scalar& base, int count, Random& random);
cv::Mat radiator(Random& random);
cv::Mat ball(Random& random);
cv::Mat hazard_crate(Random& random);

// People (laid once around a limb; u = 0.5 is the front)
cv::Mat face(const cv::Scalar& skin, const cv::Scalar& hair, Random& random);
cv::Mat hair(const cv::Scalar& color, Random& random);
cv::Mat skin(const cv::Scalar& color, Random& random);
cv::Mat shirt(int kind, Random& random);         ///< Kinds 0..4.
cv::Mat sleeve(int kind, const cv::Mat& shirt);  ///< The same cloth without print.
cv::Mat trousers(int kind, Random& random);      ///< Kinds 0..2.
cv::Mat shoe(Random& random);

}  // namespace stillmap::simulate::paint
