// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/raster.hpp"

#include "stillmap/base/number.hpp"
#include "stillmap/report/svg.hpp"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <optional>
#include <string>

#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

constexpr int kScale = 2;  // factor by which the image is drawn larger before averaging
constexpr int kShift = 4;  // fractional bits of drawn coordinates
constexpr int kFont = cv::FONT_HERSHEY_SIMPLEX;
constexpr double kCapital = 0.72;  // height of a capital letter as a share of the font size

/// Returns the rules of a class of the style sheet: "stroke: #1f6fc2; fill: none".
std::string rules_of(std::string_view css_class) {
  static const std::string kSheet = light_chart_style();
  const std::string selector = "svg ." + std::string(css_class) + " {";
  const auto begin = kSheet.find(selector);
  if (begin == std::string::npos) return "";
  const auto first = begin + selector.size();
  return kSheet.substr(first, kSheet.find('}', first) - first);
}

/// Returns the value of a property in rules; none if they do not contain it.
std::optional<std::string> value_of(const std::string& rules, const std::string& property) {
  const std::string key = " " + property + ": ";
  const auto begin = rules.find(key);
  if (begin == std::string::npos) return std::nullopt;
  const auto first = begin + key.size();
  return rules.substr(first, rules.find(';', first) - first);
}

double number_of(const std::string& rules, const std::string& property, double otherwise) {
  const auto value = value_of(rules, property);
  const auto number = value ? leading_number(*value) : std::nullopt;  // a unit may follow it
  return number ? number->value : otherwise;
}

/// Returns the color "#rrggbb" of a property; none without one.
std::optional<cv::Scalar> color_of(const std::string& rules, const std::string& property) {
  const auto value = value_of(rules, property);
  if (!value || value->size() < 7 || value->front() != '#') return std::nullopt;
  const auto rgb = std::strtoul(value->substr(1, 6).c_str(), nullptr, 16);
  return cv::Scalar(static_cast<double>(rgb & 255), static_cast<double>(rgb >> 8 & 255),
                    static_cast<double>(rgb >> 16));
}

int thickness_of(const std::string& rules) {
  return std::max(1, static_cast<int>(std::lround(kScale * number_of(rules, "stroke-width", 1))));
}

/// How text of a class is written.
struct Lettering {
  double scale;
  int thickness;
  cv::Scalar color;
};

Lettering lettering_of(std::string_view css_class) {
  constexpr double kUsualSize = 13;  // of text without a size [pixels]
  const std::string rules = rules_of(css_class);
  const double size = number_of(rules, "font-size", kUsualSize);
  const bool bold = number_of(rules, "font-weight", 400) >= 600;
  const int thickness = bold ? kScale + 1 : kScale;
  const cv::Scalar soft = color_of(rules_of("reference"), "stroke").value_or(cv::Scalar());
  return {cv::getFontScaleFromHeight(kFont, cvRound(kScale * kCapital * size), thickness),
          thickness, color_of(rules, "fill").value_or(soft)};
}

std::string in_ascii(std::string_view text) {
  std::string ascii;
  for (const char c : text) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte >= 0x80 && byte < 0xc0) continue;  // a further byte of a UTF-8 character
    ascii += byte < 0x80 ? c : '?';
  }
  return ascii;
}

}  // namespace

Raster::Raster(double width, double height)
    : large_(cvRound(kScale * height), cvRound(kScale * width), CV_8UC3, cv::Scalar::all(255)),
      target_(large_) {}

cv::Point Raster::fixed(const Eigen::Vector2d& point) const {
  constexpr double kUnit = kScale * (1 << kShift);
  return cv::Point(cvRound(kUnit * point.x()), cvRound(kUnit * point.y())) -
         offset_ * (1 << kShift);
}

void Raster::line(const Eigen::Vector2d& from, const Eigen::Vector2d& to,
                  std::string_view css_class) {
  const std::string rules = rules_of(css_class);
  if (const auto color = color_of(rules, "stroke"))
    cv::line(target_, fixed(from), fixed(to), *color, thickness_of(rules), cv::LINE_AA, kShift);
}

void Raster::polyline(std::span<const Eigen::Vector2d> points, std::string_view css_class) {
  for (std::size_t i = 1; i < points.size(); ++i) line(points[i - 1], points[i], css_class);
}

void Raster::rectangle(double x, double y, double width, double height,
                       std::string_view css_class) {
  const std::string rules = rules_of(css_class);
  const cv::Point low = fixed({x, y}), high = fixed({x + width, y + height});
  if (const auto fill = color_of(rules, "fill"))
    cv::rectangle(target_, low, high, *fill, cv::FILLED, cv::LINE_AA, kShift);
  if (const auto stroke = color_of(rules, "stroke"))
    cv::rectangle(target_, low, high, *stroke, thickness_of(rules), cv::LINE_AA, kShift);
}

void Raster::text(const Eigen::Vector2d& at, std::string_view content, std::string_view anchor,
                  std::string_view css_class) {
  const Lettering lettering = lettering_of(css_class);
  const std::string ascii = in_ascii(content);
  int below = 0;
  const cv::Size size = cv::getTextSize(ascii, kFont, lettering.scale, lettering.thickness, &below);
  const double share = anchor == "middle" ? 0.5 : anchor == "end" ? 1 : 0;
  const cv::Point left =
      cv::Point(cvRound(kScale * at.x() - share * size.width), cvRound(kScale * at.y())) - offset_;
  cv::putText(target_, ascii, left, kFont, lettering.scale, lettering.color, lettering.thickness,
              cv::LINE_AA);
}

void Raster::text_upwards(const Eigen::Vector2d& at, std::string_view content) {
  const Lettering lettering = lettering_of("label");
  const std::string ascii = in_ascii(content);
  int below = 0;
  const cv::Size size = cv::getTextSize(ascii, kFont, lettering.scale, lettering.thickness, &below);
  cv::Mat label(size.height + below, size.width, CV_8UC3, cv::Scalar::all(255));
  cv::putText(label, ascii, {0, size.height}, kFont, lettering.scale, lettering.color,
              lettering.thickness, cv::LINE_AA);
  cv::rotate(label, label, cv::ROTATE_90_COUNTERCLOCKWISE);
  const cv::Rect wanted(cvRound(kScale * at.x()) - size.height - offset_.x,
                        cvRound(kScale * at.y()) - label.rows / 2 - offset_.y, label.cols,
                        label.rows);
  const cv::Rect inside = wanted & cv::Rect({0, 0}, target_.size());
  if (inside.empty()) return;
  label(inside - wanted.tl()).copyTo(target_(inside));
}

void Raster::begin_clip(double x, double y, double width, double height) {
  const cv::Rect wanted(cvRound(kScale * x), cvRound(kScale * y), cvRound(kScale * width),
                        cvRound(kScale * height));
  const cv::Rect inside = wanted & cv::Rect({0, 0}, large_.size());
  target_ = large_(inside);
  offset_ = inside.tl();
}

void Raster::end_clip() {
  target_ = large_;
  offset_ = {0, 0};
}

cv::Mat Raster::image() const {
  cv::Mat small;
  cv::resize(large_, small, {}, 1.0 / kScale, 1.0 / kScale, cv::INTER_AREA);
  return small;
}

}  // namespace stillmap
