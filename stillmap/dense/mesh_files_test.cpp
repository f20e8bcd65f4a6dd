// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh_files.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/dense/cloud.hpp"
#include "stillmap/sensor/jpeg_image.hpp"

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

// A square of two triangles with a red texture.
TexturedMesh red_square() {
  TexturedMesh square;
  square.mesh.vertices = {{0, 0, 0}, {1, 0, 0}, {1, 1, 0}, {0, 1, 0}};
  for (std::uint8_t i = 0; i < 4; ++i) square.mesh.colors.push_back({i, 100, 200});
  square.mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  square.places = {{0, 0}, {1, 0}, {1, 0.25F}, {0, 0.25F}};
  square.image = cv::Mat3b(16, 8, cv::Vec3b(0, 0, 200));
  return square;
}

std::uint32_t word(const std::string& bytes, std::size_t at) {
  std::uint32_t value = 0;
  std::memcpy(&value, bytes.data() + at, 4);
  return value;
}

nlohmann::json header_of(const std::string& glb) {
  return nlohmann::json::parse(glb.substr(20, word(glb, 12)));
}

TEST(MeshFiles, PlyHasVerticesAndFaces) {
  const TriangleMesh mesh = red_square().mesh;
  const fs::path file = test::own_path("mesh_files_test.ply");
  write_file(file, mesh_ply(mesh));
  const Cloud vertices = read_ply(file);
  EXPECT_EQ(vertices.points, mesh.vertices);
  EXPECT_EQ(vertices.colors, mesh.colors);
  const std::string bytes = read_file(file);
  EXPECT_NE(bytes.find("element face 2\n"), std::string::npos);
  const char* faces = bytes.data() + bytes.size() - 2 * 13;
  for (const auto& triangle : mesh.triangles) {
    EXPECT_EQ(*faces, 3);
    EXPECT_EQ(std::memcmp(faces + 1, triangle.data(), 12), 0);
    faces += 13;
  }
  fs::remove(file);
}

TEST(MeshFiles, ObjCountsFromOneAndItsTextureUpwards) {
  const std::string text = mesh_obj(red_square(), "a.mtl");
  EXPECT_NE(text.find("mtllib a.mtl\n"), std::string::npos);
  EXPECT_NE(text.find("v 1.00000 1.00000 0.00000\n"), std::string::npos);
  EXPECT_NE(text.find("vt 1.000000 0.750000\n"), std::string::npos);
  EXPECT_NE(text.find("f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n"), std::string::npos);
  EXPECT_NE(mesh_mtl("a.png").find("map_Kd a.png\n"), std::string::npos);
}

TEST(MeshFiles, GlbIsConsistent) {
  const std::string bytes = mesh_glb(red_square(), {0, -1, 0});
  EXPECT_EQ(bytes.substr(0, 4), "glTF");
  EXPECT_EQ(word(bytes, 4), 2U);
  EXPECT_EQ(word(bytes, 8), bytes.size());
  const std::size_t json_size = word(bytes, 12);
  EXPECT_EQ(json_size % 4, 0U);
  const nlohmann::json json = header_of(bytes);
  const std::size_t buffer = 20 + json_size + 8, size = word(bytes, 20 + json_size);
  EXPECT_EQ(size % 4, 0U);
  EXPECT_LT(size - json["buffers"][0]["byteLength"].get<std::size_t>(), 4U);
  EXPECT_EQ(buffer + size, bytes.size());
  for (const auto& accessor : json["accessors"]) {
    const auto& view = json["bufferViews"][accessor["bufferView"].get<std::size_t>()];
    const std::size_t each = accessor["type"] == "VEC3" ? 12 : (accessor["type"] == "VEC2" ? 8 : 4);
    EXPECT_EQ(view["byteLength"], accessor["count"].get<std::size_t>() * each);
  }
  EXPECT_EQ(word(bytes, buffer + 12), 0U);  // the second triangle: 0 2 3
  EXPECT_EQ(word(bytes, buffer + 16), 2U);
}

TEST(MeshFiles, GlbContainsTheTextureAsJpeg) {
  const std::string bytes = mesh_glb(red_square(), {0, -1, 0});
  const nlohmann::json json = header_of(bytes);
  const auto& view = json["bufferViews"][json["images"][0]["bufferView"].get<std::size_t>()];
  const std::string jpeg =
      bytes.substr(28 + word(bytes, 12) + view["byteOffset"].get<std::size_t>(),
                   view["byteLength"].get<std::size_t>());
  const cv::Mat3b image =
      decode_jpeg({reinterpret_cast<const unsigned char*>(jpeg.data()), jpeg.size()}).image;
  ASSERT_EQ(image.size(), cv::Size(8, 16));
  EXPECT_NEAR(image(8, 4)[2], 200, 4);
  EXPECT_NEAR(image(8, 4)[0], 0, 4);
}

// The first camera looks down by 30 degrees, so that up is between -y and -z of its frame.
TEST(MeshFiles, GlbStandsUpright) {
  const Eigen::Vector3d up(0, -std::cos(M_PI / 6), -std::sin(M_PI / 6));
  for (const Eigen::Vector3d& direction : {Eigen::Vector3d(0, -1, 0), up}) {
    const auto q = header_of(mesh_glb(red_square(), direction))["nodes"][0]["rotation"];
    const Eigen::Quaterniond rotation(q[3], q[0], q[1], q[2]);
    EXPECT_NEAR((rotation * direction - Eigen::Vector3d::UnitY()).norm(), 0, 1e-6);
  }
}

}  // namespace
}  // namespace stillmap
