// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/texture.hpp"

#include <Eigen/Core>

namespace stillmap::simulate {

/// Footprint of a pixel on a texture: its center and its longer and shorter axis.
struct Footprint {
  float u, v;             // repeats
  Eigen::Vector2f along;  // the longer axis, repeats
  float long2, short2;    // squared lengths, texels
};

/// Returns the filtered texture of a pixel: up to kProbes trilinear samples along the longer axis
/// of the footprint (after McCormack et al. 1999, Feline), so that floors at grazing angles stay
/// sharp.
Eigen::Vector3f filtered(const Texture& texture, const Footprint& f);

}  // namespace stillmap::simulate
