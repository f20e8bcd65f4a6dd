// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/label_figures.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/simulate/tum_writer.hpp"

#include <filesystem>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

const cv::Rect kPerson(20, 20, 60, 60), kObject(120, 20, 60, 60);

/// Returns the masks of a person and an object in front of a wall; 200 x 100 pixels.
MotionTruth person_and_object() {
  MotionTruth truth;
  truth.mask = cv::Mat::zeros(100, 200, CV_8UC1);
  truth.mask(kPerson) = 255;
  truth.mask(kObject) = 128;
  return truth;
}

/// Returns the same masks with the speeds of both [m/s].
MotionTruth person_and_object(float person, float object) {
  MotionTruth truth = person_and_object();
  truth.speed = cv::Mat::zeros(100, 200, CV_32FC1);
  truth.speed(kPerson) = person;
  truth.speed(kObject) = object;
  return truth;
}

PixelTruth at(const cv::Mat1b& labels, int u, int v) {
  return static_cast<PixelTruth>(labels(v, u));
}

/// Adds `count` keypoints at one pixel; the first `moving` of them are labeled as moving.
void put(LabeledFrame& frame, float u, float v, int count, int moving) {
  for (int i = 0; i < count; ++i) frame.keypoints.push_back({u, v, 1, 0, i < moving ? 0.0F : 1.0F});
}

/// Returns 10 keypoints on the person, 20 on the object and 30 on the wall; the arguments are the
/// numbers labeled as moving.
LabeledFrame labels(int on_person, int on_object, int on_wall) {
  LabeledFrame frame;
  put(frame, 50, 50, 10, on_person);
  put(frame, 150, 50, 20, on_object);
  put(frame, 100, 50, 30, on_wall);
  return frame;
}

TEST(PixelTruth, MovableObjectsMoveIfSpeedsAreUnknown) {
  const cv::Mat1b labels = label_pixels(person_and_object(), {});
  EXPECT_EQ(at(labels, 50, 50), PixelTruth::kMoving);
  EXPECT_EQ(at(labels, 150, 50), PixelTruth::kMoving);
  EXPECT_EQ(at(labels, 100, 50), PixelTruth::kStatic);
}

TEST(PixelTruth, PeopleCanBeTakenForStill) {
  const cv::Mat1b labels = label_pixels(person_and_object(), {.still_people = true});
  EXPECT_EQ(at(labels, 50, 50), PixelTruth::kStillPerson);
  EXPECT_EQ(at(labels, 150, 50), PixelTruth::kMoving);
}

TEST(PixelTruth, NearAnOutlineCountsNeitherWay) {
  const cv::Mat1b labels = label_pixels(person_and_object(), {.outline_margin = 3});
  EXPECT_EQ(at(labels, 16, 50), PixelTruth::kStatic);  // the mask begins at 20
  EXPECT_EQ(at(labels, 17, 50), PixelTruth::kLeftOut);
  EXPECT_EQ(at(labels, 22, 50), PixelTruth::kLeftOut);
  EXPECT_EQ(at(labels, 23, 50), PixelTruth::kMoving);
}

TEST(PixelTruth, TheOutlineBetweenTwoMoversCountsToo) {
  MotionTruth truth = person_and_object();
  truth.instances = cv::Mat::zeros(100, 200, CV_8UC1);
  truth.instances(kPerson) = 1;
  truth.instances(cv::Rect(20, 20, 30, 60)) = 2;  // another one in front of its left half
  truth.instances(kObject) = 3;
  const cv::Mat1b labels = label_pixels(truth, {.outline_margin = 3});
  EXPECT_EQ(at(labels, 46, 50), PixelTruth::kMoving);
  EXPECT_EQ(at(labels, 47, 50), PixelTruth::kLeftOut);
  EXPECT_EQ(at(labels, 52, 50), PixelTruth::kLeftOut);
  EXPECT_EQ(at(labels, 53, 50), PixelTruth::kMoving);
}

TEST(PixelTruth, SpeedsDecideBetweenMovingAndStatic) {
  const cv::Mat1b labels = label_pixels(person_and_object(0.019F, 0.021F), {});
  EXPECT_EQ(at(labels, 50, 50), PixelTruth::kStillPerson);
  EXPECT_EQ(at(labels, 150, 50), PixelTruth::kMoving);
  const cv::Mat1b others = label_pixels(person_and_object(0.021F, 0.019F), {});
  EXPECT_EQ(at(others, 50, 50), PixelTruth::kMoving);
  EXPECT_EQ(at(others, 150, 50), PixelTruth::kStaticObject);
}

