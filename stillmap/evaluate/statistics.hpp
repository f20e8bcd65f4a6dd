// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/statistics.hpp"

#include <cstddef>
#include <span>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Summary statistics of a set of errors, in the unit of the errors; all zero for an empty set.
struct Statistics {
  double rmse = 0;
  double mean = 0;
  double median = 0;  ///< Median; the mean of the middle two if the count is even.
  double sd = 0;      ///< Population standard deviation (division by count).
  double min = 0;
  double max = 0;
  std::size_t count = 0;
};

Statistics compute_statistics(std::span<const double> errors);

/// Writes rmse, mean, median, sd, min, max and count (for nlohmann::json).
void to_json(nlohmann::json& json, const Statistics& statistics);

}  // namespace stillmap
