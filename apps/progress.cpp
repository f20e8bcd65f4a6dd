// SPDX-License-Identifier: Apache-2.0
#include "progress.hpp"

#include "stillmap/base/print.hpp"

#include <chrono>
#include <condition_variable>
#include <cstdio>
#include <limits>
#include <mutex>
#include <unistd.h>

#include "terminal.hpp"
#include <fmt/format.h>

namespace stillmap {
namespace {

constexpr double kRedrawEvery = 100, kLineEvery = 5000;  // milliseconds
constexpr std::size_t kBarWidth = 28;
/// Width of a terminal from which the bar is drawn, and width if it is unknown [characters].
constexpr std::size_t kColumnsForBar = 80, kUnlimited = std::numeric_limits<std::size_t>::max();

/// Replaces the last line of the terminal. Text beyond its width is cut, because a wrapped line
/// cannot be replaced.
void replace_line(std::string line) {
  const std::size_t columns = terminal_columns(STDERR_FILENO).value_or(kUnlimited);
  if (line.size() >= columns) line.resize(columns - 1);
  print_error("\r\033[K{}", line);
  std::fflush(stderr);
}

/// Returns a duration [s] as a text in seconds or minutes.
std::string duration_text(double seconds) {
  const int s = static_cast<int>(seconds + 0.5);
  return s < 60 ? fmt::format("{} s", s) : fmt::format("{}:{:02d} min", s / 60, s % 60);
}

}  // namespace

bool Progress::hidden = false;

void Progress::hide() { hidden = true; }

Progress::Progress(std::string title, std::optional<std::size_t> total, std::string unit)
    : title_(std::move(title)),
      unit_(std::move(unit)),
      total_(total),
      terminal_(takes_codes(STDERR_FILENO)) {}

void Progress::step(const std::string& note) {
  ++done_;
  note_ = note;
  const double now = watch_.milliseconds();
  if (hidden || now - last_shown_ < (terminal_ ? kRedrawEvery : kLineEvery)) return;
  last_shown_ = now;
  show();
}

void Progress::show() {
  const double seconds = watch_.milliseconds() / 1000;
  const double rate = seconds > 0 ? static_cast<double>(done_) / seconds : 0;
  std::string line = title_ + " ";
  const std::size_t columns = terminal_columns(STDERR_FILENO).value_or(kUnlimited);
  if (total_ && *total_ > 0) {
    const std::size_t filled = std::min(kBarWidth, kBarWidth * done_ / *total_);
    if (terminal_ && columns >= kColumnsForBar)
      line += "[" + std::string(filled, '#') + std::string(kBarWidth - filled, '.') + "] ";
    line += fmt::format("{}/{}  {:.1f} {}/s", done_, *total_, rate, unit_);
    if (rate > 0 && done_ < *total_) {
      line += ", " + duration_text(static_cast<double>(*total_ - done_) / rate) + " left";
    }
  } else {
    line += fmt::format("{}  {:.1f} {}/s", done_, rate, unit_);
  }
  if (!note_.empty()) line += "  " + note_;
  if (terminal_) {
    replace_line(line);
  } else {
    print_error("{}\n", line);
  }
}

ProgressStep::ProgressStep(const std::string& title) {
  if (Progress::is_hidden()) return;
  if (!takes_codes(STDERR_FILENO)) {
    print_error("{}\n", title);
    return;
  }
  shown_ = std::jthread([title](const std::stop_token& stop) {
    const Stopwatch watch;
    std::mutex mutex;
    std::condition_variable_any ended;
    std::unique_lock lock(mutex);
    const auto show = [&] {
      replace_line(title + "  " + duration_text(watch.milliseconds() / 1000));
    };
    do {
      show();
    } while (!ended.wait_for(lock, stop, std::chrono::seconds(1),
                             [&] { return stop.stop_requested(); }));
    show();
    print_error("\n");
  });
}

void Progress::finish() {
  if (finished_) return;
  finished_ = true;
  if (hidden) return;
  show();
  if (terminal_) print_error("\n");
}

}  // namespace stillmap
