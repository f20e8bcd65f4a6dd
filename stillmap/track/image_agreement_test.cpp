// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/image_agreement.hpp"

#include "stillmap/simulate/simulated_sequence.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns an office with one person, 320x240, seen by a camera that moves.
SimulatedSequence office() {
  SimulationOptions options;
  options.people = 1;
  options.frames = 10;
  options.width = 320;
  options.height = 240;
  return SimulatedSequence(options);
}

class ImageAgreementTest : public ::testing::Test {
 protected:
  ImageAgreementTest() : sequence_(office()) {}
  Pose true_motion() const {
    return sequence_.T_world_camera(0).inverse() * sequence_.T_world_camera(6);
  }
  ImageAgreement images() const {
    return ImageAgreement(sequence_.camera(), *sequence_.at(0).frame, *sequence_.at(6).frame);
  }
  SimulatedSequence sequence_;
};

TEST_F(ImageAgreementTest, IsLargestForTheTrueMotion) {
  const ImageAgreement images = this->images();
  const double best = images.of(true_motion());
  EXPECT_GT(best, 0.5);
  for (int axis = 0; axis < 6; ++axis) {
    Eigen::Matrix<double, 6, 1> error = Eigen::Matrix<double, 6, 1>::Zero();
    error(axis) = axis < 3 ? 0.05 : 0.02;  // m, rad
    EXPECT_LT(images.of(true_motion() * Pose::exp(error)), 0.9 * best) << axis;
  }
}

TEST_F(ImageAgreementTest, RefinesAMotion) {
  Eigen::Matrix<double, 6, 1> error;
  error << 0.01, -0.006, 0.01, 0.002, 0.003, -0.002;
  const Pose guess = true_motion() * Pose::exp(error);
  const ImageAgreement images = this->images();
  const Pose difference = true_motion().inverse() * images.refined(guess);
  EXPECT_LT(difference.translation().norm(), 0.003);
  EXPECT_LT(so3_log(difference.quaternion()).norm(), 0.001);
  EXPECT_GT(images.of(images.refined(guess)), 1.5 * images.of(guess));
}

TEST_F(ImageAgreementTest, DoesNotDependOnTheExposure) {
  auto darker = std::make_shared<RgbdFrame>(*sequence_.at(6).frame);
  darker->gray = darker->gray - cv::Scalar(15);
  const ImageAgreement images(sequence_.camera(), *sequence_.at(0).frame, *darker);
  EXPECT_NEAR(images.of(true_motion()), this->images().of(true_motion()), 0.05);
}

TEST_F(ImageAgreementTest, ShowsTheSurfacesOfTheFirstFrame) {
  const cv::Mat1f depth = sequence_.at(0).frame->depth;
  const Camera& camera = sequence_.camera();
  const ImageAgreement images = this->images();
  int shown = 0, known = 0;
  for (int v = 10; v < 230; v += 20) {
    for (int u = 10; u < 310; u += 20) {
      if (depth(v, u) <= 0) continue;
      ++known;
      shown += images.shows(camera.unproject(u, v, depth(v, u)));
      EXPECT_FALSE(images.shows(camera.unproject(u, v, depth(v, u) + 0.5)));
      EXPECT_FALSE(images.shows(camera.unproject(u, v, 0.7 * depth(v, u))));
    }
  }
  EXPECT_GT(known, 50);
  EXPECT_EQ(shown, known);
  EXPECT_FALSE(images.shows({0, 0, -1}));
  EXPECT_FALSE(images.shows({5, 0, 1}));
}

}  // namespace
}  // namespace stillmap
