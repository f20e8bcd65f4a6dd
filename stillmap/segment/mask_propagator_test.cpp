// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/mask_propagator.hpp"

#include "stillmap/segment/dynamic_mask.hpp"

#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

const cv::Size kSize(640, 480);

/// Returns blurred noise, a texture suited for optical flow; deterministic for a seed.
cv::Mat1b texture(cv::Size size, std::uint64_t seed) {
  cv::Mat1b noise(size);
  cv::RNG rng(seed);
  rng.fill(noise, cv::RNG::UNIFORM, 0, 256);
  cv::GaussianBlur(noise, noise, {9, 9}, 2.5);
  cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
  return noise;
}

/// A wall at 3 m and an object at `depth` in front of it.
RgbdFramePtr scene(std::size_t index, const cv::Rect& object, float depth = 1.5F) {
  auto frame = std::make_shared<RgbdFrame>();
  frame->index = index;
  frame->gray = texture(kSize, 1);
  frame->depth = cv::Mat1f(kSize, 3.0F);
  const cv::Mat1b looks = texture({200, 300}, 2);
  const cv::Rect visible = object & cv::Rect(cv::Point(), kSize);
  if (visible.empty()) return frame;
  looks(visible - object.tl()).copyTo(frame->gray(visible));
  frame->depth(visible) = depth;
  return frame;
}

SegmentedFrame masks_at(std::size_t index, const cv::Rect& object) {
  const cv::Rect visible = object & cv::Rect(cv::Point(), kSize);
  SegmentedFrame masks{.frame_index = index, .source_index = index, .instances = {}};
  masks.instances.push_back({0, "person", 0.8F, visible, cv::Mat(visible.size(), CV_8UC1, 255)});
  return masks;
}

struct Score {
  double recall = 0, precision = 0;
};

Score score(const SegmentedFrame& masks, const cv::Rect& truth) {
  const cv::Mat1b found = dynamic_mask(masks, {"person"}, kSize);
  const cv::Rect visible = truth & cv::Rect(cv::Point(), kSize);
  const double both = cv::countNonZero(found(visible));
  return {both / visible.area(), both / std::max(1, cv::countNonZero(found))};
}

TEST(PropagateMasks, FollowsAMovingObject) {
  const cv::Rect before(200, 100, 120, 250);
  for (const cv::Point step : {cv::Point(0, 0), {13, 4}, {-37, 10}, {60, -30}}) {
    const cv::Rect after = before + step;
    const auto propagated =
        propagate_masks(masks_at(4, before), *scene(4, before), *scene(6, after));
    const Score s = score(propagated, after);
    EXPECT_GT(s.recall, 0.99) << step;
    EXPECT_GT(s.precision, 0.97) << step;
    EXPECT_EQ(propagated.frame_index, 6U);
    EXPECT_EQ(propagated.age(), 2U);
    ASSERT_EQ(propagated.instances.size(), 1U);
    EXPECT_EQ(propagated.instances[0].class_name, "person");
    EXPECT_FLOAT_EQ(propagated.instances[0].confidence, 0.8F);
  }
}

TEST(PropagateMasks, WorksWithoutDepthButFollowsTheFlow) {
  const cv::Rect before(200, 100, 120, 250), after = before + cv::Point(31, 7);
  auto source = std::make_shared<RgbdFrame>(*scene(0, before));
  auto target = std::make_shared<RgbdFrame>(*scene(1, after));
  source->depth = cv::Mat1f::zeros(kSize);
  target->depth = cv::Mat1f::zeros(kSize);
  const Score s = score(propagate_masks(masks_at(0, before), *source, *target), after);
  EXPECT_GT(s.recall, 0.97);
  EXPECT_GT(s.precision, 0.97);
}

TEST(PropagateMasks, DepthRemovesTheWallFromACoarseMask) {
  const cv::Rect before(200, 100, 120, 250), after = before + cv::Point(10, 0);
  const cv::Rect coarse(before.x - 8, before.y - 8, before.width + 16, before.height + 16);
  const auto propagated = propagate_masks(masks_at(0, coarse), *scene(0, before), *scene(1, after));
  EXPECT_GT(score(propagated, after).recall, 0.99);
  EXPECT_GT(score(propagated, after).precision, 0.95);  // the mask itself: 0.83
}

TEST(PropagateMasks, ABoxDoesNotStretchBetweenObjectAndWall) {
  // The wall in the box is too close to the object to be separated by depth; it must stay behind.
  const cv::Rect before(200, 100, 120, 250), after = before + cv::Point(30, 0);
  const cv::Rect around(185, 85, 150, 280);
  SegmentedFrame boxes = masks_at(0, around);
  boxes.instances[0].mask.release();
  const auto propagated = propagate_masks(boxes, *scene(0, before, 2.8F), *scene(2, after, 2.8F));
  ASSERT_EQ(propagated.instances.size(), 1U);
  const cv::Rect box = propagated.instances[0].box;
  EXPECT_EQ(box | after, box);
  EXPECT_LE(box.width, around.width + 2 * 8);  // base_growth + 2 growth = 5 pixels, and rounding
  EXPECT_LE(box.height, around.height + 2 * 8);
}