TEST(PixelTruth, SpeedsInBetweenCountNeitherWay) {
  const cv::Mat1b labels =
      label_pixels(person_and_object(0.03F, 0.06F), {.moving_above = 0.05, .still_below = 0.02});
  EXPECT_EQ(at(labels, 50, 50), PixelTruth::kLeftOut);
  EXPECT_EQ(at(labels, 150, 50), PixelTruth::kMoving);
}

TEST(PixelTruth, RestingPartsOfMoversAreDistinguished) {
  MotionTruth truth = person_and_object(0, 0);
  truth.speed(cv::Rect(20, 20, 60, 12)) = 1;  // a fifth of the person
  const cv::Mat1b labels = label_pixels(truth, {});
  EXPECT_EQ(at(labels, 50, 28), PixelTruth::kMoving);
  EXPECT_EQ(at(labels, 50, 50), PixelTruth::kResting);
  EXPECT_EQ(at(labels, 150, 50), PixelTruth::kStaticObject);  // another mover altogether
  truth.speed(cv::Rect(20, 23, 60, 9)) = 0;                   // a twentieth of the person is left
  EXPECT_EQ(at(label_pixels(truth, {}), 50, 50), PixelTruth::kStillPerson);
}

TEST(LabelEvaluator, CountsKeypointsByGroundTruth) {
  LabelEvaluator judge;
  LabeledFrame frame = labels(8, 3, 6);
  put(frame, 22, 50, 5, 5);   // near the person's outline
  put(frame, 250, 50, 1, 1);  // off the image
  const LabelCounts counts = judge.add(frame, person_and_object(1, 0));
  EXPECT_EQ(counts.moving.total, 10U);
  EXPECT_EQ(counts.moving.said_moving, 8U);
  EXPECT_EQ(counts.still_things.total, 20U);
  EXPECT_EQ(counts.still_things.said_moving, 3U);
  EXPECT_EQ(counts.static_world.total, 30U);
  EXPECT_EQ(counts.static_world.said_moving, 6U);
  EXPECT_EQ(counts.still_people.total, 0U);
  EXPECT_EQ(counts.left_out, 6U);
  EXPECT_DOUBLE_EQ(counts.recall(), 0.8);
  EXPECT_DOUBLE_EQ(counts.precision(), 8.0 / 17);
}

TEST(LabelEvaluator, MeansAreOverTheFramesThatHaveTheFigure) {
  LabelEvaluator judge;
  judge.add(labels(10, 0, 0), person_and_object(1, 0));  // precision 1, recall 1
  judge.add(labels(2, 0, 6), person_and_object(1, 0));   // precision 2 / 8, recall 0.2
  judge.add(labels(0, 0, 0), person_and_object(1, 0));  // no label "moving": recall 0, no precision
  judge.add(labels(3, 0, 0), person_and_object(0, 0));  // nothing moves
  judge.add_without_truth();
  const LabelFigures figures = judge.figures();
  EXPECT_EQ(figures.frames, 4U);
  EXPECT_EQ(figures.frames_without_truth, 1U);
  EXPECT_TRUE(figures.knows_speed);
  EXPECT_EQ(figures.precision.frames, 2U);
  EXPECT_DOUBLE_EQ(figures.precision.mean, 0.625);
  EXPECT_EQ(figures.recall.frames, 3U);
  EXPECT_DOUBLE_EQ(figures.recall.mean, 0.4);
  EXPECT_EQ(figures.still_people.frames, 1U);
  EXPECT_DOUBLE_EQ(figures.still_people.mean, 0.3);
  EXPECT_DOUBLE_EQ(figures.static_world.mean, 6.0 / 30 / 4);
  EXPECT_DOUBLE_EQ(figures.pooled.precision(), 12.0 / 21);
  EXPECT_DOUBLE_EQ(figures.pooled.recall(), 12.0 / 30);
}

TEST(LabelEvaluator, FramesWithFewKeypointsOfAKindDoNotSwayItsMean) {
  LabelEvaluator judge;
  judge.add(labels(1, 20, 0), person_and_object());  // 30 that move
  LabeledFrame few;
  put(few, 50, 50, 9, 0);
  judge.add(few, person_and_object());  // 9 that move
  EXPECT_EQ(judge.figures().recall.frames, 1U);
  EXPECT_DOUBLE_EQ(judge.figures().recall.mean, 0.7);
  EXPECT_EQ(judge.figures().pooled.moving.total, 39U);
}

