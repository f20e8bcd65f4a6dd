// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/map_server_files.hpp"

#include "stillmap/dense/synthetic_room.hpp"

#include <string>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using namespace testing_support;  // NOLINT(google-build-using-namespace)

TEST(MapServerFiles, WritesPgmAndYaml) {
  const PlannerMaps m = planner_maps();
  const std::string pgm = grid_pgm(m.grid);
  const std::string head = "P5\n" + std::to_string(m.grid.image.cols) + " " +
                           std::to_string(m.grid.image.rows) + "\n255\n";
  EXPECT_EQ(pgm.substr(0, head.size()), head);
  EXPECT_EQ(pgm.size(), head.size() + m.grid.image.total());
  EXPECT_EQ(cv::norm(image_of_pgm(pgm), m.grid.image, cv::NORM_INF), 0);
  for (const std::string& damaged : {pgm.substr(1), pgm.substr(0, pgm.size() - 1), pgm + "x",
                                     std::string("P5\n-3 4\n255\n"), std::string("P5\n9 9\n")})
    EXPECT_TRUE(image_of_pgm(damaged).empty());
  const std::string yaml = grid_yaml(m.grid, "grid.pgm", m.T_map_world);
  for (const char* key : {"image: grid.pgm\n", "resolution: 0.05\n", "origin: [", "negate: 0\n",
                          "occupied_thresh: 0.65\n", "free_thresh: 0.196\n"}) {
    EXPECT_NE(yaml.find(key), std::string::npos) << key;
  }
}

}  // namespace
}  // namespace stillmap
