// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/open_view.hpp"

#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <cmath>

namespace stillmap {
namespace {

/// A surface needs one supporting image, and one more per kFramesPerSupport frames, but at most
/// kMostSupports in all.
constexpr int kFramesPerSupport = 3, kMostSupports = 4;

/// Returns a depth image without the pixels of a mask.
cv::Mat1f without(const cv::Mat1f& depth, const cv::Mat1b& mask) {
  if (mask.empty()) return depth;
  cv::Mat1f kept = depth.clone();
  kept.setTo(0, mask);
  return kept;
}

/// Returns the largest depth that an average of many frames may be certain enough for.
float farthest(const DepthSensor& sensor, const BackProjectionOptions& near,
               const FarOptions& far) {
  if (near.max_depth > 0) return static_cast<float>(near.max_depth);
  return sensor.depth_at_sigma(std::max(near.max_sigma, far.max_sigma));
}

}  // namespace

OpenView::OpenView(const DenseView& view, const BackProjectionOptions& options,
                   const FarOptions& far)
    : view_(&view), options_(options), far_(far), depth_(view), color_(view.color.clone()) {}

void OpenView::fuse(const Camera& camera, const RgbdFrame& frame, const cv::Mat1b& movers,
                    const Pose& T_view_frame) {
  const TraceScope scope("fused depth");
  const cv::Mat1f depth = without(frame.depth, dilated(movers, options_.mask_dilation));
  const cv::Mat1f moving = movers.empty() ? cv::Mat1f() : without(frame.depth, movers == 0);
  depth_.add(camera, depth, moving, T_view_frame);
  fill(camera, depth, frame.color, T_view_frame);
  ++frames_;
}

/// Sets the pixels without a surface to the depth of the frame's pixels that project to them; if
/// there are several, to the least depth.
void OpenView::fill(const Camera& camera, const cv::Mat1f& depth, const cv::Mat3b& color,
                    const Pose& T_view_frame) {
  const Warp warp(camera, view_->camera, T_view_frame);
  const DepthSensor& sensor = view_->camera.depth_sensor;
  const auto min_depth = static_cast<float>(sensor.min_depth);
  const float max_depth = farthest(sensor, options_, far_);
  cv::Mat1f nearest(depth_.size(), 0.0F);
  for (int row = 0; row < depth.rows; row += view_->stride) {
    for (int col = 0; col < depth.cols; col += view_->stride) {
      const float measured = depth(row, col);
      if (!(measured >= min_depth && measured <= max_depth)) continue;
      const auto [u, v, z] = warp(static_cast<float>(col), static_cast<float>(row), measured);
      const int c = cvRound(u), r = cvRound(v);
      if (!(z > 0) || c < 0 || r < 0 || c >= nearest.cols || r >= nearest.rows) continue;
      if (depth_.at(r, c) > 0 || (nearest(r, c) > 0 && nearest(r, c) <= z)) continue;
      nearest(r, c) = z;
      color_(r, c) = color(row, col);
    }
  }
  for (int r = 0; r < nearest.rows; ++r) {
    for (int c = 0; c < nearest.cols; ++c) {
      if (nearest(r, c) > 0) depth_.set(r, c, nearest(r, c));
    }
  }
}

bool OpenView::is_supported(int row, int col) const {
  const int count = depth_.supported(row, col);
  const int needed = std::min(1 + frames_ / kFramesPerSupport, kMostSupports);
  return count > depth_.refuted(row, col) && count >= needed;
}

/// Returns whether a depth is certain enough for a surface that is not far.
bool OpenView::is_near(float depth, float sigma) const {
  if (options_.max_depth > 0) return depth <= static_cast<float>(options_.max_depth);
  return sigma <= static_cast<float>(options_.max_sigma * view_->camera.depth_sensor.scene_scale);
}

/// @param depth  averaged depths of supported surfaces [m]
PixelKind OpenView::fused_kind(const cv::Mat1f& depth, int row, int col) const {
  const float z = depth(row, col);
  const auto own = static_cast<PixelKind>(view_->kind(row, col));
  if (z <= 0) return own == kMoverSurface || own == kFarSurface ? own : kNoSurface;
  const float sigma = depth_.sigma(row, col);
  if (!is_near(z, sigma)) return own == kFarSurface ? own : kNoSurface;
  const float own_z = view_->depth(row, col) * DenseView::kDepthUnit;
  const bool same = view_->is_static(row, col) && std::abs(z - own_z) <= depth_.agreement(z);
  if (same) return own;  // which is not at a jump in all pixels of its frame
  const float jump = std::max(static_cast<float>(options_.max_jump) * z, kJumpNoise * sigma);
  return at_jump(depth, col, row, jump) ? kNoSurface : kStaticSurface;
}

DenseView OpenView::fused() const {
  const TraceScope scope("fused view");
  cv::Mat1f depth(depth_.size(), 0.0F);
  for (int row = 0; row < depth.rows; ++row) {
    for (int col = 0; col < depth.cols; ++col) {
      if (is_supported(row, col)) depth(row, col) = depth_.at(row, col);
    }
  }
  DenseView fused = copy_of(*view_);
  color_.copyTo(fused.color);
  for (int row = 0; row < depth.rows; ++row) {
    for (int col = 0; col < depth.cols; ++col) {
      fused.kind(row, col) = fused_kind(depth, row, col);
      if (depth(row, col) > 0) fused.depth(row, col) = packed_depth(depth(row, col));
    }
  }
  return fused;
}

}  // namespace stillmap
