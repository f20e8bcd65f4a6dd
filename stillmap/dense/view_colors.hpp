// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/dense/semantic_map.hpp"

#include <vector>

#include <Eigen/Core>

namespace stillmap {

/// Returns the factors of the colors of each view, R G B, that undo automatic exposure and white
/// balance: by least squares over the logarithms of the colors that several views give the same
/// point, with outliers weighted down. The product over the views that overlap is 1.
/// @param points  on the static surface, world frame [m]; some ten thousand of them are used
std::vector<Eigen::Vector3f> color_gains(const std::vector<Eigen::Vector3f>& points,
                                         const std::vector<PosedView>& views);

/// Where the colors of views are taken from.
enum class ColorSource { kView, kPhoto };

/// Returns the colors of points of the static surface: the means of the views that see them,
/// interpolated between pixels, where near views count most. A point that is in no image is black.
/// @param points  world frame [m]
/// @param gains   of the views, by color_gains()
/// @param source  pixels of the views, or those of their photos, as far as there are some
std::vector<Rgb> surface_colors(const std::vector<Eigen::Vector3f>& points,
                                const std::vector<PosedView>& views,
                                const std::vector<Eigen::Vector3f>& gains,
                                ColorSource source = ColorSource::kView);

}  // namespace stillmap
