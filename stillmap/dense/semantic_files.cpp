// SPDX-License-Identifier: Apache-2.0
#include "stillmap/dense/semantic_files.hpp"

#include "stillmap/base/bytes.hpp"
#include "stillmap/base/counted.hpp"
#include "stillmap/geometry/trimmed_box.hpp"

#include <algorithm>
#include <cmath>
#include <map>
#include <span>

#include <fmt/format.h>
#include <nlohmann/json.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

/// Returns the index of each object's class in class_colors(), by object id.
std::vector<std::size_t> labels_of(const SemanticMap& semantics,
                                   const std::vector<ClassColor>& classes) {
  std::vector<std::size_t> labels{classes.size()};
  for (const StaticObject& object : semantics.objects) {
    const auto found = std::find_if(classes.begin(), classes.end(), [&](const ClassColor& c) {
      return c.class_name == object.class_name;
    });
    labels.push_back(static_cast<std::size_t>(found - classes.begin()));
  }
  return labels;
}

constexpr std::size_t kLastLabel = 255;  // shared by all classes after the 254th

nlohmann::json triple(const Eigen::Vector3d& v) {
  const auto rounded = [](double x) { return std::round(x * 1e4) / 1e4; };  // a tenth of a mm
  return {rounded(v.x()), rounded(v.y()), rounded(v.z())};
}

}  // namespace

Rgb color_of_hue(double hue) {
  const auto channel = [&](double shift) {
    const double x = std::abs(std::fmod(hue + shift, 1.0) * 6 - 3) - 1;
    return static_cast<std::uint8_t>(40 + 215 * std::clamp(x, 0.0, 1.0));
  };
  return {channel(1), channel(2.0 / 3), channel(1.0 / 3)};
}

std::vector<ClassColor> class_colors(const SemanticMap& semantics) {
  std::map<std::string, ClassColor> classes;
  for (const StaticObject& object : semantics.objects) {
    ClassColor& entry = classes[object.class_name];
    entry.class_name = object.class_name;
    ++entry.objects;
    entry.points += object.points;
  }
  std::vector<ClassColor> list;
  for (const auto& [name, entry] : classes) {
    list.push_back(entry);
    list.back().color = color_of_hue(static_cast<double>(list.size() - 1) /
                                     static_cast<double>(std::max<std::size_t>(classes.size(), 1)));
  }
  return list;
}

std::vector<std::uint16_t> class_labels(const SemanticMap& semantics,
                                        const std::vector<ClassColor>& classes) {
  const std::vector<std::size_t> labels = labels_of(semantics, classes);
  std::vector<std::uint16_t> of_points;
  of_points.reserve(semantics.object.size());
  for (const std::uint16_t object : semantics.object)
    of_points.push_back(object > 0 ? static_cast<std::uint16_t>(labels[object] + 1) : 0);
  return of_points;
}

Cloud colored_by_class(const Cloud& cloud, const SemanticMap& semantics) {
  const std::vector<ClassColor> classes = class_colors(semantics);
  const std::vector<std::size_t> labels = labels_of(semantics, classes);
  Cloud colored = cloud;
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    const auto& [r, g, b] = cloud.colors[i];
    const auto gray = static_cast<std::uint8_t>((r + 2 * g + b) / 4);
    const std::size_t object = semantics.empty() ? 0 : semantics.object[i];
    colored.colors[i] = object > 0 ? classes[labels[object]].color : Rgb{gray, gray, gray};
  }
  return colored;
}

std::string semantic_ply(const Cloud& cloud, const SemanticMap& semantics) {
  const std::vector<ClassColor> classes = class_colors(semantics);
  const std::vector<std::size_t> labels = labels_of(semantics, classes);
  std::string header = "ply\nformat binary_little_endian 1.0\ncomment meters, world frame\n";
  for (std::size_t i = 0; i < classes.size(); ++i) {
    header += fmt::format("comment label {} {}\n", i + 1, classes[i].class_name);
  }
  header += fmt::format(
      "element vertex {}\nproperty float x\nproperty float y\nproperty float z\n"
      "property uchar red\nproperty uchar green\nproperty uchar blue\n"
      "property ushort object\nproperty uchar label\nproperty float confidence\nend_header\n",
      cloud.size());
  ByteWriter bytes;
  bytes.put_list(std::span<const char>(header));
  for (std::size_t i = 0; i < cloud.size(); ++i) {
    for (const float x : cloud.points[i]) bytes.put(x);
    bytes.put(cloud.colors[i]);
    const std::uint16_t object = semantics.empty() ? std::uint16_t{0} : semantics.object[i];
    bytes.put(object);
    bytes.put(static_cast<std::uint8_t>(object > 0 ? std::min(labels[object] + 1, kLastLabel) : 0));
    bytes.put(semantics.empty() ? 0.0F : semantics.confidence[i]);
  }
  return bytes.take();
}

cv::Mat legend_image(const std::vector<ClassColor>& classes) {
  constexpr int kLine = 30, kWidth = 420;
  const int lines = static_cast<int>(classes.size());
  cv::Mat image(std::max(1, lines) * kLine + 10, kWidth, CV_8UC3, cv::Scalar(34, 27, 22));
  for (int i = 0; i < lines; ++i) {
    const ClassColor& entry = classes[static_cast<std::size_t>(i)];
    const cv::Scalar color(entry.color[2], entry.color[1], entry.color[0]);
    cv::rectangle(image, cv::Rect(10, i * kLine + 10, 30, kLine - 10), color, cv::FILLED);
    cv::putText(image,
                fmt::format("{}: {}, {}", entry.class_name, counted(entry.objects, "object"),
                            counted(entry.points, "point")),
                {50, i * kLine + 26}, cv::FONT_HERSHEY_SIMPLEX, 0.5, cv::Scalar(230, 230, 230), 1,
                cv::LINE_AA);
  }
  return image;
}

nlohmann::json objects_json(const SemanticMap& semantics) {
  nlohmann::json list = nlohmann::json::array();
  for (const StaticObject& object : semantics.objects) {
    list.push_back(
        {{"id", object.id},
         {"class", object.class_name},
         {"confidence", std::round(object.confidence * 1e3) / 1e3},
         {"views", object.views},
         {"visible", object.visible},
         {"points", object.points},
         {"center", triple(object.center)},
         {"box", {{"min", triple(object.box.min())}, {"max", triple(object.box.max())}}}});
  }
  return {{"objects", list}};
}

void add_upright_boxes(const SemanticMap& semantics, const Cloud& cloud,
                       const Eigen::Matrix3d& R_upright_world, nlohmann::json& objects) {
  std::map<int, std::vector<Eigen::Vector3d>> points;  // by object, along the upright axes
  for (std::size_t i = 0; i < semantics.object.size(); ++i)
    points[semantics.object[i]].push_back(R_upright_world * cloud.points[i].cast<double>());
  for (nlohmann::json& object : objects["objects"]) {
    const auto& own = points[object["id"]];
    if (own.empty()) continue;
    const Eigen::AlignedBox3d box = trimmed_box(own, own.size() / 100);
    object["upright_box"] = {{"center", triple(R_upright_world.transpose() * box.center())},
                             {"size", triple(box.sizes())},
                             {"axes",
                              {triple(R_upright_world.row(0)), triple(R_upright_world.row(1)),
                               triple(R_upright_world.row(2))}}};
  }
}

}  // namespace stillmap
