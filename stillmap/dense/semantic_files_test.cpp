// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/semantic_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/dense/cloud.hpp"

#include <cmath>
#include <cstring>
#include <filesystem>
#include <string>

#include <Eigen/Geometry>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

// Returns four points: of a tv, of no object, of a chair and of another tv.
Cloud cloud() {
  Cloud c;
  for (int i = 0; i < 4; ++i) {
    c.add({static_cast<float>(i), 2, 3}, {static_cast<std::uint8_t>(10 * i), 20, 30});
  }
  return c;
}

SemanticMap semantics() {
  SemanticMap map;
  for (const char* name : {"tv", "chair", "tv"}) {
    StaticObject object;
    object.id = static_cast<int>(map.objects.size()) + 1;
    object.class_name = name;
    object.points = 1;
    object.box.extend(Eigen::Vector3d(0, 1, 2));
    object.box.extend(Eigen::Vector3d(1, 3, 5));
    object.center = object.box.center();
    map.objects.push_back(object);
  }
  map.object = {1, 0, 2, 3};
  map.confidence = {0.5F, 0, 0.25F, 0.75F};
  return map;
}

TEST(SemanticFiles, LabelEachPointInThePly) {
  const std::string bytes = semantic_ply(cloud(), semantics());
  EXPECT_NE(bytes.find("comment label 1 chair\ncomment label 2 tv\n"), std::string::npos);
  constexpr std::size_t kRecord = 12 + 3 + 2 + 1 + 4;
  const char* last = bytes.data() + bytes.size() - kRecord;
  std::uint16_t object = 0;
  float confidence = 0;
  std::memcpy(&object, last + 15, 2);
  std::memcpy(&confidence, last + 18, 4);
  EXPECT_EQ(object, 3);
  EXPECT_EQ(last[17], 2);
  EXPECT_EQ(confidence, 0.75F);
  // A reader of points and colors can read it.
  const auto file = test::own_path("semantic.ply");
  write_file(file, bytes);
  EXPECT_EQ(read_ply(file), cloud());
  std::filesystem::remove(file);
}

TEST(SemanticFiles, ColorClassesAndLeaveTheRestGray) {
  const Cloud colored = colored_by_class(cloud(), semantics());
  EXPECT_EQ(colored.points, cloud().points);
  EXPECT_EQ(colored.colors[0], colored.colors[3]);
  EXPECT_NE(colored.colors[0], colored.colors[2]);
  EXPECT_EQ(colored.colors[1], (Rgb{20, 20, 20}));
  const auto classes = class_colors(semantics());
  ASSERT_EQ(classes.size(), 2U);
  EXPECT_EQ(classes[1].objects, 2U);
  EXPECT_GT(legend_image(classes).rows, 60);
}

TEST(SemanticFiles, ListEachObjectOnce) {
  const nlohmann::json json = objects_json(semantics());
  ASSERT_EQ(json["objects"].size(), 3U);
  EXPECT_EQ(json["objects"][1]["class"], "chair");
  EXPECT_EQ(json["objects"][1]["center"], (nlohmann::json{0.5, 2.0, 3.5}));
  EXPECT_EQ(json["objects"][1]["box"]["max"], (nlohmann::json{1.0, 3.0, 5.0}));
}

// A shelf of 0.8 x 0.4 x 2 m that stands upright; the first camera is rolled by 30 degrees.
TEST(SemanticFiles, UprightBoxesStandOnTheFloor) {
  const Eigen::Matrix3d R_world_upright =
      Eigen::AngleAxisd(M_PI / 6, Eigen::Vector3d::UnitX()).toRotationMatrix();
  SemanticMap map = semantics();
  map.objects.resize(1);
  map.object.clear();
  Cloud shelf;
  for (const double x : {1.0, 1.8})
    for (const double y : {3.0, 3.4})
      for (const double z : {0.0, 2.0}) {
        shelf.add((R_world_upright * Eigen::Vector3d(x, y, z)).cast<float>(), {});
        map.object.push_back(1);
      }
  nlohmann::json json = objects_json(map);
  add_upright_boxes(map, shelf, R_world_upright.transpose(), json);
  const auto& box = json["objects"][0]["upright_box"];
  const auto vector = [](const nlohmann::json& v) { return Eigen::Vector3d(v[0], v[1], v[2]); };
  EXPECT_LT((vector(box["size"]) - Eigen::Vector3d(0.8, 0.4, 2)).norm(), 1e-3);
  EXPECT_LT((vector(box["center"]) - R_world_upright * Eigen::Vector3d(1.4, 3.2, 1)).norm(), 1e-3);
  EXPECT_LT((vector(box["axes"][2]) - R_world_upright.col(2)).norm(), 1e-3);
}

TEST(SemanticFiles, AcceptAMapWithoutObjects) {
  EXPECT_TRUE(objects_json({})["objects"].empty());
  EXPECT_TRUE(class_colors({}).empty());
  EXPECT_EQ(colored_by_class(cloud(), {}).size(), 4U);
  EXPECT_NE(semantic_ply(cloud(), {}).find("element vertex 4"), std::string::npos);
}

}  // namespace
}  // namespace stillmap
