// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <chrono>

namespace stillmap {

/// Measures wall time since construction or the last lap.
class Stopwatch {
 public:
  double milliseconds() const {
    return std::chrono::duration<double, std::milli>(Clock::now() - start_).count();
  }
  /// Returns the time since the last lap or construction [ms] and starts the next lap.
  double lap() {
    const auto now = Clock::now();
    const double ms = std::chrono::duration<double, std::milli>(now - start_).count();
    start_ = now;
    return ms;
  }

 private:
  using Clock = std::chrono::steady_clock;
  Clock::time_point start_ = Clock::now();
};

}  // namespace stillmap
