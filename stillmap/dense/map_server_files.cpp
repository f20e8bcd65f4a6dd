// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/map_server_files.hpp"

#include <algorithm>
#include <cstdint>
#include <sstream>

#include <fmt/format.h>

namespace stillmap {

std::string grid_pgm(const OccupancyGrid& grid) {
  std::string bytes = fmt::format("P5\n{} {}\n255\n", grid.image.cols, grid.image.rows);
  for (const std::uint8_t pixel : grid.image) bytes.push_back(static_cast<char>(pixel));
  return bytes;
}

cv::Mat1b image_of_pgm(const std::string& pgm) {
  constexpr int kLargest = 1 << 16;  // cells on a side
  std::istringstream in(pgm);
  std::string format;
  int width = 0, height = 0, brightest = 0;
  in >> format >> width >> height >> brightest;
  in.get();  // one blank after the head
  if (!in || format != "P5" || brightest != 255) return {};
  if (std::min(width, height) < 1 || std::max(width, height) > kLargest) return {};
  const auto cells = static_cast<std::streamsize>(width) * height;
  if (static_cast<std::streamsize>(pgm.size()) != in.tellg() + cells) return {};
  cv::Mat1b image(height, width);
  in.read(reinterpret_cast<char*>(image.data), cells);
  return image;
}

std::string grid_yaml(const OccupancyGrid& grid, const std::string& image_name,
                      const Pose& T_map_world) {
  const Eigen::Quaterniond& q = T_map_world.quaternion();
  const Eigen::Vector3d& t = T_map_world.translation();
  return fmt::format(
      "image: {}\nresolution: {}\norigin: [{:.6f}, {:.6f}, 0.0]\nnegate: 0\n"
      "occupied_thresh: 0.65\nfree_thresh: 0.196\nmode: trinary\n"
      "# frame map in the trajectory's world: T_map_world as tx ty tz qx qy qz qw\n"
      "# T_map_world: {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f} {:.9f}\n",
      image_name, grid.resolution, grid.origin.x(), grid.origin.y(), t.x(), t.y(), t.z(), q.x(),
      q.y(), q.z(), q.w());
}

}  // namespace stillmap
