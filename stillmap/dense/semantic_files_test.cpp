// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/semantic_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/dense/cloud.hpp"

#include <cstring>
#include <filesystem>
#include <string>

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
  const auto file = std::filesystem::temp_directory_path() / "stillmap_semantic_test.ply";
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

TEST(SemanticFiles, AcceptAMapWithoutObjects) {
  EXPECT_TRUE(objects_json({})["objects"].empty());
  EXPECT_TRUE(class_colors({}).empty());
  EXPECT_EQ(colored_by_class(cloud(), {}).size(), 4U);
  EXPECT_NE(semantic_ply(cloud(), {}).find("element vertex 4"), std::string::npos);
}

}  // namespace
}  // namespace stillmap
