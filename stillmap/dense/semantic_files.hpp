// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/semantic_map.hpp"

#include <cstddef>
#include <cstdint>
#include <string>
#include <vector>

#include <nlohmann/json_fwd.hpp>
#include <opencv2/core.hpp>

namespace stillmap {

/// A class in the map with its color.
struct ClassColor {
  std::string class_name;
  Rgb color = {};
  std::size_t objects = 0, points = 0;
};

/// Returns the color of a hue [0..1): red, green and blue at 0, 1/3 and 2/3.
Rgb color_of_hue(double hue);

/// Returns the classes of a map by name, in evenly spaced hues.
std::vector<ClassColor> class_colors(const SemanticMap& semantics);

/// Returns the class of each point of a map, 1, 2, 3 ... as in class_colors(), 0 for none; empty
/// for an empty map.
std::vector<std::uint16_t> class_labels(const SemanticMap& semantics,
                                        const std::vector<ClassColor>& classes);

/// Returns the cloud in the colors of its classes; points without a class are gray.
Cloud colored_by_class(const Cloud& cloud, const SemanticMap& semantics);

/// Returns the cloud as PLY with, per vertex and after x y z red green blue: ushort object (id in
/// objects.json, 0 for none), uchar label (0 for none) and float confidence. Comments in the header
/// name the labels: `comment label 3 tv`. All classes after the 254th have label 255.
std::string semantic_ply(const Cloud& cloud, const SemanticMap& semantics);

/// Returns an image of the colors and names of the classes.
cv::Mat legend_image(const std::vector<ClassColor>& classes);

/// Returns the objects: {"objects": [{"id", "class", "confidence", "views", "visible", "points",
/// "center", "box": {"min", "max"}}]}, meters, world frame.
nlohmann::json objects_json(const SemanticMap& semantics);

/// Adds "upright_box" to each object of objects_json(): {"center", "size", "axes"}, meters: the
/// extent of its points, without the outermost 1 % on each side, along axes of which the last one
/// points upwards. Center and axes in the world frame.
void add_upright_boxes(const SemanticMap& semantics, const Cloud& cloud,
                       const Eigen::Matrix3d& R_upright_world, nlohmann::json& objects);

}  // namespace stillmap
