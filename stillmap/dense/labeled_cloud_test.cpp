// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/labeled_cloud.hpp"

#include <gmock/gmock.h>

namespace stillmap {
namespace {

/// Adds a line of points 2 cm apart along x to a cloud.
void add_line(float from, int points, std::uint16_t label, Cloud& cloud, LabeledCloud& labeled) {
  for (int i = 0; i < points; ++i) {
    cloud.add(Eigen::Vector3f(from + 0.02F * static_cast<float>(i), 0, 0), {});
    labeled.labels.push_back(label);
  }
}

TEST(ConnectedObjects, ClassesAndGapsSeparateObjects) {
  Cloud cloud;
  LabeledCloud labeled;
  labeled.classes = {"chair", "tv"};
  add_line(0, 30, 1, cloud, labeled);     // x from 0 to 0.58 m
  add_line(1, 30, 1, cloud, labeled);     // 0.4 m apart from the first
  add_line(0.6F, 20, 2, cloud, labeled);  // beside the first, of another class
  add_line(3, 5, 2, cloud, labeled);      // too small
  add_line(5, 50, 0, cloud, labeled);     // no class
  labeled.cloud = std::make_shared<const Cloud>(cloud);
  const auto objects = connected_objects(labeled);
  ASSERT_EQ(objects.size(), 3U);
  EXPECT_EQ(objects[0].class_name, "chair");
  EXPECT_EQ(objects[0].points, 30U);
  EXPECT_NEAR(objects[0].box.max().x(), 0.58, 1e-6);
  EXPECT_NEAR(objects[1].box.min().x(), 1, 1e-6);
  EXPECT_EQ(objects[2].class_name, "tv");
  EXPECT_EQ(objects[2].id, 3);
}

TEST(ConnectedObjects, ACloudWithoutLabelsHasNone) {
  Cloud cloud;
  cloud.add(Eigen::Vector3f(0, 0, 0), {});
  LabeledCloud labeled;
  labeled.cloud = std::make_shared<const Cloud>(cloud);
  EXPECT_TRUE(connected_objects(labeled).empty());
}

}  // namespace
}  // namespace stillmap
