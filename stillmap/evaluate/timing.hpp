// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stage_times.hpp"

#include <span>
#include <string>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Returns a text table with one line per stage and columns count, median, p95, p99, max [ms] and
/// total [s].
std::string timing_text(std::span<const StageTiming> stages);

void to_json(nlohmann::json& json, const StageTiming& timing);

}  // namespace stillmap
