// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/back_projection.hpp"
#include "stillmap/dense/dense_view.hpp"
#include "stillmap/dense/far_surface.hpp"
#include "stillmap/dense/fused_depth.hpp"
#include "stillmap/geometry/pose.hpp"
#include "stillmap/sensor/rgbd_frame.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// The newest view, in whose pixels the depths of the following frames are averaged.
///
/// A pixel without a static surface, for example behind a mover, gets the surface that the next
/// frame shows there. A moving pixel of a frame refutes a static surface at its depth.
class OpenView {
 public:
  /// @param view  as made of its own frame; must outlive the object
  OpenView(const DenseView& view, const BackProjectionOptions& options, const FarOptions& far);

  /// Adds a frame.
  /// @param movers pixels of objects that move or may move (not zero), height x width; empty for
  ///   none
  /// @param T_view_frame  pose of the frame's camera in the frame of the view's camera
  void fuse(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& movers,
            const Pose& T_view_frame);

  /// Returns the view with the averaged depths. Pixels that had no surface have the color of the
  /// frame that gave them one; all other colors, and the instances, do not change. A surface that
  /// too few of the frames support is left out.
  DenseView fused() const;

  /// Returns the number of frames that were added.
  int frames() const { return frames_; }

 private:
  void fill(const Camera& camera, const cv::Mat1f& depth, const cv::Mat3b& color,
            const Pose& T_view_frame);
  bool is_supported(int row, int col) const;
  bool is_near(float depth, float sigma) const;
  PixelKind fused_kind(const cv::Mat1f& depth, int row, int col) const;

  const DenseView* view_;
  BackProjectionOptions options_;
  FarOptions far_;
  FusedDepth depth_;
  cv::Mat3b color_;
  int frames_ = 0;
};

}  // namespace stillmap
