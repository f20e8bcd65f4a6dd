// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/run_record.hpp"

#include <string>

/// The charts of the report page as inline SVG; empty text where there is no data.
namespace stillmap {

enum class PathView { kFromAbove, kFromTheSide };

/// The trajectory in equal scale on both axes; with a truth: against it, colored by the error.
std::string trajectory_chart(const RunRecord& record, PathView view);

/// The color scale of the error, legend of the trajectory charts.
std::string error_color_bar(const RunRecord& record);

/// Absolute error over time, with its RMSE and the events.
std::string error_chart(const RunRecord& record);

/// Tracked and lost intervals, keyframes and events over time.
std::string coverage_strip(const RunRecord& record);

/// One bar per stage: median, with the 95th percentile behind it.
std::string timing_chart(const RunRecord& record);

}  // namespace stillmap
