// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/residual_cue.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr double kStep = 6;  // pixels between two frames

/// Returns the log-odds of a keypoint on level 3 that moved by kStep pixels for a camera at rest.
double log_odds_of_a_step(const PyramidShape& pyramid) {
  const Camera camera;
  ResidualCue cue;
  MotionEvidence evidence;
  for (const double u : {300.0, 300 + kStep}) {
    auto features = std::make_shared<Features>();
    features->keypoints = {{.u = static_cast<float>(u), .v = 200, .depth = 2, .level = 3}};
    MotionInput input;
    input.features = features;
    input.pyramid = pyramid;
    input.cells = std::make_shared<CellGrid>(cv::Mat1f(camera.height, camera.width, 2.0F), camera);
    input.ego_motion.emplace();
    input.ego_motion->previous = {0};
    input.ego_motion->landmark_log_odds = {0};
    evidence.surface_measured = cv::Mat1f::zeros(input.cells->size());
    evidence.surface_observations = cv::Mat1f::zeros(input.cells->size());
    cue.add_to(evidence, input);
  }
  return cv::sum(evidence.surface_measured)[0];
}

TEST(ResidualCue, ExpectsErrorsAsLargeAsThePyramidsLevelsAreCoarse) {
  for (const double scale_factor : {1.2, 1.5}) {
    const double scale = std::pow(scale_factor, 3);
    const double pose_sigma = Camera{}.fx * ResidualCue::kPoseSigma / 2;  // pixels at 2 m
    const double variance = 2 * scale * scale + pose_sigma * pose_sigma;
    EXPECT_NEAR(log_odds_of_a_step({8, scale_factor}),
                ResidualCue::kBestLogOdds - kStep * kStep / variance / 2, 1e-4)
        << scale_factor;
  }
}

}  // namespace
}  // namespace stillmap
