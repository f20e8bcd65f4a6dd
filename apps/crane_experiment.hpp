// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/report/result_folder.hpp"

#include <string>
#include <vector>

#include "preset_runs.hpp"

namespace stillmap {

/// Returns the names of the files that reproduce_crane() writes.
std::vector<std::string> crane_files();

/// Repeats the crane experiment of SLAM3-YOLOv8 (section 4.5) in the simulated yard, without and
/// with moving objects: prints and writes the closure errors and the figure of the trajectories.
/// Uses yard_static and yard_dynamic of the data folder, and renders them if it does not have them.
/// Returns the problems of the runs.
std::vector<std::string> reproduce_crane(const ReproduceArguments& arguments, ResultFolder& folder);

}  // namespace stillmap
