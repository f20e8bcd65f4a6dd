// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/slam.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// Writes the folder of results that `stillmap run --out` writes: trajectory.txt,
/// trajectory_covariance.txt, keyframes.txt, frames.csv, the files of moving objects and of the
/// dense map, timing.txt, summary.json and report.html (the latter without example frames); see
/// docs/dense_map.md. The folder is created if it does not exist. Files of an earlier run in it are
/// replaced or removed.
/// @param results  of Slam::finish()
/// @param title    heading of the report; empty for the name of the folder
/// @returns the files written
/// Throws Error for results that Slam::finish() did not return, if a file cannot be written, or if
/// that would overwrite a file which Stillmap did not write.
std::vector<std::filesystem::path> write_results(const Results& results,
                                                 const std::filesystem::path& folder,
                                                 const std::string& title = {});

}  // namespace stillmap
