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

/// The newest view while the depths of the frames after it are averaged in its pixels.
///
/// Pixels without a static surface, such as those behind a mover, take that of the first frame that
/// has one. Moving pixels of a frame refute a static surface at their depth.
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

  /// Returns the view with the averaged depths. Colors and instances are those of its own frame,
  /// the color behind a mover that of the frame which showed it first. After several frames, a
  /// surface that only one of them supports is left out.
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