TEST(PropagateMasks, GrowsIntoPartsThatEnterTheImage) {
  const cv::Rect before(560, 100, 120, 250), after = before - cv::Point(38, 0);  // 80, then 118 px
  const auto propagated = propagate_masks(masks_at(0, before), *scene(0, before), *scene(2, after));
  EXPECT_GT(score(propagated, after).recall, 0.98);
  EXPECT_GT(score(propagated, after).precision, 0.95);
}

TEST(PropagateMasks, DropsInstancesThatLeftOrAreOccluded) {
  const cv::Rect before(200, 100, 120, 250), nowhere;
  const auto source = scene(0, before), target = scene(1, nowhere);
  EXPECT_TRUE(propagate_masks(masks_at(0, before), *source, *target).instances.empty());
  EXPECT_TRUE(propagate_masks({}, *source, *target).instances.empty());
}

TEST(PropagateMasks, OtherImageSizesAreCoveredCompletely) {
  const cv::Size odd(331, 247);
  RgbdFrame frame;
  frame.gray = texture(odd, 3);
  frame.depth = cv::Mat1f(odd, 2.0F);
  SegmentedFrame masks;
  masks.instances.push_back({0, "person", 1, cv::Rect(cv::Point(), odd), {}});
  RgbdFrame next = frame;
  next.index = 1;
  const auto propagated = propagate_masks(masks, frame, next);
  ASSERT_EQ(propagated.instances.size(), 1U);
  EXPECT_EQ(propagated.instances[0].box, cv::Rect(cv::Point(), odd));
  EXPECT_EQ(propagated.instances[0].mask.size(), odd);
}

TEST(PropagateMasks, ResultDoesNotDependOnThreads) {
  const cv::Rect before(200, 100, 120, 250), after = before + cv::Point(23, -5);
  const auto run = [&](int threads) {
    cv::setNumThreads(threads);
    const auto propagated =
        propagate_masks(masks_at(0, before), *scene(0, before), *scene(2, after));
    return dynamic_mask(propagated, {"person"}, kSize);
  };
  const cv::Mat1b one = run(1), four = run(4);
  cv::setNumThreads(-1);
  EXPECT_EQ(cv::norm(one, four), 0);
}

TEST(TrimByDepth, KeepsTheObjectAndRemovesTheWall) {
  const cv::Rect object(200, 100, 120, 250), coarse(192, 92, 136, 266);
  const auto trimmed = trim_by_depth(masks_at(0, coarse), *scene(0, object));
  EXPECT_GT(score(trimmed, object).recall, 0.999);
  EXPECT_GT(score(trimmed, object).precision, 0.97);  // the mask itself: 0.83
}

TEST(MaskPropagator, PropagatesTheNewestMasksToTheNewestFrame) {
  MaskPropagator propagator(30);
  const auto at = [](std::size_t i) {
    return cv::Rect(200, 100, 120, 250) + cv::Point(9, 2) * static_cast<int>(i);
  };
  EXPECT_EQ(propagator.current(), nullptr);
  for (std::size_t i = 0; i < 5; ++i) propagator.push(scene(i, at(i)));
  EXPECT_EQ(propagator.current(), nullptr);
  propagator.set(masks_at(2, at(2)));
  propagator.set(masks_at(1, cv::Rect(0, 0, 30, 30)));  // Older masks are ignored.
  const auto current = propagator.current();
  ASSERT_NE(current, nullptr);
  EXPECT_EQ(current->frame_index, 4U);
  EXPECT_EQ(current->age(), 2U);
  EXPECT_GT(score(*current, at(4)).recall, 0.99);
  propagator.set(masks_at(4, at(4)));
  EXPECT_EQ(propagator.current()->age(), 0U);
  EXPECT_EQ(score(*propagator.current(), at(4)).precision, 1);
}

TEST(MaskPropagator, DropsMasksThatAreTooOld) {
  MaskPropagator propagator(2);
  const cv::Rect object(200, 100, 120, 250);
  propagator.push(scene(0, object));
  propagator.set(masks_at(0, object));
  propagator.push(scene(1, object));
  propagator.push(scene(2, object));
  EXPECT_NE(propagator.current(), nullptr);
  propagator.push(scene(3, object));
  EXPECT_EQ(propagator.current(), nullptr);
}

}  // namespace
}  // namespace stillmap
