// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/semantic_map.hpp"
#include "stillmap/optimize/depth_error_fit.hpp"

#include <optional>
#include <span>

namespace stillmap {

/// Returns the depths of a view, DenseView::depth, without the error of the sensor.
cv::Mat1w without_error(const cv::Mat1w& depth, const SmoothDepthError& error);

/// Returns the error that surfaces show which views see in different parts of their images: see
/// fit_depth_error().
std::optional<SmoothDepthError> depth_error_of(std::span<const PosedView> views);

}  // namespace stillmap
