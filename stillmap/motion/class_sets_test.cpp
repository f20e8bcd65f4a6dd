// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/class_sets.hpp"

#include "stillmap/motion/motion_estimator.hpp"
#include "stillmap/motion/test_frames.hpp"
#include "stillmap/segment/coco.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::IsEmpty;

TEST(ClassSets, AClassInBothListsIsDynamic) {
  const ClassSets sets{.dynamic = {"dog"}, .potential = {"dog", "cup"}};
  EXPECT_EQ(sets.role_of("dog"), ClassRole::kDynamic);
  EXPECT_EQ(sets.role_of("cup"), ClassRole::kPotential);
  EXPECT_EQ(sets.role_of("crane"), ClassRole::kUnlisted);
}

TEST(ClassSets, IndoorClassesAreSpelledAsTheNetworkSpellsThem) {
  const auto& coco = coco_class_names();
  const ClassSets sets = indoor_classes();
  for (const auto& list : {sets.dynamic, sets.potential}) {
    for (const std::string& name : list) {
      if (name == "unknown") continue;
      EXPECT_NE(std::find(coco.begin(), coco.end(), name), coco.end()) << name;
    }
  }
}

TEST(ClassSets, BoxesOfOneRoleAreFoundMaskOrNot) {
  Instance masked = test::box_of("person", {10, 10, 5, 5});
  masked.mask = cv::Mat(masked.box.size(), CV_8UC1, cv::Scalar(255));
  const auto frame = test::segmented(
      {test::box_of("chair", {0, 0, 4, 4}), masked, test::box_of("dog", {20, 20, 6, 6})});
  EXPECT_THAT(boxes_with_role(frame, indoor_classes(), ClassRole::kDynamic),
              ElementsAre(cv::Rect(10, 10, 5, 5), cv::Rect(20, 20, 6, 6)));
  EXPECT_THAT(boxes_with_role(nullptr, indoor_classes(), ClassRole::kDynamic), IsEmpty());
}

TEST(ClassSets, APixelReachesHalfAPixelAroundItsCenter) {
  const std::vector<cv::Rect> boxes = {{10, 20, 5, 5}};  // pixels 10 to 14, 20 to 24
  EXPECT_TRUE(in_any_box(boxes, 9.6F, 20));
  EXPECT_FALSE(in_any_box(boxes, 9.4F, 20));
  EXPECT_TRUE(in_any_box(boxes, 14.4F, 24.4F));
  EXPECT_FALSE(in_any_box(boxes, 14.6F, 24));
  EXPECT_FALSE(in_any_box({}, 12, 22));
}

TEST(ClassSets, MarkedBoxesEndAtTheImage) {
  MotionEvidence evidence;
  mark_moving({-5, -5, 4, 4}, {20, 10}, evidence);
  EXPECT_TRUE(evidence.moving_pixels.empty());
  mark_moving({15, 5, 10, 10}, {20, 10}, evidence);
  EXPECT_EQ(cv::countNonZero(evidence.moving_pixels), 5 * 5);
}

MotionEstimator estimator_of(const std::vector<std::string>& cues) {
  MotionOptions options;
  options.cues = cues;
  return MotionEstimator(options);
}

TEST(Classes, AreThoseThatTheCuesUse) {
  EXPECT_THAT(estimator_of({}).classes(), IsEmpty());
  EXPECT_THAT(estimator_of({"semantic"}).classes(), ElementsAre("person", "unknown"));
  EXPECT_THAT(estimator_of({"gated-semantic"}).classes(), ElementsAre("person", "unknown"));
  EXPECT_EQ(estimator_of({"box-flow"}).classes().count("dog"), 1U);
  EXPECT_EQ(estimator_of({"box-flow"}).classes().count("chair"), 1U);
  EXPECT_EQ(estimator_of({"box-flow"}).classes().count("sink"), 0U);
  EXPECT_EQ(estimator_of({"epipolar"}).classes().count("chair"), 1U);
  EXPECT_EQ(estimator_of({"epipolar"}).classes().count("sink"), 0U);
}

}  // namespace
}  // namespace stillmap
