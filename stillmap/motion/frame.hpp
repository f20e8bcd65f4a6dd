// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/motion/cell_grid.hpp"
#include "stillmap/motion/instance_cells.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cmath>
#include <memory>
#include <vector>

namespace stillmap {

/// What is known about which parts of a frame move.
struct MotionEvidence {
  /// Per keypoint, the log-odds that it lies on something static: the sum of what each cue says,
  /// log P(observation | static) - log P(observation | moving). 0 = nothing is known.
  std::vector<float> static_log_odds;
  /// Per keypoint, what its residuals count for in every optimization, 0 to 1: 1 where nothing
  /// speaks against it, falling with the probability of being static, and 0, left out, below
  /// kExcludeBelow in motion_estimator.cpp.
  std::vector<float> weight;
  /// Per keypoint, what was measured of its surface, by this frame and those before it: of the
  /// above what later frames may go on from. A class's prior and a landmark's own history are no
  /// measurements, and would be counted anew in each frame. Empty where no cue speaks of surfaces.
  std::vector<float> measured_log_odds;
  /// The same of surfaces, per cell of the frame's CellGrid (rows x columns), or empty:
  /// log-odds from all that is known,
  cv::Mat1f surface_log_odds;
  cv::Mat1f surface_measured;      ///< from what was measured only,
  cv::Mat1f surface_prior;         ///< from what is expected of things of that class,
  cv::Mat1f surface_observations;  ///< and what the present frame's measurements count for.
  /// Height x width, 8UC1: 255 where a pixel is taken for moving. Empty: no pixel is.
  cv::Mat moving_pixels;
};

/// Log-odds below which a surface is taken for moving: one in four to be static.
inline constexpr float kMovingSurface = -1.0986F;

/// Probability that something is static, of its log-odds.
inline float static_probability(float log_odds) { return 1.0f / (1.0f + std::exp(-log_odds)); }

/// A frame as the front end sees it, before it has a pose. Never changed once made.
struct Frame {
  RgbdFramePtr image;
  FeaturesPtr features;
  CellGridPtr cells;
  SegmentedFramePtr
      instances;  ///< null where there is neither a network nor masks, or none has come yet
  InstanceCellsPtr instance_cells;  ///< of `instances`; null where those are
  MotionEvidence evidence;

  std::size_t index() const { return image->index; }
  double timestamp() const { return image->timestamp; }
};

using FramePtr = std::shared_ptr<const Frame>;

}  // namespace stillmap
