// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/base/stopwatch.hpp"

#include <cstddef>
#include <optional>
#include <string>
#include <thread>

namespace stillmap {

/// Progress display: a bar on a terminal, otherwise a line every few seconds. Writes to standard
/// error, so that results can be piped.
class Progress {
 public:
  /// @param title  text in front of the bar
  /// @param total  number of steps; none if unknown
  /// @param unit  of what is counted
  Progress(std::string title, std::optional<std::size_t> total, std::string unit = "frames");
  ~Progress() { finish(); }
  Progress(const Progress&) = delete;
  Progress& operator=(const Progress&) = delete;

  /// From now on no progress is shown (--quiet).
  static void hide();
  static bool is_hidden() { return hidden; }

  /// Advances by one step; `note` is shown at the end of the line.
  void step(const std::string& note = "");
  /// Makes the number of steps so far the total, so that the bar is full.
  void complete() { total_ = done_; }
  void finish();

 private:
  void show();

  static bool hidden;
  const std::string title_, unit_;
  std::optional<std::size_t> total_;
  const bool terminal_;
  std::string note_;
  std::size_t done_ = 0;
  bool finished_ = false;
  double last_shown_ = 0;  // time of the last display since the start [ms]
  Stopwatch watch_;
};

/// Shows the title of a step without known length, on a terminal with the elapsed time, until the
/// object is destroyed.
class ProgressStep {
 public:
  explicit ProgressStep(const std::string& title);

 private:
  std::jthread shown_;
};

}  // namespace stillmap
