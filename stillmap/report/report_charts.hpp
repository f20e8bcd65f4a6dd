// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/run_record.hpp"

#include <string>

/// Charts of the report page as inline SVG. Functions return empty text if there is no data.
namespace stillmap {

enum class PathView { kFromAbove, kFromTheSide };

/// Returns the trajectory with equal scale on both axes; with a truth it is colored by the error.
std::string trajectory_chart(const RunRecord& record, PathView view);

/// Returns the color scale of the error, the legend of the trajectory charts.
std::string error_color_bar(const RunRecord& record);

/// Returns the absolute error over time, with its RMSE and the events.
std::string error_chart(const RunRecord& record);

/// Returns the tracked and lost intervals, keyframes and events over time.
std::string coverage_strip(const RunRecord& record);

/// Returns one bar per stage: the median, with the 95th percentile behind it.
std::string timing_chart(const RunRecord& record);

}  // namespace stillmap
