// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <span>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace stillmap {

/// Summary of the times of one stage [ms]. Quantiles are interpolated linearly between samples.
struct StageTiming {
  std::string name;
  std::size_t count = 0;
  double median = 0, mean = 0, p95 = 0, p99 = 0, max = 0, total = 0;
};

/// Times of one stage [ms] in the order of adding, in bounded memory. Count, total and maximum are
/// exact. Beyond kMost samples every second one is removed, and of the following ones every second
/// one is dropped, so that the kept samples stay evenly spread over the run.
class StageSamples {
 public:
  static constexpr std::size_t kMost = 1 << 14;

  void add(double milliseconds);
  /// Adds the samples of another thread's part of the stage.
  void append(const StageSamples& others);
  std::span<const double> kept() const { return kept_; }
  StageTiming summary(std::string_view name) const;

 private:
  std::vector<double> kept_;
  std::size_t every_ = 1;  // interval of the kept samples
  std::size_t count_ = 0;
  double total_ = 0, max_ = 0;
};

/// Times of the stages of a run, by name.
class StageTimes {
 public:
  /// Adds one sample [ms].
  void add(std::string_view stage, double milliseconds);
  /// Adds samples. A stage without samples is not added.
  void append(std::string_view stage, const StageSamples& samples);
  /// Returns the kept samples of a stage in the order of adding [ms]; empty for an unknown
  /// stage.
  std::span<const double> samples(std::string_view stage) const;
  /// Returns one summary per stage, in the order in which the stages were first added.
  std::vector<StageTiming> stages() const;

 private:
  StageSamples& of(std::string_view stage);

  std::vector<std::pair<std::string, StageSamples>> stages_;
};

}  // namespace stillmap
