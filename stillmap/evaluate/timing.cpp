// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/timing.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
std::string timing_text(std::span<const StageTiming> stages) {
  std::size_t width = 5;
  for (const StageTiming& stage : stages) width = std::max(width, stage.name.size());
  std::string text = fmt::format("{:<{}}{:>9}{:>11}{:>11}{:>11}{:>11}{:>11}\n", "stage", width,
                                 "count", "median ms", "p95 ms", "p99 ms", "max ms", "total s");
  for (const StageTiming& s : stages) {
    text += fmt::format("{:<{}}{:>9}{:>11.2f}{:>11.2f}{:>11.2f}{:>11.2f}{:>11.2f}\n", s.name, width,
                        s.count, s.median, s.p95, s.p99, s.max, s.total / 1000);
  }
  return text;
}

void to_json(nlohmann::json& json, const StageTiming& timing) {
  json = {{"name", timing.name},    {"count", timing.count},   {"median_ms", timing.median},
          {"mean_ms", timing.mean}, {"p95_ms", timing.p95},    {"p99_ms", timing.p99},
          {"max_ms", timing.max},   {"total_ms", timing.total}};
}

}  // namespace stillmap
