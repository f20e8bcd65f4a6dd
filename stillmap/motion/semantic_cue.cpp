// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/semantic_cue.hpp"

#include <algorithm>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Draws the instance (its mask, else its whole box) into a full-size mask, dilated by `dilation`
/// pixels.
void draw_dilated(const Instance& instance, int dilation, cv::Mat& pixels) {
  const cv::Rect image(0, 0, pixels.cols, pixels.rows);
  const cv::Rect grown =
      cv::Rect(instance.box.x - dilation, instance.box.y - dilation,
               instance.box.width + 2 * dilation, instance.box.height + 2 * dilation) &
      image;
  if (grown.empty()) return;
  if (instance.mask.empty()) {
    pixels(grown).setTo(255);
    return;
  }
  cv::Mat patch = cv::Mat::zeros(grown.size(), CV_8UC1);
  instance.mask.copyTo(patch(instance.box - grown.tl()));
  const int side = 2 * dilation + 1;
  cv::dilate(patch, patch, cv::getStructuringElement(cv::MORPH_RECT, {side, side}));
  cv::Mat region = pixels(grown);
  cv::max(region, patch, region);
}

}  // namespace

SemanticCue::SemanticCue(const SemanticCueOptions& options) : options_(options) {}

std::set<std::string> SemanticCue::classes() const {
  return {options_.classes.dynamic.begin(), options_.classes.dynamic.end()};
}

bool SemanticCue::is_dynamic(const Instance& instance) const {
  return options_.classes.role_of(instance.class_name) == ClassRole::kDynamic;
}

void SemanticCue::add_to(MotionEvidence& evidence, const MotionInput& input) {
  if (!input.instances) return;
  const auto& instances = input.instances->instances;
  if (std::none_of(instances.begin(), instances.end(),
                   [&](const auto& i) { return is_dynamic(i); })) {
    return;
  }
  if (!evidence.surface_prior.empty()) {
    evidence.surface_prior = prior_of_surfaces(*input.instances, *input.instance_cells);
    return;
  }
  if (evidence.moving_pixels.empty()) {
    evidence.moving_pixels = cv::Mat::zeros(input.image->gray.size(), CV_8UC1);
  }
  cv::Mat& moving = evidence.moving_pixels;
  for (const Instance& instance : instances) {
    if (is_dynamic(instance)) draw_dilated(instance, options_.dilation, moving);
  }
  const auto& keypoints = input.features->keypoints;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const int u = std::clamp(cvRound(keypoints[i].u), 0, moving.cols - 1);
    const int v = std::clamp(cvRound(keypoints[i].v), 0, moving.rows - 1);
    if (moving.at<std::uint8_t>(v, u) != 0) evidence.static_log_odds[i] -= kCertainlyMoving;
  }
}

cv::Mat1f SemanticCue::prior_of_surfaces(const SegmentedFrame& segmented,
                                         const InstanceCells& cells) const {
  cv::Mat1f prior = cv::Mat1f::zeros(cells.front().size());
  for (std::size_t i = 0; i < cells.size(); ++i) {
    const Instance& instance = segmented.instances[i];
    if (!is_dynamic(instance)) continue;
    const auto against = static_cast<float>(-options_.prior * instance.confidence);
    const cv::Mat1f lower = cv::min(prior, against);
    lower.copyTo(prior, cells[i]);
  }
  return prior;
}

}  // namespace stillmap
