// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/mover_picture.hpp"

#include "stillmap/evaluate/plot.hpp"
#include "stillmap/evaluate/statistics.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

const cv::Scalar kPaper(255, 255, 255), kInk(35, 30, 28), kSoftInk(110, 102, 96),
    kCameras(150, 140, 130);
constexpr double kHeadroom = 0.3;  // of the cloud above the highest camera [m]
constexpr double kPale = 0.45;     // what is left of the cloud's colors

/// One mover's positions, by time.
using Ways = std::map<int, std::vector<MoverPosition>>;

Ways ways_of(const std::vector<MoverPosition>& movers) {
  Ways ways;
  for (const MoverPosition& position : movers) ways[position.id].push_back(position);
  for (auto& [id, way] : ways) {
    std::sort(way.begin(), way.end(),
              [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  }
  return ways;
}

/// Dark enough for white paper, and told apart by those who see no red or green (after Okabe and
/// Ito, Color Universal Design, 2008).
cv::Scalar color_of(int id) {
  static const std::array<cv::Scalar, 7> kColors{cv::Scalar(178, 114, 0),  cv::Scalar(0, 94, 213),
                                                 cv::Scalar(115, 158, 0),  cv::Scalar(0, 140, 200),
                                                 cv::Scalar(167, 80, 190), cv::Scalar(60, 40, 40),
                                                 cv::Scalar(200, 160, 30)};
  return kColors[static_cast<std::size_t>(id - 1) % kColors.size()];
}

/// The cloud's points that are not higher than the cameras, and where they lie on the paper.
struct Floor {
  std::vector<Eigen::Vector2d> at;
  std::vector<double> height;
  std::vector<std::array<std::uint8_t, 3>> colors;
};

Floor floor_of(const CloudSpan& cloud, const Trajectory& cameras, const PaperPlane& plane,
               const Eigen::Vector3d& up) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const auto& [stamp, T] : cameras) highest = std::max(highest, up.dot(T.translation()));
  Floor floor;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (!p.allFinite() || up.dot(p) > highest + kHeadroom) continue;
    floor.at.push_back(plane(p));
    floor.height.push_back(up.dot(p));
    floor.colors.push_back(cloud.colors[i]);
  }
  return floor;
}

/// Everything that moves, the cameras, and nearly all of the cloud.
std::array<Range, 2> extent_of(const Ways& ways, const Trajectory& cameras, const Floor& floor,
                               const PaperPlane& plane) {
  std::array<Range, 2> extent;
  const auto include = [&](const Eigen::Vector2d& p) {
    extent[0].include(p.x());
    extent[1].include(p.y());
  };
  for (const auto& [id, way] : ways) {
    for (const MoverPosition& position : way) include(plane(position.centroid));
  }
  for (const auto& [stamp, T] : cameras) include(plane(T.translation()));
  for (const int axis : {0, 1}) {
    std::vector<double> values;
    for (const Eigen::Vector2d& p : floor.at) values.push_back(p(axis));
    if (values.empty()) continue;
    for (const double share : {0.01, 0.99}) extent[axis].include(quantile(values, share));
  }
  if (extent[0].empty()) extent[0] = extent[1] = {-1, 1};
  return extent;
}

/// The highest point in every pixel, pale; each covers four.
void draw_floor(cv::Mat3b& picture, const Floor& floor, const Plot& plot) {
  cv::Mat1f highest(picture.size(), -std::numeric_limits<float>::infinity());
  const cv::Rect area(plot.area());
  for (std::size_t i = 0; i < floor.at.size(); ++i) {
    const cv::Point2d at = plot(floor.at[i]);
    const auto& [red, green, blue] = floor.colors[i];
    const cv::Vec3d color =
        kPale * cv::Vec3d(blue, green, red) + (1 - kPale) * cv::Vec3d(255, 255, 255);
    for (const cv::Point offset :
         {cv::Point(0, 0), cv::Point(1, 0), cv::Point(0, 1), cv::Point(1, 1)}) {
      const cv::Point pixel = cv::Point(cvFloor(at.x), cvFloor(at.y)) + offset;
      const auto height = static_cast<float>(floor.height[i]);
      if (!area.contains(pixel) || highest(pixel) >= height) continue;
      highest(pixel) = height;
      picture(pixel) = color;
    }
  }
}

