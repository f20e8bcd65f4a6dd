// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/free_space_cue.hpp"

#include "stillmap/geometry/depth_visibility.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Interval of the remembered views, and ages of the views that a frame is compared with [frames];
/// chosen on simulated scenes.
constexpr int kViewInterval = 5;
constexpr std::array kAges = {5, 15, 35, 75, 150};
/// Log-odds of a surface that a view saw through, and of one that a view had in the same place
/// without motion evidence; chosen on simulated scenes.
constexpr double kFreeLogOdds = -3.0, kAgreeingLogOdds = 1.0;
/// Weights of a cell of such a surface relative to a tracked keypoint; chosen on simulated scenes.
constexpr float kFreeWeight = 0.2F, kAgreeingWeight = 0.1F;
/// An object that moves slowly overlaps itself for a while: agreement counts in proportion to the
/// age of the view, in full from this age on [frames].
constexpr int kFullAge = 35;

/// Depth sensors err smoothly over the image (Teichman, Miller, Thrun: Unsupervised intrinsic
/// calibration of depth sensors via SLAM, RSS 2013), so that a surface has another place when it is
/// seen in another part of the image. Largest such error relative to the part of the tolerance that
/// is for noise, and the distance in the image from which on it is reached [widths]; in proportion
/// below. 97 % of the depths of the static surfaces in fr1_rpy and bonn_crowd differ by less.
constexpr float kSmoothError = 2.0F, kFullDistance = 0.3F;

/// Largest difference between the depths of one surface in two cells.
class SurfaceTolerance {
 public:
  explicit SurfaceTolerance(const CellGrid& grid)
      : noise_(grid.tolerance),
        columns_(grid.depth.cols),
        slope_(kSmoothError / (kFullDistance * static_cast<float>(grid.depth.cols))) {}

  /// @param z depth of the surface [m]
  float at(float z, int row, int column, int other_cell) const {
    const auto x = static_cast<float>(other_cell % columns_ - column);
    const auto y = static_cast<float>(other_cell / columns_ - row);
    const float noise = noise_.at(z);
    return noise +
           (noise - noise_.at(0)) * std::min(kSmoothError, slope_ * std::sqrt(x * x + y * y));
  }

 private:
  DepthPolynomial<float> noise_;
  int columns_;
  float slope_;
};

}  // namespace

void FreeSpaceCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  if (!input.ego_motion) {  // The frame may start another world.
    views_.clear();
    return;
  }
  remember(*input.previous, input.ego_motion->T_odometry_previous);
  for (const View* view : chosen(input.image->index)) compare(*view, input, evidence);
}

void FreeSpaceCue::remember(const Frame& frame, const Pose& T_odometry_camera) {
  if (!views_.empty() && frame.index() < views_.back().frame_index + kViewInterval) return;
  views_.push_back({frame.index(), T_odometry_camera, frame.exposure, surface_of(frame)});
  constexpr std::size_t kOldest = kAges.back() + kViewInterval;
  while (views_.front().frame_index + kOldest < frame.index()) views_.pop_front();
}

std::vector<FreeSpaceCue::DepthRange> FreeSpaceCue::surface_of(const Frame& frame) {
  constexpr float kFar = 1e3F, kBehindCamera = -1e3F;
  const cv::Mat1f& depth = frame.cells->depth;
  const cv::Mat1f& measured = frame.evidence.surface_measured;
  cv::Mat1f known = depth.clone(), nearest, farthest;
  known.setTo(kFar, depth <= 0);
  cv::erode(known, nearest, cv::Mat());
  cv::dilate(depth, farthest, cv::Mat());
  std::vector<DepthRange> surface(depth.total());
  for (int i = 0; i < static_cast<int>(surface.size()); ++i) {
    const bool moving = !measured.empty() && measured(i) < kMovingSurface;
    if (depth(i) > 0) {
      surface[static_cast<std::size_t>(i)] = {nearest(i), moving ? kBehindCamera : farthest(i)};
    }
  }
  return surface;
}

/// Returns the view closest to each age, each view once.
std::vector<const FreeSpaceCue::View*> FreeSpaceCue::chosen(std::size_t frame_index) const {
  std::vector<const View*> result;
  for (const int age : kAges) {
    const auto misfit = [&](const View& view) {
      return std::abs(static_cast<int>(frame_index - view.frame_index) - age);
    };
    const auto best =
        std::min_element(views_.begin(), views_.end(),
                         [&](const View& a, const View& b) { return misfit(a) < misfit(b); });
    if (best == views_.end() || misfit(*best) > std::max(kViewInterval, age / 3)) continue;
    if (result.empty() || result.back() != &*best) result.push_back(&*best);
  }
  return result;
}

void FreeSpaceCue::compare(const View& view, const MotionInput& input, MotionEvidence& evidence) {
  const auto age = static_cast<double>(input.image->index - view.frame_index);
  constexpr float kFree = static_cast<float>(kFreeLogOdds) * kFreeWeight;
  const float agreeing =
      static_cast<float>(kAgreeingLogOdds * std::min(1.0, age / kFullAge)) * kAgreeingWeight;
  const float max_depth = input.cells->camera.depth_sensor.depth_at_sigma(kJudgedSigma);
  const Pose T_view_camera = view.T_odometry_camera.inverse() * input.ego_motion->T_odometry_camera;
  const SurfaceTolerance tolerances(*input.cells);
  for_each_reprojected(
      *input.cells, Reprojection(*input.cells, T_view_camera, input.exposure, view.exposure),
      [&](int r, int c, float z, int cell, float z_view) {
        const DepthRange& seen = view.surface[static_cast<std::size_t>(cell)];
        if (seen.nearest <= 0 || z > max_depth) return;
        const float tolerance = tolerances.at(std::max(z, z_view), r, c, cell);
        const Visibility near = visibility_of(z_view, seen.nearest, tolerance);
        const Visibility far = visibility_of(z_view, seen.farthest, tolerance);
        if (near == Visibility::kSeenThrough) {
          evidence.surface_measured(r, c) += kFree;
          evidence.surface_observations(r, c) += kFreeWeight;
        } else if (far == Visibility::kOnSurface || far == Visibility::kSeenThrough) {
          evidence.surface_measured(r, c) += agreeing;
          evidence.surface_observations(r, c) += kAgreeingWeight;
        }
      });
}

}  // namespace stillmap
