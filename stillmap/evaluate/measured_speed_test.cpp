// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/measured_speed.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/evaluate/motion_truth.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"
#include "stillmap/simulate/tum_writer.hpp"

#include <algorithm>
#include <array>
#include <filesystem>
#include <vector>

#include <fmt/format.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

SimulationOptions half_size(const std::string& activity, int people, int things) {
  SimulationOptions options;
  options.activity = activity;
  options.people = people;
  options.things = things;
  options.near_things = true;
  options.width = 320;
  options.height = 240;
  return options;  // with a Kinect's noise, and a camera in motion
}

PosedImage image_at(const SimulatedSequence& sequence, std::size_t index) {
  const SimulatedFrame made = sequence.at(index);
  return {made.frame, class_mask(made.truth), made.truth.T_world_camera};
}

/// Returns the values of an image inside a mask, sorted.
std::vector<float> sorted(const cv::Mat& image, const cv::Mat& mask) {
  std::vector<float> values;
  for (int v = 0; v < image.rows; ++v) {
    for (int u = 0; u < image.cols; ++u) {
      if (mask.at<std::uint8_t>(v, u) != 0) values.push_back(image.at<float>(v, u));
    }
  }
  std::sort(values.begin(), values.end());
  return values;
}

/// Returns the speeds [m/s] of one mover, without its outline, measured between a frame and the one
/// 0.2 s later.
std::vector<float> measured(const SimulatedSequence& sequence, std::size_t index, int mover) {
  const cv::Mat speed =
      measure_speed(image_at(sequence, index), image_at(sequence, index + 6), sequence.camera());
  cv::Mat seen;
  cv::erode(sequence.truth(index).instances == mover, seen, cv::Mat::ones(9, 9, CV_8U));
  return sorted(speed, seen);
}

TEST(MeasuredSpeed, OfAPushedChairIsThatOfTheTruth) {
  const SimulatedSequence sequence(half_size("walk", 0, 3));
  constexpr std::size_t kFrame = 40;  // halfway
  const auto speeds = measured(sequence, kFrame, 2);
  ASSERT_GT(speeds.size(), 500U);
  const double truth = sequence.movers(kFrame + 3)[1].velocity.norm();
  ASSERT_GT(truth, 0.3);
  EXPECT_NEAR(speeds[speeds.size() / 2], truth, 0.15 * truth);
  EXPECT_GT(speeds[speeds.size() / 10], 0.5 * truth);
}

TEST(MeasuredSpeed, OfASittingPersonIsSmallWhileTheCameraMoves) {
  const SimulatedSequence sequence(half_size("rise", 1, 0));
  for (const std::size_t frame : {5U, 40U, 80U}) {
    const auto speeds = measured(sequence, frame, 1);
    ASSERT_GT(speeds.size(), 500U);
    EXPECT_LT(speeds[speeds.size() / 2], 0.02) << frame;
    EXPECT_LT(speeds[9 * speeds.size() / 10], 0.05) << frame;
  }
}

TEST(MeasuredSpeed, IsZeroOutsideTheMask) {
  const SimulatedSequence sequence(half_size("walk", 1, 1));
  const PosedImage from = image_at(sequence, 3), to = image_at(sequence, 9);
  const cv::Mat speed = measure_speed(from, to, sequence.camera());
  EXPECT_EQ(cv::countNonZero((speed != 0) & (from.mask == 0)), 0);
}

TEST(MeasuredSpeed, AnObjectMissingInTheOtherImageMoves) {
  const SimulatedSequence sequence(half_size("walk", 0, 1));
  const PosedImage from = image_at(sequence, 3);
  PosedImage to = image_at(sequence, 9);
  to.mask = cv::Mat::zeros(to.mask.size(), CV_8UC1);
  const cv::Mat speed = measure_speed(from, to, sequence.camera());
  EXPECT_EQ(cv::countNonZero((speed < 1) & (from.mask != 0)), 0);
}

