// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/instance_cells.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Rect kThing(120, 80, 80, 80);  // pixels, on the borders of cells
const cv::Rect kThingCells(30, 20, 20, 20);

/// A thing 1.5 m away before a wall at 3 m.
CellGrid thing_before_wall() {
  Camera camera;
  camera.width = 320;
  camera.height = 240;
  camera.fx = camera.fy = 262.5;
  camera.cx = 159.5;
  camera.cy = 119.5;
  cv::Mat1f depth(240, 320, 3.0F);
  depth(kThing) = 1.5F;
  return {depth, camera};
}

Instance person(const cv::Rect& box, bool mask) {
  Instance made;
  made.class_name = "person";
  made.box = box;
  if (mask) made.mask = cv::Mat(box.size(), CV_8UC1, cv::Scalar(255));
  return made;
}

/// Cells that are the thing's in truth and by `cells`.
void expect_all_and_only(const cv::Mat1b& cells, const cv::Rect& truth) {
  EXPECT_EQ(cv::countNonZero(cells(truth)), truth.area());
  EXPECT_EQ(cv::countNonZero(cells), truth.area());
}

TEST(InstanceCells, AMaskTooLargeKeepsToTheThing) {
  const cv::Rect large(kThing.x - 12, kThing.y - 12, kThing.width + 24, kThing.height + 24);
  expect_all_and_only(instance_cells(person(large, true), thing_before_wall()), kThingCells);
}

TEST(InstanceCells, AMaskTooSmallGrowsByTwoCells) {
  const cv::Rect small(kThing.x + 8, kThing.y + 8, kThing.width - 16, kThing.height - 16);
  const cv::Mat1b cells = instance_cells(person(small, true), thing_before_wall());
  EXPECT_EQ(cv::countNonZero(cells(kThingCells)), kThingCells.area());
}

TEST(InstanceCells, ALateMaskTakesNothingOfWhatIsBehind) {
  const cv::Rect late = kThing + cv::Point(24, 0);
  const cv::Mat1b cells = instance_cells(person(late, true), thing_before_wall());
  EXPECT_EQ(cv::countNonZero(cells), cv::countNonZero(cells(kThingCells)));
  EXPECT_GE(cv::countNonZero(cells), 14 * 20);  // the columns under it, but for its six first
}

TEST(InstanceCells, OfABoxWhatLiesAsDeepAsItsMiddle) {
  const cv::Rect box(kThing.x - 20, kThing.y - 20, kThing.width + 40, kThing.height + 40);
  expect_all_and_only(instance_cells(person(box, false), thing_before_wall()), kThingCells);
}

TEST(InstanceCells, CellsWithoutDepthUnderTheMaskAreTheThings) {
  CellGrid grid = thing_before_wall();
  grid.depth(cv::Rect(38, 28, 4, 4)) = 0;
  expect_all_and_only(instance_cells(person(kThing, true), grid), kThingCells);
}

}  // namespace
}  // namespace stillmap
