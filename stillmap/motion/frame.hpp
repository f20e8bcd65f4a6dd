// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/features.hpp"
#include "stillmap/geometry/smooth_depth_error.hpp"
#include "stillmap/motion/cell_grid.hpp"
#include "stillmap/motion/instance_cells.hpp"
#include "stillmap/segment/instance.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <cmath>
#include <memory>
#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// How much of the scene moves according to DynamicsGate (preset gated-seg).
enum class Dynamics {
  kUnknown,  ///< There is no gate.
  kLow,
  kHigh,
};

/// Evidence for the motion of the parts of a frame. All log-odds are static log-odds,
/// log P(static) / P(moving); 0 means unknown.
struct MotionEvidence {
  /// Per keypoint: sum of all cues' log P(observation | static) - log P(observation | moving).
  std::vector<float> static_log_odds;
  /// Per keypoint: weight of its residuals in every optimization [0..1]; 1 without evidence for
  /// motion, falling with the probability of being static, and 0 below kExcludeBelow in
  /// motion_estimator.cpp.
  std::vector<float> weight;
  /// Per keypoint: log-odds of its surface from the measurements of this and earlier frames, which
  /// later frames may build on. Class priors and a landmark's own history are not included, as they
  /// would be counted again in each frame. Empty if no cue provides surface evidence.
  std::vector<float> measured_log_odds;
  /// Per cell of the frame's CellGrid (rows x columns), or empty: log-odds from measurements and
  /// priors.
  cv::Mat1f surface_log_odds;
  cv::Mat1f surface_measured;      ///< Per cell: log-odds from measurements.
  cv::Mat1f surface_prior;         ///< Per cell: log-odds from the class of the object.
  cv::Mat1f surface_observations;  ///< Per cell: weight of this frame's measurements.
  /// Height x width, 8UC1: 255 for a pixel labeled as moving. Empty if there is none.
  cv::Mat moving_pixels;
  Dynamics dynamics = Dynamics::kUnknown;
};

/// Static log-odds below which a surface is labeled as moving: a probability of one in four.
inline constexpr float kMovingSurface = -1.0986F;

/// Returns the probability of being static from its log-odds.
inline float static_probability(float log_odds) { return 1.0f / (1.0f + std::exp(-log_odds)); }

/// A frame in the front end, before it has a pose. Immutable once made.
struct Frame {
  RgbdFramePtr image;
  FeaturesPtr features;           ///< after motion compensation, without the error of the depth
  FeaturesPtr recorded_features;  ///< of the image as recorded
  /// Velocity (v, w) of the camera in its own frame, for which they were compensated [m/s, rad/s].
  Eigen::Matrix<double, 6, 1> twist = Eigen::Matrix<double, 6, 1>::Zero();
  DepthErrorPtr depth_error;  ///< Error that `features` are without; null: none is known.
  ExposureMotion exposure;    ///< Motion of the camera during the exposure of the depth image.
  CellGridPtr cells;
  SegmentedFramePtr instances;  ///< Null without a network or masks, or before the first result.
  InstanceCellsPtr instance_cells;  ///< Cells of `instances`; null if those are null.
  MotionEvidence evidence;

  std::size_t index() const { return image->index; }
  double timestamp() const { return image->timestamp; }
};

using FramePtr = std::shared_ptr<const Frame>;

}  // namespace stillmap