TEST(MeasuredSpeed, AnObjectThatSwingsBackMoves) {
  // A board that moves by 20 pixels and back, at the same place again every 0.2 s.
  const fs::path folder = test::own_path("swing");
  fs::create_directories(folder / "mask");
  class Swing : public FrameSource {
   public:
    explicit Swing(fs::path masks) : masks_(std::move(masks)) {
      cv::RNG(7).fill(texture_, cv::RNG::UNIFORM, 0, 255);
      cv::GaussianBlur(texture_, texture_, {5, 5}, 0);
    }
    const Camera& camera() const override { return camera_; }
    std::optional<std::size_t> size() const override { return std::nullopt; }
    const std::vector<SkippedFrame>& skipped() const override { return skipped_; }
    RgbdFramePtr next() override {
      if (index_ == 20) return nullptr;
      auto frame = std::make_shared<RgbdFrame>();
      frame->index = index_;
      frame->timestamp = static_cast<double>(index_) / 30;
      frame->gray = cv::Mat::zeros(480, 640, CV_8UC1);
      const std::array offsets{0, 7, 14, 20, 14, 7};
      const cv::Rect board(200 + offsets[index_++ % 6], 150, 200, 150);
      texture_.copyTo(frame->gray(board));
      frame->depth = cv::Mat(480, 640, CV_32FC1, cv::Scalar(2));
      cv::Mat mask = cv::Mat::zeros(480, 640, CV_8UC1);
      mask(board) = 128;
      write_png(masks_ / fmt::format("{:.6f}.png", frame->timestamp), mask);
      return frame;
    }

   private:
    fs::path masks_;
    Camera camera_;
    cv::Mat texture_ = cv::Mat(150, 200, CV_8UC1);
    std::vector<SkippedFrame> skipped_;
    std::size_t index_ = 0;
  };
  Swing first(folder / "mask"), again(folder / "mask");
  while (first.next()) {
  }
  const Trajectory still{{-0.05, {}}, {0.04, {}}, {0.13, {}}, {0.22, {}}, {0.31, {}},
                         {0.40, {}},  {0.49, {}}, {0.58, {}}, {0.67, {}}};
  write_speeds(again, StampedImages(folder / "mask"), still, folder / "speed");
  const MotionTruthFolder truth(folder);
  for (std::size_t i = 0; i < 20; ++i) {
    const auto known = truth.at(static_cast<double>(i) / 30);
    ASSERT_TRUE(known.has_value()) << i;
    EXPECT_GT(known->speed.at<float>(225, 310), 0.02) << i;
  }
  fs::remove_all(folder);
}

TEST(MeasuredSpeed, IsWrittenForEveryFrameAndReadAsTruth) {
  const fs::path folder = test::own_path("speeds");
  fs::create_directories(folder);
  SimulationOptions options = half_size("walk", 0, 1);
  options.width = 160;
  options.height = 120;
  options.frames = 11;
  SimulatedSequence sequence(options);
  write_tum_layout(sequence, folder);
  fs::remove_all(folder / "speed");
  const StampedImages masks(folder / "mask");
  EXPECT_EQ(write_speeds(sequence, masks, sequence.trajectory(), folder / "speed"), 11U);
  const MotionTruthFolder truth(folder);
  EXPECT_TRUE(truth.knows_speed());
  for (std::size_t i = 0; i < 11; ++i) {
    const auto known = truth.at(sequence.timestamp(i));
    ASSERT_TRUE(known.has_value()) << i;
    const auto speeds = sorted(known->speed, known->mask);
    EXPECT_GT(speeds[speeds.size() / 2], 0.1) << i;
  }
  sequence.rewind();
  EXPECT_THROW(write_speeds(sequence, masks, {}, folder / "none"), Error);
  fs::remove_all(folder);
}

}  // namespace
}  // namespace stillmap