void draw_way(Canvas& canvas, const Plot& plot, const PaperPlane& plane,
              const std::vector<MoverPosition>& way) {
  const cv::Scalar color = color_of(way.front().id);
  constexpr std::size_t kDots = 3;  // frames from one dot to the next
  for (std::size_t i = 1; i < way.size(); ++i) {
    const cv::Point2d from = plot(plane(way[i - 1].centroid)), to = plot(plane(way[i].centroid));
    if (way[i].observed) canvas.line(from, to, color, 2.2);
    if (!way[i].observed && i % kDots == 0) canvas.disc(to, 1.6, color);
  }
  canvas.disc(plot(plane(way.front().centroid)), 4.5, color);
}

/// The corners of a box fall on the corners of a rectangle, as the paper lies along the axes.
void draw_box(Canvas& canvas, const Plot& plot, const PaperPlane& plane,
              const Eigen::AlignedBox3d& box, const cv::Scalar& color) {
  if (box.isEmpty()) return;
  const cv::Point2d a = plot(plane(box.min())), b = plot(plane(box.max()));
  canvas.rectangle(cv::Rect2d(a, b), color, 1.6);
}

void draw_arrow(Canvas& canvas, const cv::Point2d& from, const cv::Point2d& to,
                const cv::Scalar& color) {
  const cv::Point2d way = to - from;
  const double length = std::hypot(way.x, way.y);
  if (length < 6) return;  // pixels: shorter than its head
  const cv::Point2d head = way * (7 / length), side(-head.y * 0.6, head.x * 0.6);
  canvas.line(from, to, color, 2.2);
  canvas.line(to, to - head + side, color, 2.2);
  canvas.line(to, to - head - side, color, 2.2);
}

/// Where he was seen last: box, velocity, name.
void draw_end(Canvas& canvas, const Plot& plot, const PaperPlane& plane, const MoverPosition& last,
              double cap) {
  const cv::Scalar color = color_of(last.id);
  const cv::Point2d at = plot(plane(last.centroid));
  draw_box(canvas, plot, plane, last.box, color);
  draw_arrow(canvas, at, plot(plane(last.centroid + last.velocity)), color);
  const std::string label = fmt::format("{} {}", last.id, last.class_name);
  const double width = Canvas::text_width(label, cap);
  const cv::Point2d text(std::min(at.x + 8, plot.area().br().x - width - 4),
                         std::max(at.y - 8, plot.area().y + 2 * cap));
  canvas.fill({text.x - 3, text.y - 1.3 * cap, width + 6, 1.7 * cap}, kPaper);
  canvas.text(label, text, cap, color);
}

void draw_cameras(Canvas& canvas, const Plot& plot, const PaperPlane& plane,
                  const Trajectory& cameras) {
  std::vector<cv::Point2d> path;
  for (const auto& [stamp, T] : cameras) path.push_back(plot(plane(T.translation())));
  canvas.polyline(path, kCameras, 2);
  if (cameras.empty()) return;
  const Pose& T = cameras.back().T_world_camera;
  for (const double side : {-0.54, 0.54}) {  // the picture's borders, 57 degrees apart
    const Eigen::Vector3d corner = T * (0.4 * Eigen::Vector3d(side, 0, 1));
    canvas.line(path.back(), plot(plane(corner)), kCameras, 1.4);
  }
}

}  // namespace

cv::Mat draw_movers(const std::vector<MoverPosition>& movers, const Trajectory& cameras,
                    const CloudSpan& cloud, int width) {
  constexpr double kLeft = 70, kRight = 16, kTop = 16, kBottom = 66, kCap = 10.5;
  const Ways ways = ways_of(movers);
  const Eigen::Vector3d up = up_axis(cameras);
  const PaperPlane plane = plane_from_above(up);
  const Floor floor = floor_of(cloud, cameras, plane, up);
  const auto [x, y] = extent_of(ways, cameras, floor, plane);
  const double plot_width = width - kLeft - kRight;
  const double plot_height =
      std::clamp(plot_width * y.size() / std::max(x.size(), 1e-3), 0.35 * width, 0.8 * width);
  const Plot plot({kLeft, kTop, plot_width, plot_height}, x, y);

  Canvas canvas(width, cvRound(kTop + plot_height + kBottom), kPaper, 2);
  draw_x_axis(canvas, plot, plane.right, kCap);
  draw_y_axis(canvas, plot, plane.up, kCap);
  cv::Mat3b ground = canvas.finished();
  draw_floor(ground, floor, plot);
  canvas.paste(ground);
  canvas.clip(plot.area());
  draw_cameras(canvas, plot, plane, cameras);
  for (const auto& [id, way] : ways) draw_way(canvas, plot, plane, way);
  for (const auto& [id, way] : ways) draw_end(canvas, plot, plane, way.back(), kCap);
  canvas.clip({});
  canvas.rectangle(plot.area(), kSoftInk, 1);
  return canvas.finished();
}

}  // namespace stillmap
