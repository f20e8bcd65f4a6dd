// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/stage_times.hpp"

#include "stillmap/base/statistics.hpp"

#include <algorithm>

namespace stillmap {

void StageSamples::add(double milliseconds) {
  if (count_++ % every_ == 0) {
    if (kept_.size() == kMost) {
      for (std::size_t i = 0; i < kMost / 2; ++i) kept_[i] = kept_[2 * i];
      kept_.resize(kMost / 2);
      every_ *= 2;  // kMost is even, so this sample is one of those to be kept
    }
    kept_.push_back(milliseconds);
  }
  total_ += milliseconds;
  max_ = std::max(max_, milliseconds);
}

void StageSamples::append(const StageSamples& others) {
  if (count_ == 0) {
    *this = others;
    return;
  }
  for (const double milliseconds : others.kept_) add(milliseconds);
}

StageTiming StageSamples::summary(std::string_view name) const {
  return {.name = std::string(name),
          .count = count_,
          .median = quantile(kept_, 0.5),
          .mean = count_ > 0 ? total_ / static_cast<double>(count_) : 0,
          .p95 = quantile(kept_, 0.95),
          .p99 = quantile(kept_, 0.99),
          .max = max_,
          .total = total_};
}

StageSamples& StageTimes::of(std::string_view stage) {
  const auto found = std::find_if(stages_.begin(), stages_.end(),
                                  [&](const auto& named) { return named.first == stage; });
  if (found != stages_.end()) return found->second;
  return stages_.emplace_back(stage, StageSamples()).second;
}

void StageTimes::add(std::string_view stage, double milliseconds) { of(stage).add(milliseconds); }

void StageTimes::append(std::string_view stage, const StageSamples& samples) {
  if (!samples.kept().empty()) of(stage).append(samples);
}

std::span<const double> StageTimes::samples(std::string_view stage) const {
  for (const auto& [name, samples] : stages_) {
    if (name == stage) return samples.kept();
  }
  return {};
}

std::vector<StageTiming> StageTimes::stages() const {
  std::vector<StageTiming> summaries;
  for (const auto& [name, samples] : stages_) summaries.push_back(samples.summary(name));
  return summaries;
}

}  // namespace stillmap
