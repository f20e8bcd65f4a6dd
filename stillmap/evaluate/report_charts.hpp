// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/report.hpp"

#include <string>

/// The report's charts as inline SVG; empty text where there is nothing to show.
namespace stillmap {

/// The path from above, or from the side, both axes to one scale: against the truth and colored by
/// the error where there is a truth.
std::string trajectory_chart(const ReportData& data, bool from_above);

/// Which color stands for which error: the legend of both trajectory charts.
std::string error_color_bar(const ReportData& data);

/// Absolute error over time, with its RMSE and the events.
std::string error_chart(const ReportData& data);

/// Tracked and lost stretches, keyframes and events over time.
std::string coverage_strip(const ReportData& data);

/// One bar per stage: median, with the 95th percentile behind it.
std::string timing_chart(const ReportData& data);

}  // namespace stillmap
