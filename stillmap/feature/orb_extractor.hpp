// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/fields.hpp"
#include "stillmap/feature/brief.hpp"
#include "stillmap/feature/cpu.hpp"
#include "stillmap/feature/fast.hpp"
#include "stillmap/feature/features.hpp"
#include "stillmap/feature/pyramid.hpp"
#include "stillmap/feature/quadtree.hpp"

#include <optional>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

struct OrbOptions {
  int keypoints = 1000;       ///< at most per image, all levels together
  int levels = 8;             ///< of the scale pyramid, 1 to 16
  double scale_factor = 1.2;  ///< between neighboring levels, in (1, 2]
  int fast_threshold = 20;  ///< gray values by which 9 ring pixels in a row differ from the center
  int fast_threshold_low = 7;  ///< the same, where a cell has no corner at fast_threshold
  int cell = 30;               ///< side of the cells that get the second threshold [level's pixels]
  int border = 16;             ///< no corner nearer to a level's edge [level's pixels], at least 16
  bool subpixel = true;        ///< refine corners below the pixel (see subpixel.hpp)
  double depth_jump = 0.05;    ///< relative depth step around a keypoint that makes a depth edge
  STILLMAP_FIELDS(keypoints, levels, scale_factor, fast_threshold, fast_threshold_low, cell, border,
                  subpixel, depth_jump)

  PyramidShape pyramid() const { return {levels, scale_factor}; }
};

/// ORB features: FAST corners on a scale pyramid, spread by a quadtree, oriented by their intensity
/// centroid, described by steered BRIEF (Rublee, Rabaud, Konolige, Bradski: ORB, ICCV 2011), with
/// corners refined below the pixel and a depth for each.
///
/// An object owns the buffers it reuses from image to image: use one per thread. What it returns
/// depends on the images and options alone: not on the machine's instruction set and not on earlier
/// images.
class OrbExtractor {
 public:
  /// Throws Error where an option is out of its range.
  explicit OrbExtractor(const OrbOptions& options = {}, CpuPath path = best_cpu_path());

  /// @param gray   8UC1, any size; too small or without texture: no keypoints
  /// @param depth  32FC1 of the same size, meters, 0 or not finite where unknown; empty: no depths
  /// @param keypoints  at most; none: options.keypoints
  /// Throws Error where a type or size is another. Keypoints are ordered by level; a level that has
  /// too few corners leaves its share to the coarser ones.
  Features extract(const cv::Mat& gray, const cv::Mat& depth = {},
                   std::optional<int> keypoints = std::nullopt);

  const OrbOptions& options() const { return options_; }

 private:
  void extract_level(int level, int wanted, Features& features);

  OrbOptions options_;
  CpuPath path_;
  ImagePyramid pyramid_;
  FastDetector detector_;
  QuadtreeSpreader spreader_;
  Blur blur_;
  std::vector<PatchMoments> moments_;
};

/// Depth of the surface a keypoint sits on [meters], 0 where the image has none: the value at the
/// nearest pixel; where the 3 x 3 neighborhood steps by more than `jump` (relative), that of its
/// nearer side, since a corner at a depth edge belongs to the thing in front.
float depth_at(const cv::Mat& depth, float u, float v, double jump);

}  // namespace stillmap
