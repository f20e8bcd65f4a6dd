// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/mover_image.hpp"

#include "stillmap/evaluate/statistics.hpp"
#include "stillmap/report/chart.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include <fmt/format.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

const cv::Scalar kWhite(255, 255, 255), kInk(110, 102, 96), kCameras(150, 140, 130);
constexpr double kHeadroom = 0.3;  // points shown above the highest camera [m]
constexpr double kPale = 0.45;     // remaining share of the cloud's colors
constexpr int kScale = 2;          // factor by which the image is drawn larger before averaging

/// Colors for a white background that color-blind readers can distinguish (after Okabe and Ito,
/// Color Universal Design, 2008). They are assigned in order, so that the first ten movers differ.
cv::Scalar color_of(std::size_t mover) {
  static const std::array<cv::Scalar, 10> kColors{
      cv::Scalar(178, 114, 0),  cv::Scalar(0, 94, 213),   cv::Scalar(115, 158, 0),
      cv::Scalar(0, 140, 200),  cv::Scalar(167, 80, 190), cv::Scalar(60, 40, 40),
      cv::Scalar(200, 160, 30), cv::Scalar(30, 60, 130),  cv::Scalar(140, 40, 90),
      cv::Scalar(60, 200, 150)};
  return kColors[mover % kColors.size()];
}

/// Points of the cloud that are not higher than the cameras.
struct FloorPoints {
  std::vector<Eigen::Vector2d> at;  // in the plane of the drawing [m]
  std::vector<double> height;       // [m]
  std::vector<std::array<std::uint8_t, 3>> colors;
};

FloorPoints floor_of(const CloudSpan& cloud, const Trajectory& cameras,
                     const ProjectionPlane& plane, const Eigen::Vector3d& up) {
  double highest = -std::numeric_limits<double>::infinity();
  for (const auto& [stamp, T] : cameras) highest = std::max(highest, up.dot(T.translation()));
  FloorPoints floor;
  for (std::size_t i = 0; i < cloud.points.size(); ++i) {
    const Eigen::Vector3d p = cloud.points[i].cast<double>();
    if (!p.allFinite() || up.dot(p) > highest + kHeadroom) continue;
    floor.at.push_back(plane(p));
    floor.height.push_back(up.dot(p));
    floor.colors.push_back(cloud.colors[i]);
  }
  return floor;
}

