// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/canvas.hpp"

#include <algorithm>
#include <cmath>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapHeight = 21;  // of the font at scale 1 [pixels]
constexpr int kShift = 4;          // fractional bits of OpenCV's drawing coordinates
constexpr double kStroke = 0.105;  // of the capitals' height: the weight of a book face
constexpr double kBoldStroke = 0.17;

double stroke(double height, bool bold) { return height * (bold ? kBoldStroke : kStroke); }

}  // namespace

Canvas::Canvas(int width, int height, const cv::Scalar& background, int supersampling)
    : scale_(supersampling),
      image_(height * supersampling, width * supersampling, CV_8UC3, background),
      target_(image_) {}

cv::Point Canvas::fixed(cv::Point2d p) const {
  const double factor = scale_ * (1 << kShift);
  const auto coordinate =
      [factor](double x) {  // far outside the picture, but within OpenCV's integers
        return cvRound(std::clamp(x * factor, -1e7, 1e7));
      };
  return {coordinate(p.x - origin_.x), coordinate(p.y - origin_.y)};
}

void Canvas::line(cv::Point2d from, cv::Point2d to, const cv::Scalar& color, double thickness) {
  cv::line(target_, fixed(from), fixed(to), color, std::max(1, cvRound(thickness * scale_)),
           cv::LINE_AA, kShift);
}

void Canvas::polyline(std::span<const cv::Point2d> points, const cv::Scalar& color,
                      double thickness) {
  std::vector<cv::Point> path(points.size());
  std::transform(points.begin(), points.end(), path.begin(),
                 [this](const cv::Point2d& p) { return fixed(p); });
  cv::polylines(target_, path, false, color, std::max(1, cvRound(thickness * scale_)), cv::LINE_AA,
                kShift);
}

void Canvas::rectangle(cv::Rect2d area, const cv::Scalar& color, double thickness) {
  const cv::Point2d a = area.tl(), c = area.br(), b(c.x, a.y), d(a.x, c.y);
  polyline(std::vector{a, b, c, d, a}, color, thickness);
}

void Canvas::fill(cv::Rect2d area, const cv::Scalar& color) {
  cv::rectangle(target_, fixed(area.tl()), fixed(area.br()), color, cv::FILLED, cv::LINE_AA,
                kShift);
}

void Canvas::paste(const cv::Mat& picture) {
  cv::resize(picture, image_, image_.size(), 0, 0, cv::INTER_NEAREST);
}

void Canvas::disc(cv::Point2d center, double radius, const cv::Scalar& color) {
  cv::circle(target_, fixed(center), cvRound(radius * scale_ * (1 << kShift)), color, cv::FILLED,
             cv::LINE_AA, kShift);
}

double Canvas::text_width(const std::string& text, double height, bool bold) {
  constexpr double kFine = 16;  // measured large: OpenCV rounds to pixels
  int baseline = 0;
  const cv::Size size = cv::getTextSize(text, kFont, kFine * height / kCapHeight, 1, &baseline);
  return size.width / kFine + stroke(height, bold);
}

void Canvas::text(const std::string& text, cv::Point2d at, double height, const cv::Scalar& color,
                  Anchor anchor, bool bold) {
  const double width = text_width(text, height, bold);
  if (anchor == Anchor::kCenter) at.x -= width / 2;
  if (anchor == Anchor::kRight) at.x -= width;
  const cv::Point pixel(cvRound((at.x - origin_.x) * scale_), cvRound((at.y - origin_.y) * scale_));
  cv::putText(target_, text, pixel, kFont, height * scale_ / kCapHeight, color,
              std::max(1, cvRound(stroke(height, bold) * scale_)), cv::LINE_AA);
}

void Canvas::text_upwards(const std::string& text, cv::Point2d at, double height,
                          const cv::Scalar& color) {
  const int length = static_cast<int>(std::ceil(text_width(text, height))) + 4;
  const int breadth = static_cast<int>(std::ceil(2 * height));
  // Drawn as coverage on a strip of its own, turned, then blended over what is there.
  Canvas strip(length, breadth, cv::Scalar::all(0), scale_);
  strip.text(text, {2.0, 1.4 * height}, height, cv::Scalar::all(255));
  cv::Mat turned;
  cv::rotate(strip.image_, turned, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Point corner(cvRound((at.x - origin_.x - 1.4 * height) * scale_),
                         cvRound((at.y - origin_.y) * scale_) - turned.rows / 2);
  const cv::Rect wanted(corner, turned.size());
  const cv::Rect visible = wanted & cv::Rect({}, target_.size());
  if (visible.empty()) return;
  cv::Mat part = target_(visible);
  const cv::Mat weight = turned(visible - corner);
  const cv::Mat ink(part.size(), CV_8UC3, color);
  cv::Mat from_ink, from_paper;
  cv::multiply(ink, weight, from_ink, 1.0 / 255);
  cv::multiply(part, cv::Scalar::all(255) - weight, from_paper, 1.0 / 255);
  part = from_ink + from_paper;
}

void Canvas::clip(cv::Rect2d area) {
  if (area.empty()) {
    origin_ = {};
    target_ = image_;
    return;
  }
  const cv::Rect pixels(cvRound(area.x * scale_), cvRound(area.y * scale_),
                        cvRound(area.width * scale_), cvRound(area.height * scale_));
  const cv::Rect visible = pixels & cv::Rect({}, image_.size());
  origin_ = cv::Point2d(visible.tl()) / static_cast<double>(scale_);
  target_ = image_(visible);
}

cv::Mat Canvas::finished() const {
  cv::Mat small;
  cv::resize(image_, small, {}, 1.0 / scale_, 1.0 / scale_, cv::INTER_AREA);
  return small;
}

}  // namespace stillmap
