// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/changes_image.hpp"

#include "stillmap/report/cloud_image.hpp"

#include <array>
#include <map>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {
namespace {

using Points = std::vector<Eigen::Vector3f>;

/// Returns the colors of a cloud, dimmed but for the points of changes.
std::vector<Rgb> highlighted(const Cloud& cloud, const Cloud& changed) {
  std::map<std::array<float, 3>, Rgb> color_of;
  for (std::size_t i = 0; i < changed.size(); ++i) {
    const Eigen::Vector3f& p = changed.points[i];
    color_of[{p.x(), p.y(), p.z()}] = changed.colors[i];
  }
  std::vector<Rgb> colors = cloud.colors;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const Eigen::Vector3f& p = cloud.points[i];
    const auto found = color_of.find({p.x(), p.y(), p.z()});
    if (found != color_of.end()) {
      colors[i] = found->second;
      continue;
    }
    const auto& [r, g, b] = cloud.colors[i];
    colors[i].fill(static_cast<std::uint8_t>(60 + (r + g + b) / 6));
  }
  return colors;
}

}  // namespace

cv::Mat draw_changes(const MapChanges& changes) {
  CloudImageOptions options{.width = 1000, .height = 800};
  options.splat = 0.022;  // the clouds have voxels of 2 cm
  const Cloud changed = changes_cloud(changes);
  const auto& [list, before, after, world] = changes;
  const CloudView view =
      choose_cloud_view({after.cloud.points, after.cloud.colors, {}}, after.cameras, options);
  const auto draw = [&](const ComparedMap& map) {
    const std::vector<Rgb> colors = highlighted(map.cloud, changed);
    return draw_cloud({map.cloud.points, colors, {}}, map.cameras, view, options);
  };
  cv::Mat both;
  cv::hconcat(draw(before), draw(after), both);
  return both;
}

}  // namespace stillmap
