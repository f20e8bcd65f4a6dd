// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/trace.hpp"
#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/motion/test_frames.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

/// Returns keypoints in a row at y = 50, every 10 pixels, in an image of 200 x 100 pixels.
MotionInput input_with(std::vector<Instance> instances) {
  auto image = std::make_shared<RgbdFrame>();
  image->gray = cv::Mat::zeros(100, 200, CV_8UC1);
  auto features = std::make_shared<Features>();
  for (int x = 0; x < 200; x += 10)
    features->keypoints.push_back({.u = static_cast<float>(x), .v = 50});
  return test::input_of(image, features, test::segmented(std::move(instances)));
}

Instance instance(const std::string& name, const cv::Rect& box, bool with_mask) {
  Instance made = test::box_of(name, box);
  if (with_mask) made.mask = cv::Mat(box.size(), CV_8UC1, cv::Scalar(255));
  return made;
}

std::vector<int> excluded(const MotionEvidence& evidence) {
  std::vector<int> result;
  for (std::size_t i = 0; i < evidence.weight.size(); ++i) {
    if (evidence.weight[i] == 0) result.push_back(static_cast<int>(i) * 10);
  }
  return result;
}

MotionOptions seg_mask(int dilation = 0) {
  MotionOptions options;
  options.cues = {"semantic"};
  options.semantic.dilation = dilation;
  return options;
}

TEST(SegMask, ExcludesExactlyTheKeypointsOnThePerson) {
  MotionEstimator estimator(seg_mask());
  const auto evidence =
      estimator.estimate(input_with({instance("person", {55, 20, 30, 60}, true)}));
  EXPECT_EQ(excluded(evidence), (std::vector<int>{60, 70, 80}));
  EXPECT_EQ(cv::countNonZero(evidence.moving_pixels), 30 * 60);
}

TEST(SegMask, DilatesTheMask) {
  MotionEstimator estimator(seg_mask(6));
  const auto evidence =
      estimator.estimate(input_with({instance("person", {55, 20, 30, 60}, true)}));
  EXPECT_EQ(excluded(evidence), (std::vector<int>{50, 60, 70, 80, 90}));
}

TEST(SegMask, UsesTheBoxWithoutAMask) {
  MotionEstimator estimator(seg_mask());
  const auto evidence =
      estimator.estimate(input_with({instance("person", {95, 0, 10, 100}, false)}));
  EXPECT_EQ(excluded(evidence), (std::vector<int>{100}));
}

TEST(SegMask, HolesInTheMaskStayStatic) {
  Instance person = instance("person", {40, 20, 60, 60}, true);
  person.mask(cv::Rect(15, 0, 20, 60)).setTo(0);  // 55..74
  MotionEstimator estimator(seg_mask());
  EXPECT_EQ(excluded(estimator.estimate(input_with({person}))), (std::vector<int>{40, 50, 80, 90}));
}

TEST(SegMask, ChairsAreStatic) {
  MotionEstimator estimator(seg_mask());
  const auto evidence = estimator.estimate(input_with({instance("chair", {55, 20, 30, 60}, true)}));
  EXPECT_TRUE(excluded(evidence).empty());
  EXPECT_TRUE(evidence.moving_pixels.empty());
}

TEST(SegMask, TheDynamicClassesAreAnOption) {
  MotionOptions options = seg_mask();
  options.semantic.classes.dynamic = {"chair"};
  MotionEstimator estimator(options);
  const auto evidence = estimator.estimate(input_with(
      {instance("chair", {5, 0, 10, 100}, true), instance("person", {95, 0, 10, 100}, true)}));
  EXPECT_EQ(excluded(evidence), (std::vector<int>{10}));
}

TEST(SegMask, NothingIsExcludedWithoutInstances) {
  MotionEstimator estimator(seg_mask());
  MotionInput input = input_with({});
  input.instances = nullptr;
  const auto evidence = estimator.estimate(input);
  EXPECT_TRUE(excluded(evidence).empty());
  EXPECT_THAT(evidence.weight, ::testing::Each(1.0F));
}

TEST(Static, LabelsEverythingAsStatic) {
  MotionOptions options;
  options.cues.clear();
  MotionEstimator estimator(options);
  EXPECT_TRUE(excluded(estimator.estimate(input_with({instance("person", {0, 0, 200, 100}, true)})))
                  .empty());
}

TEST(Cues, AnUnknownNameSuggestsTheNearest) {
  MotionOptions options;
  options.cues = {"semantics"};
  try {
    MotionEstimator estimator(options);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("did you mean 'semantic'?"));
  }
}

TEST(Cues, AreMadeInTheGivenOrder) {
  MotionOptions options;
  options.cues = {"epipolar", "gated-semantic", "history"};
  const MotionCues cues = make_cues(options);
  ASSERT_EQ(cues.size(), 3U);
  for (std::size_t i = 0; i < 3; ++i) EXPECT_EQ(cues[i]->name(), options.cues[i]);
}

TEST(Cues, UseInstancesIfOneUsesClasses) {
  MotionOptions options;
  options.cues = {"residual", "history"};
  EXPECT_FALSE(use_instances(make_cues(options)));
  options.cues.push_back("semantic");
  EXPECT_TRUE(use_instances(make_cues(options)));
}

TEST(Cues, EveryCueIsTimedInEveryFrame) {
  MotionEstimator estimator(seg_mask());
  ASSERT_EQ(estimator.cues(), (std::vector<std::string_view>{"semantic"}));
  Trace trace;
  TraceTrack& track = trace.add_track("camera");
  const TraceBinding binding(&track);
  for (std::size_t frame = 0; frame < 2; ++frame) {
    trace_frame(frame);
    estimator.estimate(input_with({instance("person", {0, 0, 200, 100}, true)}));
    EXPECT_EQ(track.times("semantic").kept().size(), frame + 1);
  }
}

}  // namespace
}  // namespace stillmap