TEST(LabelEvaluator, FiguresThatDoNotExistAreNullInJson) {
  LabelEvaluator judge;
  LabeledFrame frame;
  put(frame, 100, 50, 30, 0);
  judge.add(frame, person_and_object());
  const nlohmann::json json = judge.figures();
  EXPECT_TRUE(json["recall"]["mean"].is_null());
  EXPECT_TRUE(json["pooled"]["precision"].is_null());
  EXPECT_EQ(json["false_moving_static_world"]["mean"], 0);
}

class TruthFiles : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_ / "mask"); }
  void TearDown() override { fs::remove_all(folder_); }
  void write(const char* kind, const char* stamp, const cv::Mat& image) const {
    fs::create_directories(folder_ / kind);
    write_png(folder_ / kind / (std::string(stamp) + ".png"), image);
  }

  const fs::path folder_ = test::own_path("truth");
};

TEST_F(TruthFiles, AreJudgedByStamp) {
  write("mask", "5.000000", person_and_object().mask);
  write("mask", "5.033333", cv::Mat::zeros(100, 200, CV_8UC1));
  std::vector<LabeledFrame> frames(3, labels(9, 20, 0));
  frames[0].timestamp = 5.000001;
  frames[1].timestamp = 5.033333;  // all of it static there
  frames[2].timestamp = 5.1;       // no mask
  const LabelFigures figures = evaluate_labels(frames, MotionTruthFolder(folder_));
  EXPECT_EQ(figures.frames, 2U);
  EXPECT_EQ(figures.frames_without_truth, 1U);
  EXPECT_FALSE(figures.knows_speed);
  EXPECT_EQ(figures.pooled.moving.said_moving, 29U);
  EXPECT_EQ(figures.pooled.static_world.said_moving, 29U);
  frames[0].timestamp = frames[1].timestamp = 8;
  EXPECT_THROW(evaluate_labels(frames, MotionTruthFolder(folder_)), Error);
}

TEST_F(TruthFiles, SpeedsAndInstancesAreReadIfPresent) {
  const MotionTruth truth = person_and_object(0.5F, 2.0F);
  write("mask", "5.0", truth.mask);
  write("instance", "5.0", truth.mask / 64);
  write("speed", "5.0", speed_image(truth.speed));
  const auto read = MotionTruthFolder(folder_).at(5);
  ASSERT_TRUE(read.has_value());
  EXPECT_FLOAT_EQ(read->speed.at<float>(50, 50), 0.5F);
  EXPECT_FLOAT_EQ(read->speed.at<float>(50, 150), 1.275F);  // the most that fits
  EXPECT_EQ(read->instances.at<std::uint8_t>(50, 150), 2);
}

TEST_F(TruthFiles, OfTheSimulatorAreUnderstood) {
  SimulationOptions options;
  options.people = 1;
  options.things = 1;
  options.width = 96;
  options.height = 72;
  options.frames = 2;
  const SimulatedSequence sequence(options);
  const fs::path folder = folder_ / "simulated";
  write_tum_layout(sequence, folder);
  const auto truth = MotionTruthFolder(folder).at(sequence.timestamp(1));
  ASSERT_TRUE(truth.has_value());
  const TruthFrame made = sequence.truth(1);
  EXPECT_EQ(cv::norm(truth->mask, class_mask(made), cv::NORM_INF), 0);
  EXPECT_EQ(cv::norm(truth->instances, made.instances, cv::NORM_INF), 0);
  const cv::Mat expected = cv::min(sequence.speed(1), 255 * kSpeedUnit);
  EXPECT_LE(cv::norm(truth->speed, expected, cv::NORM_INF), 0.51 * kSpeedUnit);
}

TEST_F(TruthFiles, MissingOrMismatchedOnesAreNamed) {
  EXPECT_THROW(MotionTruthFolder(folder_ / "elsewhere"), Error);
  write("mask", "5.0", person_and_object().mask);
  write("speed", "5.0", cv::Mat::zeros(10, 10, CV_8UC1));
  try {
    MotionTruthFolder(folder_).at(5);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("the speed image is 10 x 10, the mask 200 x 100 pixels"));
  }
}

}  // namespace
}  // namespace stillmap
