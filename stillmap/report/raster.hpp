// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/canvas.hpp"

#include <opencv2/core.hpp>

namespace stillmap {

/// A drawing as pixels on white, in the light colors of the style sheet. Text is limited to ASCII;
/// other characters become question marks.
class Raster : public Canvas {
 public:
  /// Size of the image [pixels].
  Raster(double width, double height);

  void line(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
            std::string_view css_class) override;
  void polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class) override;
  void rectangle(double x, double y, double width, double height,
                 std::string_view css_class) override;
  using Canvas::text;
  void text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor,
            std::string_view css_class) override;
  void text_upwards(const Eigen::Vector2d& at, std::string_view content) override;
  void begin_clip(double x, double y, double width, double height) override;
  void end_clip() override;

  /// Returns the drawing, 8UC3 BGR.
  cv::Mat image() const;

 private:
  cv::Point fixed(const Eigen::Vector2d& point) const;

  cv::Mat large_;   // the image, kScale times as large
  cv::Mat target_;  // the part of it that is drawn on
  cv::Point offset_{0, 0};
};

}  // namespace stillmap
