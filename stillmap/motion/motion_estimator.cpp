// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/motion_estimator.hpp"

#include "stillmap/base/span_names.hpp"
#include "stillmap/base/trace.hpp"

#include <algorithm>
#include <utility>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Probability of being static below which a keypoint is not used.
constexpr float kExcludeBelow = 0.25F;

/// Returns the weight of a keypoint [0..1]: 1 for even odds and above, else twice the probability.
float residual_weight(float static_log_odds) {
  const float p = static_probability(static_log_odds);
  return p < kExcludeBelow ? 0.0f : std::min(1.0f, 2 * p);
}

/// Resets moving regions (8-neighbors) that are too small to be an object to unknown.
void drop_specks(cv::Mat1f& log_odds) {
  constexpr int kMinCells = 16;
  const cv::Mat1b moving = log_odds < kMovingSurface;
  cv::Mat1i labels, regions;
  cv::Mat centroids;
  cv::connectedComponentsWithStats(moving, labels, regions, centroids, 8, CV_32S);
  for (int r = 0; r < labels.rows; ++r) {
    for (int c = 0; c < labels.cols; ++c) {
      const int label = labels(r, c);
      if (label != 0 && regions(label, cv::CC_STAT_AREA) < kMinCells) log_odds(r, c) = 0;
    }
  }
}

/// Returns the minimum over a cell and its neighbors.
float least_around(const cv::Mat1f& surfaces, cv::Point cell) {
  const cv::Rect around = cv::Rect(cell.x - 1, cell.y - 1, 3, 3) & cv::Rect({}, surfaces.size());
  float least = surfaces(cell);
  for (int r = around.y; r < around.br().y; ++r) {
    for (int c = around.x; c < around.br().x; ++c) least = std::min(least, surfaces(r, c));
  }
  return least;
}

/// Returns the log-odds of the keypoints: the mean of their cell and of the minimum around it, as a
/// keypoint's patch covers neighboring cells.
std::vector<float> at_keypoints(const cv::Mat1f& surfaces, const MotionInput& input) {
  std::vector<float> result;
  result.reserve(input.features->size());
  for (const Keypoint& k : input.features->keypoints) {
    const cv::Point cell = input.cells->cell_of(k.u, k.v);
    result.push_back((surfaces(cell) + least_around(surfaces, cell)) / 2);
  }
  return result;
}

/// Returns an image of the cells' values; pixels beyond the grid have the value of the last cell.
cv::Mat1b pixels_of(const cv::Mat1b& cells, cv::Size image) {
  cv::Mat1b pixels(image);
  for (int v = 0; v < image.height; ++v) {
    auto* out = pixels.ptr<std::uint8_t>(v);
    if (v % kCellSide != 0 || v / kCellSide >= cells.rows) {
      std::copy_n(pixels.ptr<std::uint8_t>(v - 1), image.width, out);
      continue;
    }
    const auto* in = cells.ptr<std::uint8_t>(v / kCellSide);
    for (int c = 0; c < cells.cols; ++c) std::fill_n(out + c * kCellSide, kCellSide, in[c]);
    std::fill(out + cells.cols * kCellSide, out + image.width, in[cells.cols - 1]);
  }
  return pixels;
}

/// Combines the evidence for surfaces and transfers it to keypoints and pixels.
void combine_surfaces(MotionEvidence& evidence, const MotionInput& input) {
  const TraceScope scope("surfaces");
  evidence.measured_log_odds = at_keypoints(evidence.surface_measured, input);
  evidence.surface_log_odds = evidence.surface_measured + evidence.surface_prior;
  drop_specks(evidence.surface_log_odds);
  const std::vector<float> log_odds = at_keypoints(evidence.surface_log_odds, input);
  for (std::size_t i = 0; i < log_odds.size(); ++i) evidence.static_log_odds[i] += log_odds[i];
  const cv::Mat1b moving = evidence.surface_log_odds < kMovingSurface;
  if (cv::countNonZero(moving) == 0) return;
  evidence.moving_pixels = pixels_of(moving, input.image->gray.size());
}

std::vector<float> residual_weights(const std::vector<float>& static_log_odds) {
  std::vector<float> weights;
  weights.reserve(static_log_odds.size());
  for (const float log_odds : static_log_odds) weights.push_back(residual_weight(log_odds));
  return weights;
}

}  // namespace

MotionEvidence evidence_of_classes(const Frame& frame) {
  MotionEvidence evidence = frame.evidence;
  evidence.static_log_odds.assign(frame.features->size(), 0);
  evidence.moving_pixels = cv::Mat();
  evidence.surface_log_odds = cv::Mat1f();
  if (!evidence.surface_measured.empty()) {
    // A matrix of its own: zeros() would be written into that of the frame.
    evidence.surface_measured = cv::Mat1f(evidence.surface_measured.size(), 0.0F);
    MotionInput input;
    input.image = frame.image;
    input.features = frame.features;
    input.cells = frame.cells;
    combine_surfaces(evidence, input);
  }
  evidence.weight = residual_weights(evidence.static_log_odds);
  return evidence;
}

MotionEstimator::MotionEstimator(const MotionOptions& options) : cues_(make_cues(options)) {
  has_surface_evidence_ = std::any_of(
      cues_.begin(), cues_.end(), [](const auto& cue) { return cue->provides_surface_evidence(); });
  const auto uses_instances = [](const auto& cue) { return !cue->classes().empty(); };
  first_with_instances_ = static_cast<std::size_t>(
      std::find_if(cues_.begin(), cues_.end(), uses_instances) - cues_.begin());
}

std::set<std::string> MotionEstimator::classes() const {
  std::set<std::string> names;
  for (const auto& cue : cues_) names.merge(cue->classes());
  return names;
}

std::vector<std::string_view> MotionEstimator::cues() const {
  std::vector<std::string_view> names;
  for (const auto& cue : cues_) names.push_back(cue->name());
  return names;
}

MotionEvidence MotionEstimator::estimate(const MotionInput& input) {
  return finish(begin(input), input);
}

void MotionEstimator::add_cues(std::size_t first, std::size_t end, MotionEvidence& evidence,
                               const MotionInput& input) {
  for (std::size_t i = first; i < end; ++i) {
    const TraceScope scope(cues_[i]->name());
    cues_[i]->add_to(evidence, input);
  }
}

MotionEvidence MotionEstimator::begin(const MotionInput& input) {
  const TraceScope scope(span::kMotionBeforeMasks);
  MotionEvidence evidence;
  evidence.static_log_odds.assign(input.features->size(), 0.0f);
  if (has_surface_evidence_) {
    evidence.surface_measured = cv::Mat1f::zeros(input.cells->size());
    evidence.surface_prior = cv::Mat1f::zeros(input.cells->size());
    evidence.surface_observations = cv::Mat1f::zeros(input.cells->size());
  }
  for (const auto& cue : cues_) cue->begin(input);
  add_cues(0, first_with_instances_, evidence, input);
  return evidence;
}

MotionEvidence MotionEstimator::finish(MotionEvidence begun, const MotionInput& input) {
  const TraceScope scope(span::kMotion);
  MotionEvidence evidence = std::move(begun);
  add_cues(first_with_instances_, cues_.size(), evidence, input);
  if (has_surface_evidence_) combine_surfaces(evidence, input);
  evidence.weight = residual_weights(evidence.static_log_odds);
  return evidence;
}

}  // namespace stillmap
