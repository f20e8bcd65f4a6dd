// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_agreement.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

const cv::Size kSize(320, 240);

/// Returns the mask of a person that walks through the image.
cv::Mat1b person(int moment) {
  cv::Mat1b mask = cv::Mat1b::zeros(kSize);
  const cv::Point center(60 + 12 * moment, 120);
  cv::ellipse(mask, center, cv::Size(25, 80), 0, 0, 360, 255, cv::FILLED);
  return mask;
}

/// Returns the depth of that person in front of a wall.
cv::Mat depth(int moment) {
  cv::Mat1f depth(kSize, 3.F);
  depth.setTo(1.5F, person(moment));
  return depth;
}

/// Returns the agreement of the masks that `mask_of` makes for twelve moments.
template <typename MaskOf>
std::optional<double> agreement(MaskOf&& mask_of) {
  MaskAgreement agreement;
  for (int moment = 0; moment < 12; ++moment) agreement.add(mask_of(moment), depth(moment));
  return agreement.agreement();
}

TEST(MaskAgreement, ExactMasksAgree) { EXPECT_GT(agreement(person).value(), 0.99); }

TEST(MaskAgreement, SlightlyEnlargedMasksAgree) {
  const auto enlarged = [](int moment) {
    cv::Mat1b mask;
    cv::dilate(person(moment), mask, cv::Mat::ones(9, 9, CV_8U));
    return mask;
  };
  EXPECT_GT(agreement(enlarged).value(), 0.9);
}

TEST(MaskAgreement, MasksOfOtherMomentsDoNotAgree) {
  EXPECT_LT(agreement([](int moment) { return person((moment + 6) % 12); }).value(), 0.2);
}

TEST(MaskAgreement, BoxesAreNotJudged) {
  const auto box = [](int moment) {
    cv::Mat1b mask = cv::Mat1b::zeros(kSize);
    mask(cv::boundingRect(person((moment + 6) % 12))) = 255;
    return mask;
  };
  EXPECT_EQ(agreement(box), std::nullopt);
}

TEST(MaskAgreement, NothingIsToldFromFewMasksOrWithoutDepth) {
  MaskAgreement few;
  for (int moment = 0; moment < 9; ++moment) few.add(person(moment + 3), depth(moment));
  EXPECT_EQ(few.agreement(), std::nullopt);
  MaskAgreement blind;
  for (int moment = 0; moment < 12; ++moment) blind.add(person(moment), cv::Mat1f::zeros(kSize));
  EXPECT_EQ(blind.agreement(), std::nullopt);
}

/// Returns whether the masks that `mask_of` makes for twelve moments look inverted.
template <typename MaskOf, typename DepthOf>
bool inverted(MaskOf&& mask_of, DepthOf&& depth_of) {
  MaskAgreement agreement;
  for (int moment = 0; moment < 12; ++moment) agreement.add(mask_of(moment), depth_of(moment));
  EXPECT_GT(agreement.agreement().value_or(1), 0.9) << "the outlines are right";
  return agreement.inverted();
}

TEST(MaskAgreement, MasksOfAllButPeopleAreInverted) {
  const auto all_but = [](int moment) { return cv::Mat1b(~person(moment)); };
  EXPECT_TRUE(inverted(all_but, depth));
  EXPECT_FALSE(inverted(person, depth));
  // A crowd in front of a wall that is seen through one gap.
  const auto crowd_depth = [&](int moment) {
    cv::Mat1f result(kSize, 1.5F);
    result.setTo(3.F, person(moment));
    return result;
  };
  EXPECT_FALSE(inverted(all_but, crowd_depth));
}

}  // namespace
}  // namespace stillmap
