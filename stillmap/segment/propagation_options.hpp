// SPDX-License-Identifier: Apache-2.0
#pragma once

namespace stillmap {

/// Parameters of mask propagation; pixels are those of the full image. Lengths were tuned on people
/// at 1 to 4 m in 640 x 480 images, against true masks.
struct PropagationOptions {
  int grid = 20;           ///< Spacing of the optical flow points [pixels].
  int window = 28;         ///< Side of the optical flow window [pixels].
  double growth = 1.5;     ///< Growth of the outline's uncertainty per frame of age [pixels].
  double base_growth = 2;  ///< Uncertainty of the outline at age 0 [pixels].
  int filling = 16;        ///< Width up to which holes and bays may be filled again [pixels].
  /// Maximum depth difference of neighbors on one surface at 2 m [m]; grows with z^2.
  double depth_step = 0.06;
  /// Depth difference beyond which a pixel belongs to another object [m].
  double depth_apart = 0.3;
  int max_age = 30;  ///< Maximum age of propagated masks [frames].
};

}  // namespace stillmap
