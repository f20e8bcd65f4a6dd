// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/texture.hpp"

#include <Eigen/Core>

namespace stillmap::simulate {

/// What one pixel covers of a texture: its middle and the longer and shorter axis of its footprint.
struct Footprint {
  float u, v;             // repeats
  Eigen::Vector2f along;  // the longer axis, repeats
  float long2, short2;    // squared lengths, texels
};

/// The texture under a pixel: up to kProbes trilinear samples along the footprint's longer axis
/// (after McCormack et al. 1999, Feline), so that floors seen at a grazing angle stay sharp.
Eigen::Vector3f filtered(const Texture& texture, const Footprint& f);

}  // namespace stillmap::simulate
