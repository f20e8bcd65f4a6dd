// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/free_space_cue.hpp"

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
  View view{frame.index(), T_world_camera, {}, {}, {}};
  const cv::Mat1f& depth = frame.cells->depth;
  constexpr float kFar = 1e3F;
  const cv::Mat1b unknown = depth <= 0;
  cv::Mat1f known = depth.clone();
  known.setTo(kFar, unknown);
  cv::erode(known, view.nearest, cv::Mat());
  cv::dilate(depth, view.farthest, cv::Mat());
  view.nearest.setTo(0, unknown);
  view.moving = frame.evidence.surface_measured.empty()
                    ? cv::Mat1b::zeros(depth.size())
                    : cv::Mat1b(frame.evidence.surface_measured < kMovingSurface);
  views_.push_back(std::move(view));
  const auto oldest = static_cast<std::size_t>(
      *std::max_element(options_.ages.begin(), options_.ages.end()) + options_.view_every);
  while (views_.front().frame_index + oldest < frame.index()) views_.pop_front();
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
  const auto max_depth = static_cast<float>(options_.max_depth);
  const Pose T_view_camera = view.T_world_camera.inverse() * input.ego_motion->T_world_camera;
  for_each_reprojected(*input.cells, T_view_camera,
                       [&](int r, int c, float z, int r_view, int c_view, float pz) {
                         const float nearest = view.nearest(r_view, c_view);
                         if (nearest <= 0 || z > max_depth) return;
                         const float tolerance = depth_tolerance(std::max(z, pz));
                         if (pz < nearest - tolerance) {
                           evidence.surface_measured(r, c) += intruding;
                           evidence.surface_observations(r, c) += intruding_count;
                         } else if (pz < view.farthest(r_view, c_view) + tolerance &&
                                    view.moving(r_view, c_view) == 0) {
                           evidence.surface_measured(r, c) += agreeing;
                           evidence.surface_observations(r, c) += agreeing_count;
                         }
                       });
}

}  // namespace stillmap
