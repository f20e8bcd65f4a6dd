// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/evaluate/paper_tables.hpp"

#include <span>

namespace stillmap {

/// Returns the closure errors of the crane experiment, one row per sequence and system in the order
/// of the runs: means over the runs of a system, and the improvement over the reference. A note
/// below says what the paper reports.
FigureTable crane_table(const Paper& paper, std::span<const PaperRun> runs,
                        const std::string& reference = kPaperBaseline);

}  // namespace stillmap
