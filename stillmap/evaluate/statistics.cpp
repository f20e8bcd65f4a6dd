// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/statistics.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include <nlohmann/json.hpp>

namespace stillmap {

double quantile(std::span<const double> values, double q) {
  if (values.empty()) return 0;
  std::vector<double> parted(values.begin(), values.end());
  const double position = std::clamp(q, 0.0, 1.0) * static_cast<double>(parted.size() - 1);
  const double below = std::floor(position);
  const auto nth = parted.begin() + static_cast<std::ptrdiff_t>(below);
  std::nth_element(parted.begin(), nth, parted.end());
  if (position == below) return *nth;
  const double next = *std::min_element(nth + 1, parted.end());
  return std::lerp(*nth, next, position - below);
}

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
