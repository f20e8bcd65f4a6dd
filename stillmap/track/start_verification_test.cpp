// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/start_verification.hpp"

#include "stillmap/track/rendered_track_test.hpp"

#include <random>

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr std::size_t kFrames = 9;
constexpr float kBoardDepth = 0.9F;  // m
constexpr int kBoardStep = 6, kBoardWidth = 60;

/// Returns the columns that the board covers in a frame.
cv::Rect board_in(std::size_t index) {
  return {20 + kBoardStep * static_cast<int>(index), 0, kBoardWidth, 240};
}

/// Returns the frame with a patterned board in front of the camera, which moves to the right: it
/// covers a fifth of the image and has nearly half of the keypoints.
FramePtr with_board(std::size_t index) {
  auto image = std::make_shared<RgbdFrame>(*rendered::frame(index)->image);
  image->gray = image->gray.clone();
  image->depth = image->depth.clone();
  cv::Mat1b pattern(60, 34);
  std::mt19937 random(7);
  for (auto& pixel : pattern) pixel = static_cast<std::uint8_t>(random() % 256);
  random.seed(static_cast<unsigned>(index));
  cv::resize(pattern, pattern, {kBoardWidth, 240}, 0, 0, cv::INTER_NEAREST);
  std::normal_distribution<float> noise;
  for (int row = 0; row < 240; ++row) {
    for (int col = 0; col < kBoardWidth; ++col) {
      const cv::Point at(board_in(index).x + col, row);
      image->gray.at<std::uint8_t>(at) =
          cv::saturate_cast<std::uint8_t>(pattern(row, col) + 5 * noise(random));
      image->depth.at<float>(at) = kBoardDepth + 0.003F * noise(random);
    }
  }
  return rendered::frame_of(image);
}

/// Returns the pose of a camera to which the board stands.
Pose pose_behind_board(std::size_t index) {
  const double shift =
      kBoardStep * static_cast<double>(index) * kBoardDepth / rendered::sequence().camera().fx;
  return rendered::true_pose(0) * Pose(Eigen::Quaterniond::Identity(), {-shift, 0, 0});
}

struct Found {
  StartVerification::Motion motion;
  FramePtr frame;
};

/// Returns the first other motion that is found with these poses of the camera.
template <typename PoseOf>
std::optional<Found> verified(const PoseOf& pose_of) {
  StartVerification verification;
  verification.begin(with_board(0), pose_of(0));
  for (std::size_t i = 1; i < kFrames; ++i) {
    const FramePtr frame = with_board(i);
    const auto motion = verification.contradiction(rendered::model(), frame, pose_of(i));
    if (motion) return Found{*motion, frame};
  }
  return std::nullopt;
}

TEST(StartVerification, AcceptsTheTrueMotion) {
  EXPECT_FALSE(verified(rendered::true_pose).has_value());
}

TEST(StartVerification, MovesAlongWithTheMap) {
  const Pose T_corrected_world(so3_exp({0, 0.2, 0}), {0.3, 0, 0.1});
  StartVerification verification;
  verification.begin(with_board(0), rendered::true_pose(0));
  verification.move(T_corrected_world);
  for (std::size_t i = 1; i < kFrames; ++i) {
    const Pose corrected = T_corrected_world * rendered::true_pose(i);
    EXPECT_FALSE(verification.contradiction(rendered::model(), with_board(i), corrected)) << i;
  }
}

TEST(StartVerification, FindsTheMotionThatExplainsMoreOfTheImage) {
  const auto found = verified(pose_behind_board);
  ASSERT_TRUE(found.has_value());
  const std::size_t index = found->frame->index();
  rendered::expect_pose(found->motion.T_world_camera, index, 0.01, 0.004);
  const Pose before = rendered::true_pose(index - 1);
  const Pose error =
      (before.inverse() * rendered::true_pose(index)).inverse() * found->motion.T_previous_next;
  EXPECT_LT(error.translation().norm(), 0.005);
}

TEST(StartVerification, TellsWhichKeypointsStand) {
  const auto found = verified(pose_behind_board);
  ASSERT_TRUE(found.has_value());
  const auto& keypoints = found->frame->features->keypoints;
  ASSERT_EQ(found->motion.stands.size(), keypoints.size());
  std::size_t of_board = 0, moving = 0, others = 0, standing = 0;
  for (std::size_t i = 0; i < keypoints.size(); ++i) {
    const bool on_board = board_in(found->frame->index())
                              .contains({cvRound(keypoints[i].u), cvRound(keypoints[i].v)});
    const bool stands = found->motion.stands[i] != 0;
    (on_board ? of_board : others) += 1;
    moving += on_board && !stands;
    standing += !on_board && stands;
  }
  EXPECT_GT(5 * of_board, 4 * others) << "the keypoints alone would decide";
  EXPECT_EQ(moving, of_board);
  EXPECT_GT(standing, others / 2);  // the board hid the rest of them in the first frame
}

}  // namespace
}  // namespace stillmap
