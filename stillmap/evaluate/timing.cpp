// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/timing.hpp"

#include "stillmap/evaluate/statistics.hpp"

#include <algorithm>
#include <numeric>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

StageTiming summarize(const std::string& name, std::span<const double> samples) {
  StageTiming timing{.name = name, .count = samples.size()};
  if (samples.empty()) return timing;
  timing.total = std::accumulate(samples.begin(), samples.end(), 0.0);
  timing.mean = timing.total / static_cast<double>(samples.size());
  timing.median = quantile(samples, 0.5);
  timing.p95 = quantile(samples, 0.95);
  timing.p99 = quantile(samples, 0.99);
  timing.max = *std::max_element(samples.begin(), samples.end());
  return timing;
}

}  // namespace

std::vector<double>& TimingRecorder::samples_of(std::string_view stage) {
  auto found = index_.find(stage);
  if (found == index_.end()) {
    found = index_.emplace(std::string(stage), names_.size()).first;
    names_.emplace_back(stage);
    samples_.emplace_back();
  }
  return samples_[found->second];
}

void TimingRecorder::add(std::string_view stage, double milliseconds) {
  samples_of(stage).push_back(milliseconds);
}

void TimingRecorder::merge(const TimingRecorder& other) {
  for (std::size_t i = 0; i < other.names_.size(); ++i) {
    const std::vector<double> more = other.samples_[i];  // a copy: other may be this
    std::vector<double>& mine = samples_of(other.names_[i]);
    mine.insert(mine.end(), more.begin(), more.end());
  }
}

std::span<const double> TimingRecorder::samples(std::string_view stage) const {
  const auto found = index_.find(stage);
  if (found == index_.end()) return {};
  return samples_[found->second];
}

std::vector<StageTiming> TimingRecorder::stages() const {
  std::vector<StageTiming> result;
  for (std::size_t i = 0; i < names_.size(); ++i)
    result.push_back(summarize(names_[i], samples_[i]));
  return result;
}

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
