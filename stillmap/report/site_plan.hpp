// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/floor.hpp"
#include "stillmap/pipeline/site_frame.hpp"

#include <filesystem>
#include <vector>

#include <opencv2/core.hpp>

namespace stillmap {

/// Reads the image of a floor plan, PNG, JPEG or TIFF, as 8UC3 BGR. Throws Error if it is none.
cv::Mat3b read_plan_image(const std::filesystem::path& file);

/// Draws the surfaces between 0.3 m and 2 m above the floor, such as walls, onto the image of a
/// plan. What lies beyond its borders is left out.
/// @param surfels  of the map that is aligned with the plan
void draw_on_plan(const std::vector<Surfel>& surfels, const SitePlan& plan, cv::Mat3b& image);

}  // namespace stillmap
