// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/motion/frame.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <memory>

/// Small simulated scenes and true frames for tests of mover tracking.
namespace stillmap::test {

/// Returns a sequence of five seconds with movers close to the camera.
inline SimulationOptions near_movers(int people, int objects) {
  SimulationOptions options;
  options.people = people;
  options.things = objects;
  options.near_things = true;
  options.frames = 100;
  options.fps = 20;
  options.width = 320;
  options.height = 240;
  return options;
}

/// Returns a frame with the true depth and the true masks as surface evidence.
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
