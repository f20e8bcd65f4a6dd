// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stopwatch.hpp"
#include "stillmap/base/trace.hpp"

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json_fwd.hpp>

namespace stillmap {

/// Where the time of one stage went; milliseconds. Quantiles are interpolated linearly between the
/// samples.
struct StageTiming {
  std::string name;
  std::size_t count = 0;
  double median = 0, mean = 0, p95 = 0, p99 = 0, max = 0, total = 0;
};

/// Collects milliseconds by stage. Each thread keeps a recorder of its own; they are merged at the
/// end.
class TimingRecorder {
 public:
  void add(std::string_view stage, double milliseconds);
  /// Appends the other's samples; stages unknown here come after those known, in the other's order.
  void merge(const TimingRecorder& other);
  /// The samples of one stage in the order they were added; empty for an unknown stage.
  std::span<const double> samples(std::string_view stage) const;
  /// One summary per stage, in the order in which the stages were first seen.
  std::vector<StageTiming> stages() const;

 private:
  std::vector<double>& samples_of(std::string_view stage);

  std::map<std::string, std::size_t, std::less<>> index_;  // stage name to position below
  std::vector<std::string> names_;
  std::vector<std::vector<double>> samples_;
};

/// What happens while it lives is one sample of a stage, and a span of the thread's trace.
class TimedScope {
 public:
  /// @param stage a literal
  TimedScope(TimingRecorder& recorder, std::string_view stage)
      : recorder_(recorder), stage_(stage), traced_(stage) {}
  ~TimedScope() { recorder_.add(stage_, watch_.milliseconds()); }
  TimedScope(const TimedScope&) = delete;
  TimedScope& operator=(const TimedScope&) = delete;

 private:
  TimingRecorder& recorder_;
  std::string_view stage_;
  TraceScope traced_;
  Stopwatch watch_;
};

/// A text table: one line per stage, columns count, median, p95, p99, max [ms] and total [s].
std::string timing_text(std::span<const StageTiming> stages);

void to_json(nlohmann::json& json, const StageTiming& timing);

}  // namespace stillmap
