// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/statistics.hpp"
#include "stillmap/evaluate.hpp"

#include <span>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

Statistics compute_statistics(std::span<const double> errors);

/// Writes rmse, mean, median, sd, min, max and count (for nlohmann::json).
void to_json(nlohmann::json& json, const Statistics& statistics);

}  // namespace stillmap
