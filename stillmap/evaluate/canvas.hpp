// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <span>
#include <string>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Where a text's anchor lies on it.
enum class Anchor { kLeft, kCenter, kRight };

/// A picture drawn larger than wanted and averaged at the end, which is what makes OpenCV's lines
/// and strokes look printed. Coordinates and sizes are pixels of the finished picture; colors B G
/// R.
class Canvas {
 public:
  Canvas(int width, int height, const cv::Scalar& background, int supersampling = 4);

  void line(cv::Point2d from, cv::Point2d to, const cv::Scalar& color, double thickness);
  void polyline(std::span<const cv::Point2d> points, const cv::Scalar& color, double thickness);
  void rectangle(cv::Rect2d area, const cv::Scalar& color, double thickness);
  void fill(cv::Rect2d area, const cv::Scalar& color);
  /// Covers everything with a picture of the finished size, 8UC3.
  void paste(const cv::Mat& picture);
  void disc(cv::Point2d center, double radius, const cv::Scalar& color);

  /// Text whose capitals are `height` tall. @param at on the base line
  void text(const std::string& text, cv::Point2d at, double height, const cv::Scalar& color,
            Anchor anchor = Anchor::kLeft, bool bold = false);
  /// The same, read from bottom to top. @param at middle of the text, on the base line
  void text_upwards(const std::string& text, cv::Point2d at, double height,
                    const cv::Scalar& color);
  static double text_width(const std::string& text, double height, bool bold = false);

  /// Drawing is confined to this area until the next call; an empty one lifts the limit.
  void clip(cv::Rect2d area);

  /// The picture at its finished size, 8UC3.
  cv::Mat finished() const;

 private:
  cv::Point fixed(cv::Point2d p) const;

  int scale_;
  cv::Mat image_;   // width * scale x height * scale
  cv::Mat target_;  // the part drawn to, a view of image_
  cv::Point2d origin_;
};

}  // namespace stillmap
