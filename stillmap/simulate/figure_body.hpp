// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/simulate/mover.hpp"
#include "stillmap/simulate/palette.hpp"

#include <vector>

namespace stillmap::simulate {

// Segment lengths of an adult of 1.75 m, meters (after Winter 2009, Biomechanics, figure 4.1).
constexpr float kThigh = 0.43F, kShank = 0.43F, kAnkle = 0.08F, kHipHalf = 0.095F;
constexpr float kUpperArm = 0.29F, kForearm = 0.26F, kShoulderHalf = 0.195F,
                kShoulderHeight = 0.49F;
constexpr float kNeckHeight = 0.56F, kStandingPelvis = 0.90F, kStep = 0.5F;

/// Parts of a figure in the order of Mover::parts. Each part's frame is at its joint, its bone
/// along -z. Left is +x, since the figure faces -y.
enum Part {
  kPelvis,
  kTorso,
  kHead,
  kLeftUpperArm,
  kRightUpperArm,
  kLeftForearm,
  kRightForearm,
  kLeftThigh,
  kRightThigh,
  kLeftShank,
  kRightShank,
  kLeftFoot,
  kRightFoot,
  kParts
};

/// Parts of a dressed figure, and its scale relative to the lengths above.
struct FigureBody {
  float scale = 1;
  std::vector<RigidPart> parts;
};
FigureBody make_figure_body(int number, Palette& palette);

}  // namespace stillmap::simulate
