// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/changes_message.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/json_file.hpp"
#include "stillmap/pipeline/map_changes.hpp"

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

using Json = nlohmann::json;

constexpr const char* kCompareAgain = "run `stillmap map changes` again";

Json box_json(const Json& surface) {
  using Corner = std::array<double, 3>;
  return {{"min", surface.at("min").get<Corner>()}, {"max", surface.at("max").get<Corner>()}};
}

Json change_json(const Json& change) {
  const std::string kind = change.at("kind");
  Json drawn{{"kind", kind}, {"class", change.at("class").get<std::string>()}};
  if (kind != "appeared") drawn["before"] = box_json(change.at("before"));
  if (kind != "went") drawn["after"] = box_json(change.at("after"));
  return drawn;
}

/// Returns the coordinates of the points of a color, in whole millimeters to keep the text short.
std::vector<double> points_of(const Cloud& cloud, const Rgb& color) {
  std::vector<double> coordinates;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    if (cloud.colors[i] != color) continue;
    for (const float x : cloud.points[i]) coordinates.push_back(std::round(1e3 * x) / 1e3);
  }
  return coordinates;
}

}  // namespace

Json changes_message(const fs::path& folder) {
  for (const char* name : {"changes.ply", "after.ply", "after.txt"}) {
    if (!fs::exists(folder / name))
      throw Error(fmt::format("has no {}", name), folder.string(), kCompareAgain);
  }
  const fs::path file = folder / kChangesFile;
  Json message{{"type", "changes"}, {"changes", Json::array()}};
  with_json_of(file, kCompareAgain, [&] {
    const auto json = Json::parse(read_file(file));
    for (const char* visit : {"before", "after"})
      message[visit] = json.at(visit).at("name").get<std::string>();
    for (const auto& change : json.at("changes").get<std::vector<Json>>())
      message["changes"].push_back(change_json(change));
  });
  const Cloud cloud = read_ply(folder / "changes.ply");
  message["went"] = points_of(cloud, ChangeColors::kWent);
  message["from"] = points_of(cloud, ChangeColors::kFrom);
  return message;
}

}  // namespace stillmap
