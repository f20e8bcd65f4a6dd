// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/feature/brief.hpp"
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/fast.hpp"
#include "stillmap/feature/features.hpp"
#include "stillmap/feature/pyramid.hpp"
#include "stillmap/feature/quadtree.hpp"
#include "stillmap/geometry/depth_sensor.hpp"

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// What counts as a depth edge: a step larger than both limits.
struct DepthEdge {
  double relative = 0.05;           ///< Limit relative to the depth; infinite: there are no edges.
  DepthPolynomial<double> noise{};  ///< Limit by the noise of the sensor at a depth [m].

  bool between(double nearer, double farther) const {
    return farther > nearer * (1 + relative) && farther > nearer + noise.at(nearer);
  }
};

/// Returns the depth edges that a sensor can tell from its noise.
DepthEdge depth_edge_of(const DepthSensor& sensor);

struct OrbOptions {
  int keypoints = 1000;       ///< Maximum number of keypoints per image over all levels.
  int levels = 8;             ///< Number of levels of the scale pyramid, 1 to 16.
  double scale_factor = 1.2;  ///< Scale factor between neighboring levels, in (1, 2].
  int fast_threshold = 20;    ///< FAST threshold [gray values].
  /// FAST threshold in cells without a corner at fast_threshold [gray values].
  int fast_threshold_low = 7;
  /// Minimum distance of corners from the border, at least 16 [pixels of the level].
  int border = 16;
  bool subpixel = true;  ///< Whether corners are refined to sub-pixel accuracy (see subpixel.hpp).
  DepthEdge depth_edge{};  ///< See depth_at().

  PyramidShape pyramid() const { return {levels, scale_factor}; }
};

/// ORB features: FAST corners on a scale pyramid, distributed by a quadtree, oriented by their
/// intensity centroid, described by steered BRIEF (Rublee, Rabaud, Konolige, Bradski: ORB, ICCV
/// 2011), with sub-pixel refinement and a depth for each.
///
/// An object owns buffers that it reuses: use one per thread. The result depends on images and
/// options only, not on the instruction set or on earlier images.
class OrbExtractor {
 public:
  /// Throws Error if an option is out of range.
  explicit OrbExtractor(const OrbOptions& options = {}, CpuPath path = best_cpu_path());

  /// @param gray   8UC1, any size; too small or without texture: no keypoints
  /// @param depth  32FC1 of the same size [m], 0 or not finite where unknown; empty: no depths
  /// @param keypoints  maximum number; none: options.keypoints
  /// @param ignored  mask of ignored pixels, 8UC1 of the same size: corners whose FAST circle
  ///                 contains a nonzero pixel are dropped; must not be modified between calls;
  ///                 empty: all pixels are used
  /// Throws Error for other types or sizes. Keypoints are ordered by level; a level with too few
  /// corners passes its share to the coarser levels.
  Features extract(const cv::Mat& gray, const cv::Mat& depth = {},
                   std::optional<int> keypoints = std::nullopt, const cv::Mat& ignored = {});

  const OrbOptions& options() const { return options_; }

 private:
  void extract_level(int level, int wanted, Features& features);
  void ignore(const cv::Mat& pixels);
  const std::vector<Corner>& used(const std::vector<Corner>& corners, int level);

  OrbOptions options_;
  CpuPath path_;
  ImagePyramid pyramid_;
  FastDetector detector_;
  QuadtreeSpreader spreader_;
  Blur blur_;
  std::vector<PatchMoments> moments_;
  cv::Mat ignored_;   // mask of the last image
  cv::Mat distance_;  // to the nearest ignored pixel, 32FC1 [pixels]; empty without a mask
  std::vector<Corner> used_;
};

/// Returns the depth of a keypoint's surface [m], 0 if unknown: the value at the nearest pixel; at
/// a depth edge (by the range of the 3 x 3 neighborhood) that of the nearer side, since such a
/// corner belongs to the object in front.
float depth_at(const cv::Mat& depth, float u, float v, const DepthEdge& edge);

}  // namespace stillmap
