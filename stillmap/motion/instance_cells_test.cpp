// SPDX-License-Identifier: Apache-2.0
#include "stillmap/motion/instance_cells.hpp"

#include "stillmap/motion/test_frames.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

const cv::Rect kObject(120, 80, 80, 80);  // pixels, on the borders of cells
const cv::Rect kObjectCells(30, 20, 20, 20);

/// Returns an object at 1.5 m in front of a wall at 3 m.
CellGrid object_and_wall() {
  cv::Mat1f depth(240, 320, 3.0F);
  depth(kObject) = 1.5F;
  return {depth, test::small_camera()};
}

Instance person(const cv::Rect& box, bool mask) {
  Instance made = test::box_of("person", box);
  if (mask) made.mask = cv::Mat(box.size(), CV_8UC1, cv::Scalar(255));
  return made;
}

/// Expects the true cells of the object and no others.
void expect_all_and_only(const cv::Mat1b& cells, const cv::Rect& truth) {
  EXPECT_EQ(cv::countNonZero(cells(truth)), truth.area());
  EXPECT_EQ(cv::countNonZero(cells), truth.area());
}

TEST(InstanceCells, AMaskTooLargeIsReducedToTheObject) {
  const cv::Rect large(kObject.x - 12, kObject.y - 12, kObject.width + 24, kObject.height + 24);
  expect_all_and_only(instance_cells(person(large, true), object_and_wall()), kObjectCells);
}

TEST(InstanceCells, AMaskTooSmallGrowsByTwoCells) {
  const cv::Rect small(kObject.x + 8, kObject.y + 8, kObject.width - 16, kObject.height - 16);
  const cv::Mat1b cells = instance_cells(person(small, true), object_and_wall());
  EXPECT_EQ(cv::countNonZero(cells(kObjectCells)), kObjectCells.area());
}

TEST(InstanceCells, ALateMaskIncludesNoBackground) {
  const cv::Rect late = kObject + cv::Point(24, 0);
  const cv::Mat1b cells = instance_cells(person(late, true), object_and_wall());
  EXPECT_EQ(cv::countNonZero(cells), cv::countNonZero(cells(kObjectCells)));
  EXPECT_GE(cv::countNonZero(cells), 14 * 20);  // the columns under the mask without the first six
}

TEST(InstanceCells, ABoxIncludesTheSurfaceAtTheDepthOfItsCenter) {
  const cv::Rect box(kObject.x - 20, kObject.y - 20, kObject.width + 40, kObject.height + 40);
  expect_all_and_only(instance_cells(person(box, false), object_and_wall()), kObjectCells);
}

TEST(InstanceCells, CellsWithoutDepthInTheMaskBelongToTheObject) {
  CellGrid grid = object_and_wall();
  grid.depth(cv::Rect(38, 28, 4, 4)) = 0;
  expect_all_and_only(instance_cells(person(kObject, true), grid), kObjectCells);
}

}  // namespace
}  // namespace stillmap
