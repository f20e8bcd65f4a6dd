// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh_files.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/json_text.hpp"
#include "stillmap/sensor/jpeg_image.hpp"

#include <array>
#include <cstdint>
#include <iterator>
#include <span>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

constexpr int kJpegQuality = 90;

/// Pads to a multiple of four bytes, as glTF requires of buffer views and chunks.
void pad(std::string& bytes, char with) {
  while (bytes.size() % 4 != 0) bytes.push_back(with);
}

std::string glb_buffer(const TexturedMesh& mesh, std::span<const unsigned char> image) {
  ByteWriter buffer;
  for (const auto& triangle : mesh.mesh.triangles) {
    for (const std::uint32_t vertex : triangle) buffer.put(vertex);
  }
  for (const Eigen::Vector3f& p : mesh.mesh.vertices) {
    for (const float x : p) buffer.put(x);
  }
  for (const Eigen::Vector2f& place : mesh.places) {
    for (const float x : place) buffer.put(x);
  }
  buffer.put_list(image);
  return buffer.take();
}

/// Returns the description of the buffer by glTF 2.0, sections 3.6 and 3.7: 5125 is unsigned int,
/// 5126 float; 34963 an index buffer, 34962 a vertex buffer.
nlohmann::json glb_header(const TexturedMesh& mesh, std::size_t image_size,
                          const Eigen::Vector3d& up) {
  const std::size_t vertices = mesh.mesh.vertices.size(), indices = 3 * mesh.mesh.triangles.size();
  const std::size_t places_at = 4 * indices + 12 * vertices, image_at = places_at + 8 * vertices;
  Eigen::AlignedBox3f box(Eigen::Vector3f::Zero().eval());
  if (vertices > 0) box.setEmpty();
  for (const Eigen::Vector3f& p : mesh.mesh.vertices) box.extend(p);
  const auto view = [](std::size_t offset, std::size_t length, int target) {
    return nlohmann::json{
        {"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}};
  };
  nlohmann::json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "stillmap"}};
  json["extensionsUsed"] = {"KHR_materials_unlit"};
  json["scene"] = 0;
  json["scenes"] = {{{"nodes", {0}}}};
  // The camera's world has y downwards, glTF's upwards: half a turn about x, and the tilt of the
  // first camera.
  const Eigen::Quaterniond half_turn(0, 1, 0, 0);
  const Eigen::Quaterniond q =
      Eigen::Quaterniond::FromTwoVectors(half_turn * up, Eigen::Vector3d::UnitY()) * half_turn;
  json["nodes"] = {{{"mesh", 0}, {"rotation", {q.x(), q.y(), q.z(), q.w()}}}};
  json["meshes"] = {{{"primitives",
                      {{{"attributes", {{"POSITION", 1}, {"TEXCOORD_0", 2}}},
                        {"indices", 0},
                        {"material", 0}}}}}};
  json["materials"] = {{{"doubleSided", true},
                        {"extensions", {{"KHR_materials_unlit", nlohmann::json::object()}}},
                        {"pbrMetallicRoughness",
                         {{"baseColorTexture", {{"index", 0}}},
                          {"metallicFactor", 0.0},
                          {"roughnessFactor", 1.0}}}}};
  json["textures"] = {{{"source", 0}, {"sampler", 0}}};
  json["images"] = {{{"bufferView", 3}, {"mimeType", "image/jpeg"}}};
  constexpr int kLinear = 9729, kLinearMipmaps = 9987, kClamp = 33071;
  json["samplers"] = {{{"magFilter", kLinear},
                       {"minFilter", kLinearMipmaps},
                       {"wrapS", kClamp},
                       {"wrapT", kClamp}}};
  json["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5125}, {"count", indices}, {"type", "SCALAR"}},
      {{"bufferView", 1},
       {"componentType", 5126},
       {"count", vertices},
       {"type", "VEC3"},
       {"min", {box.min().x(), box.min().y(), box.min().z()}},
       {"max", {box.max().x(), box.max().y(), box.max().z()}}},
      {{"bufferView", 2}, {"componentType", 5126}, {"count", vertices}, {"type", "VEC2"}}};
  json["bufferViews"] = {view(0, 4 * indices, 34963),
                         view(4 * indices, 12 * vertices, 34962),
                         view(places_at, 8 * vertices, 34962),
                         {{"buffer", 0}, {"byteOffset", image_at}, {"byteLength", image_size}}};
  json["buffers"] = {{{"byteLength", image_at + image_size}}};
  return json;
}

}  // namespace

std::string mesh_ply(const TriangleMesh& mesh) {
  const std::string header = fmt::format(
      "ply\nformat binary_little_endian 1.0\ncomment meters, world frame\n"
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "element face {}\nproperty list uchar int vertex_indices\nend_header\n",
      mesh.vertices.size(), mesh.triangles.size());
  ByteWriter bytes;
  bytes.put_list(std::span<const char>(header));
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    for (const float x : mesh.vertices[i]) bytes.put(x);
    for (const std::uint8_t c : mesh.colors[i]) bytes.put(c);
  }
  for (const auto& triangle : mesh.triangles) {
    bytes.put(std::uint8_t{3});
    for (const std::uint32_t vertex : triangle) bytes.put(vertex);
  }
  return bytes.take();
}

std::string mesh_glb(const TexturedMesh& mesh, const Eigen::Vector3d& up) {
  constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBin = 0x004E4942;
  const std::vector<unsigned char> image = encode_jpeg(mesh.image, kJpegQuality);
  std::string header = json_text(glb_header(mesh, image.size(), up)),
              buffer = glb_buffer(mesh, image);
  pad(header, ' ');
  pad(buffer, '\0');
  ByteWriter bytes;
  const std::size_t size = 12 + 8 + header.size() + 8 + buffer.size();
  for (const std::uint32_t word : {kMagic, std::uint32_t{2}, static_cast<std::uint32_t>(size),
                                   static_cast<std::uint32_t>(header.size()), kJson}) {
    bytes.put(word);
  }
  bytes.put_list(std::span<const char>(header));
  bytes.put(static_cast<std::uint32_t>(buffer.size()));
  bytes.put(kBin);
  bytes.put_list(std::span<const char>(buffer));
  return bytes.take();
}

std::string mesh_obj(const TexturedMesh& mesh, std::string_view material) {
  std::string text = fmt::format("# meters, world frame\nmtllib {}\nusemtl photos\n", material);
  const auto out = std::back_inserter(text);
  for (const Eigen::Vector3f& p : mesh.mesh.vertices)
    fmt::format_to(out, "v {:.5f} {:.5f} {:.5f}\n", p.x(), p.y(), p.z());
  for (const Eigen::Vector2f& place : mesh.places)
    fmt::format_to(out, "vt {:.6f} {:.6f}\n", place.x(), 1 - place.y());  // upwards
  for (const auto& [a, b, c] : mesh.mesh.triangles)
    fmt::format_to(out, "f {0}/{0} {1}/{1} {2}/{2}\n", a + 1, b + 1, c + 1);
  return text;
}

std::string mesh_mtl(std::string_view image) {
  return fmt::format("newmtl photos\nKa 1 1 1\nKd 1 1 1\nKs 0 0 0\nillum 0\nmap_Kd {}\n", image);
}

}  // namespace stillmap
