// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/compare.hpp"
#include "stillmap/report/captioned_image.hpp"
#include "stillmap/report/svg.hpp"

#include <string>
#include <vector>

namespace stillmap {

/// Draws the distribution of the absolute error of each run as a box plot (box: quartiles; line:
/// median; whiskers: 5 % and 95 % quantiles), and the error over time below, on logarithmic axes.
/// Time begins with the first evaluated pose of any run of the sequence.
/// @param width  width of the drawing [pixels]; narrow ones have the names above the boxes
Svg error_distribution_chart(const Comparison& comparison, double width = 1000);

/// Returns the tables and charts of a comparison as one self-contained HTML page.
/// @param files  names of the files beside the page, to which it links
/// @param maps   images of the maps of runs
std::string comparison_page(const Comparison& comparison, const std::vector<std::string>& files,
                            const std::vector<CaptionedImage>& maps = {});

}  // namespace stillmap
