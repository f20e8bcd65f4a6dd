// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/changes_image.hpp"

#include "stillmap/report/cloud_image.hpp"
#include "stillmap/report/image_marks.hpp"

#include <array>
#include <initializer_list>
#include <map>
#include <string>
#include <vector>

#include <opencv2/core.hpp>
#include <opencv2/imgproc.hpp>

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

struct Meaning {
  Rgb color;
  const char* text;
};

/// Writes which visit an image shows, and the meaning of its colors.
void write_caption(cv::Mat& image, const std::string& visit,
                   std::initializer_list<Meaning> colors) {
  constexpr int kLine = 26, kLeft = 12, kRadius = 7;  // pixels
  cv::Point at(kLeft, kLine);
  write_line(image, visit, at);
  for (const auto& [color, text] : colors) {
    at.y += kLine;
    cv::circle(image, at + cv::Point(kRadius, -kRadius), kRadius,
               cv::Scalar(color[2], color[1], color[0]), cv::FILLED, cv::LINE_AA);
    write_line(image, text, at + cv::Point(3 * kRadius, 0));
  }
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
  using Color = ChangeColors;
  cv::Mat first = draw(before), second = draw(after), both;
  write_caption(first, "before: " + before.name,
                {{Color::kWent, "went"}, {Color::kFrom, "moved from here"}});
  write_caption(second, "after: " + after.name,
                {{Color::kAppeared, "appeared"}, {Color::kTo, "moved to here"}});
  cv::hconcat(first, second, both);
  return both;
}

}  // namespace stillmap
