// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh.hpp"

#include "stillmap/base/error.hpp"
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

namespace fs = std::filesystem;

// Returns a square of two triangles, a separate triangle, and an unused vertex.
TriangleMesh small_mesh() {
  TriangleMesh mesh;
  mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0},
                   {9, 9, 9}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}};
  for (std::uint8_t i = 0; i < 8; ++i) mesh.colors.push_back({i, 100, 200});
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}, {5, 6, 7}};
  return mesh;
}

fs::path temporary(const std::string& name) { return test::own_path("mesh_test_" + name); }

TEST(Mesh, LosesSpecksAndUnusedVertices) {
  const TriangleMesh kept = without_specks(small_mesh(), 2);
  EXPECT_EQ(kept.triangles.size(), 2U);
  EXPECT_EQ(kept.vertices.size(), 4U);
  EXPECT_EQ(kept.colors.size(), 4U);
  EXPECT_EQ(without_specks(small_mesh(), 1).triangles.size(), 3U);
  EXPECT_TRUE(without_specks(small_mesh(), 3).empty());
}

TEST(Mesh, IsSampledAtTheGivenSpacing) {
  const Cloud cloud = sampled(without_specks(small_mesh(), 2), 0.1);
  for (double x = 0.03; x < 1; x += 0.11) {
    for (double y = 0.02; y < 1; y += 0.13) {
      float nearest = 1;
      for (const auto& p : cloud.points) {
        nearest = std::min(nearest, (p - Eigen::Vector3d(x, y, 0).cast<float>()).norm());
      }
      EXPECT_LT(nearest, 0.075) << x << " " << y;
    }
  }
}

TEST(Mesh, IsWrittenAsPlyWithItsVerticesAndFaces) {
  const fs::path file = temporary("a.ply");
  write_mesh(file, small_mesh());
  const Cloud vertices = read_ply(file);
  EXPECT_EQ(vertices.points, small_mesh().vertices);
  EXPECT_EQ(vertices.colors, small_mesh().colors);
  const std::string bytes = read_file(file);
  EXPECT_NE(bytes.find("element face 3\n"), std::string::npos);
  const char* faces = bytes.data() + bytes.size() - 3 * 13;
  for (const auto& triangle : small_mesh().triangles) {
    EXPECT_EQ(*faces, 3);
    EXPECT_EQ(std::memcmp(faces + 1, triangle.data(), 12), 0);
    faces += 13;
  }
  fs::remove(file);
}

TEST(Mesh, IsWrittenAsObjCountedFromOne) {
  const fs::path file = temporary("a.obj");
  write_mesh(file, small_mesh());
  const std::string text = read_file(file);
  EXPECT_NE(text.find("v 1.00000 1.00000 0.00000 0.008 0.392 0.784\n"), std::string::npos);
  EXPECT_NE(text.find("f 1 2 3\nf 1 3 4\nf 6 7 8\n"), std::string::npos);
  fs::remove(file);
}

TEST(Mesh, IsWrittenAsConsistentGlb) {
  const fs::path file = temporary("a.glb");
  write_mesh(file, small_mesh());
  const std::string bytes = read_file(file);
  const auto word = [&](std::size_t at) {
    std::uint32_t value = 0;
    std::memcpy(&value, bytes.data() + at, 4);
    return value;
  };
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(4), 2U);
  EXPECT_EQ(word(8), bytes.size());
  const std::size_t json_size = word(12);
  EXPECT_EQ(json_size % 4, 0U);
  const auto json = nlohmann::json::parse(bytes.substr(20, json_size));
  const std::size_t buffer = 20 + json_size + 8;
  EXPECT_EQ(word(20 + json_size), json["buffers"][0]["byteLength"].get<std::uint32_t>());
  EXPECT_EQ(buffer + word(20 + json_size), bytes.size());
  for (const auto& accessor : json["accessors"]) {
    const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    const std::size_t size = accessor["type"] == "VEC3" ? 12 : 4;
    EXPECT_EQ(view["byteLength"], accessor["count"].get<std::size_t>() * size);
  }
  EXPECT_EQ(word(buffer + 12), 0U);  // the second triangle: 0 2 3
  EXPECT_EQ(word(buffer + 16), 2U);
  fs::remove(file);
}

// The first camera looks down by 30 degrees, so that up is between -y and -z of its frame.
TEST(Mesh, StandsUprightAsGlb) {
  const Eigen::Vector3d up(0, -std::cos(M_PI / 6), -std::sin(M_PI / 6));
  const fs::path file = temporary("upright.glb");
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, -1, 0), up}) {
    write_mesh(file, small_mesh(), direction);
    const std::string bytes = read_file(file);
    std::uint32_t size = 0;
    std::memcpy(&size, bytes.data() + 12, 4);
    const auto q = nlohmann::json::parse(bytes.substr(20, size))["nodes"][0]["rotation"];
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    EXPECT_NEAR((rotation * direction - Eigen::Vector3d::UnitY()).norm(), 0, 1e-6);
  }
  fs::remove(file);
}

TEST(Mesh, RefusesOtherFormats) {
  EXPECT_THROW(write_mesh(temporary("a.stl"), small_mesh()), Error);
}

}  // namespace
}  // namespace stillmap
