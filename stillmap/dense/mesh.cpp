// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/mesh.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/disjoint_sets.hpp"
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_text.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <string>

#include <Eigen/Geometry>
#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace fs = std::filesystem;
namespace {

std::string ply_bytes(const TriangleMesh& mesh) {
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

std::string obj_text(const TriangleMesh& mesh) {
  std::string text = "# meters, world frame; r g b behind x y z\n";
  for (std::size_t i = 0; i < mesh.vertices.size(); ++i) {
    const Eigen::Vector3f& p = mesh.vertices[i];
    const auto& [r, g, b] = mesh.colors[i];
    fmt::format_to(std::back_inserter(text), "v {:.5f} {:.5f} {:.5f} {:.3f} {:.3f} {:.3f}\n", p.x(),
                   p.y(), p.z(), r / 255.0, g / 255.0, b / 255.0);
  }
  for (const auto& [a, b, c] : mesh.triangles) {
    fmt::format_to(std::back_inserter(text), "f {} {} {}\n", a + 1, b + 1, c + 1);
  }
  return text;
}

/// Pads to a multiple of four bytes, as glTF requires of buffer views and chunks.
void pad(std::string& bytes, char with) {
  while (bytes.size() % 4 != 0) bytes.push_back(with);
}

std::string glb_buffer(const TriangleMesh& mesh) {
  ByteWriter buffer;
  for (const auto& triangle : mesh.triangles) {
    for (const std::uint32_t vertex : triangle) buffer.put(vertex);
  }
  for (const Eigen::Vector3f& p : mesh.vertices) {
    for (const float x : p) buffer.put(x);
  }
  for (const Rgb& color : mesh.colors) {
    for (const std::uint8_t c : color) buffer.put(c);
    buffer.put(std::uint8_t{255});
  }
  return buffer.take();
}

/// Returns the description of the buffer by glTF 2.0, sections 3.6 and 3.7: 5125 is unsigned int,
/// 5126 float, 5121 unsigned byte; 34963 an index buffer, 34962 a vertex buffer.
nlohmann::json glb_header(const TriangleMesh& mesh, const Eigen::Vector3d& up) {
  const std::size_t vertices = mesh.vertices.size(), indices = 3 * mesh.triangles.size();
  Eigen::Vector3f low = Eigen::Vector3f::Constant(std::numeric_limits<float>::max()), high = -low;
  for (const Eigen::Vector3f& p : mesh.vertices) {
    low = low.cwiseMin(p);
    high = high.cwiseMax(p);
  }
  if (vertices == 0) low = high = Eigen::Vector3f::Zero();
  const auto view = [](std::size_t offset, std::size_t length, int target) {
    return nlohmann::json{
        {"buffer", 0}, {"byteOffset", offset}, {"byteLength", length}, {"target", target}};
  };
  nlohmann::json json;
  json["asset"] = {{"version", "2.0"}, {"generator", "stillmap"}};
  json["scene"] = 0;
  json["scenes"] = {{{"nodes", {0}}}};
  // The camera's world has y downwards, glTF's upwards: half a turn about x, and the tilt of the
  // first camera.
  const Eigen::Quaterniond half_turn(0, 1, 0, 0);
  const Eigen::Quaterniond q =
      Eigen::Quaterniond::FromTwoVectors(half_turn * up, Eigen::Vector3d::UnitY()) * half_turn;
  json["nodes"] = {{{"mesh", 0}, {"rotation", {q.x(), q.y(), q.z(), q.w()}}}};
  json["meshes"] = {
      {{"primitives",
        {{{"attributes", {{"POSITION", 1}, {"COLOR_0", 2}}}, {"indices", 0}, {"material", 0}}}}}};
  json["materials"] = {
      {{"doubleSided", true},
       {"pbrMetallicRoughness", {{"metallicFactor", 0.0}, {"roughnessFactor", 1.0}}}}};
  json["accessors"] = {
      {{"bufferView", 0}, {"componentType", 5125}, {"count", indices}, {"type", "SCALAR"}},
      {{"bufferView", 1},
       {"componentType", 5126},
       {"count", vertices},
       {"type", "VEC3"},
       {"min", {low.x(), low.y(), low.z()}},
       {"max", {high.x(), high.y(), high.z()}}},
      {{"bufferView", 2},
       {"componentType", 5121},
       {"count", vertices},
       {"type", "VEC4"},
       {"normalized", true}}};
  json["bufferViews"] = {view(0, 4 * indices, 34963), view(4 * indices, 12 * vertices, 34962),
                         view(4 * indices + 12 * vertices, 4 * vertices, 34962)};
  json["buffers"] = {{{"byteLength", 4 * indices + 16 * vertices}}};
  return json;
}

std::string glb_bytes(const TriangleMesh& mesh, const Eigen::Vector3d& up) {
  constexpr std::uint32_t kMagic = 0x46546C67, kJson = 0x4E4F534A, kBin = 0x004E4942;
  std::string header = json_text(glb_header(mesh, up)), buffer = glb_buffer(mesh);
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

}  // namespace

TriangleMesh without_specks(const TriangleMesh& mesh, std::size_t min_triangles) {
  DisjointSets parts(mesh.vertices.size());
  for (const auto& [a, b, c] : mesh.triangles) {
    parts.unite(a, b);
    parts.unite(b, c);
  }
  std::vector<std::size_t> size(mesh.vertices.size(), 0);
  for (const auto& triangle : mesh.triangles) ++size[parts.root(triangle[0])];

  constexpr std::uint32_t kUnused = std::numeric_limits<std::uint32_t>::max();
  std::vector<std::uint32_t> number(mesh.vertices.size(), kUnused);
  TriangleMesh kept;
  for (auto triangle : mesh.triangles) {
    if (size[parts.root(triangle[0])] < min_triangles) continue;
    for (std::uint32_t& vertex : triangle) {
      if (number[vertex] == kUnused) {
        number[vertex] = static_cast<std::uint32_t>(kept.vertices.size());
        kept.vertices.push_back(mesh.vertices[vertex]);
        kept.colors.push_back(mesh.colors[vertex]);
      }
      vertex = number[vertex];
    }
    kept.triangles.push_back(triangle);
  }
  return kept;
}

Cloud sampled(const TriangleMesh& mesh, double spacing) {
  Cloud cloud;
  for (const auto& [a, b, c] : mesh.triangles) {
    const std::array<Eigen::Vector3f, 3> p{mesh.vertices[a], mesh.vertices[b], mesh.vertices[c]};
    const std::array<Rgb, 3> color{mesh.colors[a], mesh.colors[b], mesh.colors[c]};
    const float longest =
        std::max({(p[1] - p[0]).norm(), (p[2] - p[0]).norm(), (p[2] - p[1]).norm()});
    const int steps = std::clamp(static_cast<int>(std::ceil(longest / spacing)), 1, 64);
    for (int i = 0; i <= steps; ++i) {
      for (int j = 0; i + j <= steps; ++j) {
        const float s = static_cast<float>(i) / static_cast<float>(steps);
        const float t = static_cast<float>(j) / static_cast<float>(steps);
        Rgb mixed;
        for (std::size_t k = 0; k < 3; ++k) {
          const float value = (1 - s - t) * static_cast<float>(color[0][k]) +
                              s * static_cast<float>(color[1][k]) +
                              t * static_cast<float>(color[2][k]);
          mixed[k] = static_cast<std::uint8_t>(std::clamp(value + 0.5F, 0.0F, 255.0F));
        }
        cloud.add((1 - s - t) * p[0] + s * p[1] + t * p[2], mixed);
      }
    }
  }
  return cloud;
}

void write_mesh(const fs::path& file, const TriangleMesh& mesh, const Eigen::Vector3d& up) {
  std::string extension = file.extension().string();
  for (char& c : extension) c = static_cast<char>(std::tolower(static_cast<unsigned char>(c)));
  if (extension == ".ply") return write_file(file, ply_bytes(mesh));
  if (extension == ".obj") return write_file(file, obj_text(mesh));
  if (extension == ".glb") return write_file(file, glb_bytes(mesh, up));
  throw Error("a mesh cannot be written in this format", file.string(),
              "name a file that ends in .ply, .obj or .glb");
}

}  // namespace stillmap
