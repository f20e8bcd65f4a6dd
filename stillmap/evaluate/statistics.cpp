// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/statistics.hpp"

#include <algorithm>
#include <cmath>

#include <nlohmann/json.hpp>

namespace stillmap {

Statistics compute_statistics(std::span<const double> errors) {
  if (errors.empty()) return {};
  const auto n = static_cast<double>(errors.size());
  double sum = 0, sum_of_squares = 0, sum_of_deviations = 0;
  for (const double e : errors) {
    sum += e;
    sum_of_squares += e * e;
  }
  for (const double e : errors) sum_of_deviations += (e - sum / n) * (e - sum / n);
  return {.rmse = std::sqrt(sum_of_squares / n),
          .mean = sum / n,
          .median = quantile(errors, 0.5),
          .sd = std::sqrt(sum_of_deviations / n),
          .min = *std::min_element(errors.begin(), errors.end()),
          .max = *std::max_element(errors.begin(), errors.end()),
          .count = errors.size()};
}

void to_json(nlohmann::json& json, const Statistics& statistics) {
  json = {{"rmse", statistics.rmse},  {"mean", statistics.mean}, {"median", statistics.median},
          {"sd", statistics.sd},      {"min", statistics.min},   {"max", statistics.max},
          {"count", statistics.count}};
}

}  // namespace stillmap
