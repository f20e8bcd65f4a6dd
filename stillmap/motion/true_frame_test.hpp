// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/frame.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <memory>

/// For tests of what follows movers: small scenes, and frames of which the truth is known.
namespace stillmap::test {

/// Five seconds with movers close before the camera.
inline SimulationOptions near_movers(int people, int things) {
  SimulationOptions options;
  options.people = people;
  options.things = things;
  options.near_things = true;
  options.frames = 100;
  options.fps = 20;
  options.width = 320;
  options.height = 240;
  return options;
}

/// True masks as evidence on surfaces, and the true depth.
inline std::shared_ptr<Frame> true_frame(const SimulatedSequence& sequence,
                                         const TruthFrame& truth) {
  auto image = std::make_shared<RgbdFrame>();
  image->index = truth.index;
  image->timestamp = truth.timestamp;
  image->depth = truth.depth;
  auto frame = std::make_shared<Frame>();
  frame->image = image;
  frame->cells = std::make_shared<CellGrid>(truth.depth, sequence.camera());
  frame->evidence.moving_pixels = truth.instances != 0;
  frame->evidence.surface_log_odds = cv::Mat1f(frame->cells->size(), 1.0F);
  return frame;
}

}  // namespace stillmap::test
