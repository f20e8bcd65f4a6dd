// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/compare.hpp"
#include "stillmap/report/svg.hpp"

namespace stillmap {

/// Draws the path of each run (blue) and the truth (gray) from above, with red lines between
/// corresponding points, as in figure 5 of SLAM3-YOLOv8; one panel per run. Throws Error without a
/// run.
Svg comparison_chart(const Comparison& comparison);

/// Draws the same for one run, small and without legend, for a page that may be narrow.
Svg run_paths_chart(const ComparedRun& run);

}  // namespace stillmap
