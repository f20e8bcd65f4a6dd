// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/planner_message.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/dense/map_server_files.hpp"

#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

constexpr const char* kRunAgain = "run `stillmap run --planner` again";

/// Values of the cells in the message.
enum class Cell { kUnknown = 0, kFree = 1, kOccupied = 2 };

Cell cell_of(std::uint8_t pixel) {
  if (pixel == 0) return Cell::kOccupied;
  return pixel == 254 ? Cell::kFree : Cell::kUnknown;
}

/// Returns the cells, row by row, as value and number of equal cells in turn.
nlohmann::json runs_of(const cv::Mat1b& image) {
  std::vector<int> runs;
  for (const std::uint8_t pixel : image) {
    const int cell = static_cast<int>(cell_of(pixel));
    if (runs.empty() || runs[runs.size() - 2] != cell) runs.insert(runs.end(), {cell, 0});
    ++runs.back();
  }
  return runs;
}

nlohmann::json grid_json(const fs::path& run) {
  const fs::path file = run / "grid.yaml";
  const cv::Mat1b image = image_of_pgm(read_file(run / "grid.pgm"));
  if (image.empty()) throw Error("is no image", (run / "grid.pgm").string(), kRunAgain);
  try {
    const YAML::Node yaml = YAML::Load(read_file(file));
    return {{"resolution", yaml["resolution"].as<double>()},
            {"origin", {yaml["origin"][0].as<double>(), yaml["origin"][1].as<double>()}},
            {"width", image.cols},
            {"height", image.rows},
            {"cells", runs_of(image)}};
  } catch (const YAML::Exception& e) {
    throw Error("has no resolution and origin: " + e.msg, file.string(), kRunAgain);
  }
}

}  // namespace

std::optional<nlohmann::json> planner_message(const fs::path& run) {
  const fs::path file = run / "obstacles.json";
  if (!fs::exists(file) || !fs::exists(run / "grid.yaml")) return std::nullopt;
  return with_json_of(file, kRunAgain, [&] {
    const auto json = nlohmann::json::parse(read_file(file));
    return nlohmann::json{{"type", "planner"},
                          {"T_map_world", json.at("T_map_world")},
                          {"grid", grid_json(run)},
                          {"obstacles", json.at("obstacles")}};
  });
}

}  // namespace stillmap