/// Returns the ranges of the drawing [m], which include everything drawn for movers and cameras,
/// and nearly all of the cloud.
std::array<ValueRange, 2> extent_of(const std::vector<MoverTrack>& movers,
                                    const Trajectory& cameras, const FloorPoints& floor,
                                    const ProjectionPlane& plane) {
  std::array<ValueRange, 2> extent;
  const auto include = [&](const Eigen::Vector2d& p) {
    extent[0].include(p.x());
    extent[1].include(p.y());
  };
  for (const MoverTrack& mover : movers) {
    for (const MoverSample& sample : mover.samples) include(plane(sample.centroid));
    if (mover.samples.empty()) continue;
    const MoverSample& last = mover.samples.back();
    include(plane(last.centroid + last.velocity));
    if (last.box.isEmpty()) continue;
    include(plane(last.box.min()));
    include(plane(last.box.max()));
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

/// Drawing of the world from above. Sizes are in pixels of the final image.
class Overhead {
 public:
  Overhead(const ProjectionPlane& plane, const std::array<ValueRange, 2>& extent, int width)
      : plane_(plane) {
    const double height = std::clamp(width * extent[1].size() / std::max(extent[0].size(), 1e-3),
                                     0.35 * width, 0.8 * width);
    area_ = {0, 0, static_cast<double>(width), std::round(height), extent[0], extent[1]};
    area_.fit_equal_scale();
    image_ = cv::Mat3b(cvRound(area_.height) * kScale, width * kScale, cv::Vec3b(255, 255, 255));
  }

  /// Draws the highest point of every pixel, pale; each point covers two by two pixels.
  void draw(const FloorPoints& floor) {
    const cv::Size size(cvRound(area_.width), cvRound(area_.height));
    cv::Mat1f highest(size, -std::numeric_limits<float>::infinity());
    cv::Mat3b small(size, cv::Vec3b(255, 255, 255));
    for (std::size_t i = 0; i < floor.at.size(); ++i) {
      const Eigen::Vector2d at = area_.pixel(floor.at[i]);
      const auto& [red, green, blue] = floor.colors[i];
      const auto height = static_cast<float>(floor.height[i]);
      for (const cv::Point offset :
           {cv::Point(0, 0), cv::Point(1, 0), cv::Point(0, 1), cv::Point(1, 1)}) {
        const cv::Point pixel = cv::Point(cvFloor(at.x()), cvFloor(at.y())) + offset;
        if (!cv::Rect({}, size).contains(pixel) || highest(pixel) >= height) continue;
        highest(pixel) = height;
        small(pixel) = kPale * cv::Vec3d(blue, green, red) + (1 - kPale) * cv::Vec3d(255, 255, 255);
      }
    }
    cv::resize(small, image_, image_.size(), 0, 0, cv::INTER_NEAREST);
  }

  void draw_cameras(const Trajectory& cameras) {
    for (std::size_t i = 1; i < cameras.size(); ++i)
      line(cameras[i - 1].T_world_camera.translation(), cameras[i].T_world_camera.translation(),
           kCameras, 2);
    if (cameras.empty()) return;
    const Pose& T = cameras.back().T_world_camera;
    for (const double side : {-0.54, 0.54})  // tangents of the image borders, 57 degrees apart
      line(T.translation(), T * (0.4 * Eigen::Vector3d(side, 0, 1)), kCameras, 1.4);
  }

  void draw_path(const MoverTrack& mover, const cv::Scalar& color) {
    constexpr std::size_t kDots = 3;  // number of frames from one dot to the next
    const std::vector<MoverSample>& path = mover.samples;
    for (std::size_t i = 1; i < path.size(); ++i) {
      if (path[i].observed) line(path[i - 1].centroid, path[i].centroid, color, 2.2);
      if (!path[i].observed && i % kDots == 0) disc(path[i].centroid, 1.6, color);
    }
    disc(path.front().centroid, 4.5, color);
  }

  /// Draws box, velocity and label at the last position.
  void draw_end(const MoverTrack& mover, const cv::Scalar& color) {
    const MoverSample& last = mover.samples.back();
    if (!last.box.isEmpty()) {
      cv::rectangle(image_, fixed(pixel(last.box.min())), fixed(pixel(last.box.max())), color,
                    stroke(1.6), cv::LINE_AA, kShift);
    }
    const cv::Point2d from = pixel(last.centroid), to = pixel(last.centroid + last.velocity);
    constexpr double kHead = 7;  // length of the arrow head [pixels]
    if (const double length = cv::norm(to - from); length > kHead)
      cv::arrowedLine(image_, fixed(from), fixed(to), color, stroke(2.2), cv::LINE_AA, kShift,
                      kHead / length);
    label(fmt::format("{} {}", mover.id, mover.class_name), from + cv::Point2d(8, -8), color);
  }

  /// Draws a scale bar of a round length in the lower left corner.
  void draw_scale() {
    const double length = nice_ticks({0, area_.x.size() / 5}, 3).back();  // [m]
    const cv::Point2d from(16, area_.height - 14);
    const cv::Point2d to = from + cv::Point2d(length * area_.width / area_.x.size(), 0);
    cv::line(image_, fixed(from), fixed(to), kInk, stroke(3), cv::LINE_AA, kShift);
    label(fmt::format("{:g} m", length), from + cv::Point2d(0, -10), kInk);
  }

  cv::Mat finished() const {
    cv::Mat image;
    cv::resize(image_, image, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
    return image;
  }

 private:
  static constexpr int kShift = 4;  // fractional bits of OpenCV's drawing coordinates

  cv::Point2d pixel(const Eigen::Vector3d& p) const {
    const Eigen::Vector2d at = area_.pixel(plane_(p));
    return {at.x(), at.y()};
  }
  static cv::Point fixed(const cv::Point2d& p) {
    const double factor = kScale * (1 << kShift);
    return {cvRound(std::clamp(p.x * factor, -1e7, 1e7)),
            cvRound(std::clamp(p.y * factor, -1e7, 1e7))};
  }
  static int stroke(double width) { return cvRound(width * kScale); }

  void line(const Eigen::Vector3d& from, const Eigen::Vector3d& to, const cv::Scalar& color,
            double width) {
    cv::line(image_, fixed(pixel(from)), fixed(pixel(to)), color, stroke(width), cv::LINE_AA,
             kShift);
  }
  void disc(const Eigen::Vector3d& center, double radius, const cv::Scalar& color) {
    cv::circle(image_, fixed(pixel(center)), cvRound(radius * kScale * (1 << kShift)), color,
               cv::FILLED, cv::LINE_AA, kShift);
  }

  /// Draws text on white, moved into the image. @param at  left end of the baseline [pixels]
  void label(const std::string& text, cv::Point2d at, const cv::Scalar& color) {
    constexpr double kSize = 0.5 * kScale;
    int below = 0;
    const cv::Size size = cv::getTextSize(text, cv::FONT_HERSHEY_SIMPLEX, kSize, kScale, &below);
    cv::Point corner(cvRound(at.x * kScale), cvRound(at.y * kScale));
    corner.x = std::clamp(corner.x, 0, std::max(0, image_.cols - size.width - 4));
    corner.y = std::clamp(corner.y, size.height + 4, image_.rows - below);
    cv::rectangle(image_,
                  {corner.x - 4, corner.y - size.height - 4, size.width + 8, size.height + below},
                  kWhite, cv::FILLED);
    cv::putText(image_, text, corner, cv::FONT_HERSHEY_SIMPLEX, kSize, color, kScale, cv::LINE_AA);
  }

  ProjectionPlane plane_;
  ChartArea area_;
  cv::Mat3b image_;
};

}  // namespace

cv::Mat draw_movers(const std::vector<MoverTrack>& movers, const Trajectory& cameras,
                    const CloudSpan& cloud, int width) {
  const Eigen::Vector3d up = up_axis(cameras);
  const ProjectionPlane plane = plane_from_above(up);
  const FloorPoints floor = floor_of(cloud, cameras, plane, up);
  Overhead drawing(plane, extent_of(movers, cameras, floor, plane), width);
  drawing.draw(floor);
  drawing.draw_cameras(cameras);
  for (std::size_t i = 0; i < movers.size(); ++i) {
    if (!movers[i].samples.empty()) drawing.draw_path(movers[i], color_of(i));
  }
  for (std::size_t i = 0; i < movers.size(); ++i) {
    if (!movers[i].samples.empty()) drawing.draw_end(movers[i], color_of(i));
  }
  drawing.draw_scale();
  return drawing.finished();
}

}  // namespace stillmap
