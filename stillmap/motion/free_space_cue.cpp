// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/free_space_cue.hpp"

#include "stillmap/geometry/depth_visibility.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace stillmap {

void FreeSpaceCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  if (!input.ego_motion) {  // the world may be another from here on
    views_.clear();
    return;
  }
  remember(*input.previous, input.ego_motion->T_world_previous);
  for (const View* view : chosen(input.image->index)) compare(*view, input, evidence);
}

void FreeSpaceCue::remember(const Frame& frame, const Pose& T_world_camera) {
  const auto every = static_cast<std::size_t>(options_.view_every);
  if (!views_.empty() && frame.index() < views_.back().frame_index + every) return;
  views_.push_back({frame.index(), T_world_camera, surface_of(frame)});
  const auto oldest = static_cast<std::size_t>(
      *std::max_element(options_.ages.begin(), options_.ages.end()) + options_.view_every);
  while (views_.front().frame_index + oldest < frame.index()) views_.pop_front();
}

std::vector<FreeSpaceCue::DepthRange> FreeSpaceCue::surface_of(const Frame& frame) {
  constexpr float kFar = 1e3F, kNowhere = -1e3F;
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
      surface[static_cast<std::size_t>(i)] = {nearest(i), moving ? kNowhere : farthest(i)};
    }
  }
  return surface;
}

/// For each age the view that comes nearest to it, each view once.
std::vector<const FreeSpaceCue::View*> FreeSpaceCue::chosen(std::size_t frame_index) const {
  std::vector<const View*> result;
  for (const int age : options_.ages) {
    const auto misfit = [&](const View& view) {
      return std::abs(static_cast<int>(frame_index - view.frame_index) - age);
    };
    const auto best =
        std::min_element(views_.begin(), views_.end(),
                         [&](const View& a, const View& b) { return misfit(a) < misfit(b); });
    if (best == views_.end() || misfit(*best) > std::max(options_.view_every, age / 3)) continue;
    if (result.empty() || result.back() != &*best) result.push_back(&*best);
  }
  return result;
}

void FreeSpaceCue::compare(const View& view, const MotionInput& input,
                           MotionEvidence& evidence) const {
  const auto intruding_count = static_cast<float>(options_.intruding_count);
  const auto age = static_cast<double>(input.image->index - view.frame_index);
  const auto agreeing_count = static_cast<float>(options_.agreeing_count);
  const float intruding = static_cast<float>(options_.intruding) * intruding_count;
  const float agreeing =
      static_cast<float>(options_.agreeing * std::min(1.0, age / options_.full_age)) *
      agreeing_count;
  const float max_depth = input.cells->camera.depth_sensor.depth_at_sigma(kJudgedSigma);
  const Pose T_view_camera = view.T_world_camera.inverse() * input.ego_motion->T_world_camera;
  for_each_reprojected(
      *input.cells, T_view_camera, [&](int r, int c, float z, int cell, float z_view) {
        const DepthRange& seen = view.surface[static_cast<std::size_t>(cell)];
        if (seen.nearest <= 0 || z > max_depth) return;
        const float tolerance = input.cells->tolerance.at(std::max(z, z_view));
        const Visibility near = visibility_of(z_view, seen.nearest, tolerance);
        const Visibility far = visibility_of(z_view, seen.farthest, tolerance);
        if (near == Visibility::kSeenThrough) {
          evidence.surface_measured(r, c) += intruding;
          evidence.surface_observations(r, c) += intruding_count;
        } else if (far == Visibility::kOnSurface || far == Visibility::kSeenThrough) {
          evidence.surface_measured(r, c) += agreeing;
          evidence.surface_observations(r, c) += agreeing_count;
        }
      });
}

}  // namespace stillmap
