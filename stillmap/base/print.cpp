// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/print.hpp"

#include <algorithm>
#include <atomic>
#include <cerrno>
#include <sys/ioctl.h>
#include <unistd.h>

namespace stillmap {
namespace {

std::atomic<bool> output_lost = false;

void note_failure(std::FILE* stream) noexcept {
  if (stream == stdout && errno != EPIPE) output_lost = true;
}

/// Returns the number of characters that a terminal shows: UTF-8 sequences count once, and control
/// sequences (ECMA-48, 5.4), which end with a letter, not at all.
std::size_t shown_width(std::string_view text) {
  std::size_t width = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '\033') {
      i = std::min(text.find_first_of("mK", i), text.size());
    } else if ((static_cast<unsigned char>(text[i]) & 0xc0) != 0x80) {
      ++width;
    }
  }
  return width;
}

/// Returns the column at which a broken line continues.
std::size_t continuation(std::string_view line, std::size_t columns) {
  const std::size_t begin = std::min(line.find_first_not_of(' '), line.size());
  const std::size_t gap = line.find("  ", begin);
  const std::size_t text = std::min(line.find_first_not_of(' ', gap), line.size());
  const std::size_t column = gap == line.npos ? begin + 2 : shown_width(line.substr(0, text));
  return column <= columns / 2 ? column : std::min(begin + 2, columns / 2);
}

std::string fitted_line(std::string_view line, std::size_t columns) {
  if (shown_width(line) <= columns || line.find('\r') != line.npos) return std::string(line);
  const std::size_t indent = continuation(line, columns);
  std::string result;
  std::size_t used = 0;
  for (std::size_t begin = 0; begin < line.size();) {
    const std::size_t word = std::min(line.find_first_not_of(' ', begin), line.size());
    const std::size_t end = std::min(line.find(' ', word), line.size());
    const std::size_t width = shown_width(line.substr(word, end - word));
    const bool breaks = used > indent && used + (word - begin) + width > columns;
    if (breaks) result += '\n';
    result.append(breaks ? indent : word - begin, ' ');
    result += line.substr(word, end - word);
    used = (breaks ? indent : used + (word - begin)) + width;
    begin = end;
  }
  return result;
}

}  // namespace

std::optional<std::size_t> terminal_columns(int file_descriptor) {
  winsize size{};
  if (isatty(file_descriptor) == 0 || ioctl(file_descriptor, TIOCGWINSZ, &size) != 0 ||
      size.ws_col == 0)
    return std::nullopt;
  return size.ws_col;
}

std::string fitted(std::string_view text, std::size_t columns) {
  std::string result;
  while (!text.empty()) {
    const std::size_t end = std::min(text.find('\n'), text.size());
    result += fitted_line(text.substr(0, end), columns);
    if (end < text.size()) result += '\n';
    text.remove_prefix(std::min(end + 1, text.size()));
  }
  return result;
}

void write_text(std::FILE* stream, std::string_view text) noexcept {
  if (std::fwrite(text.data(), 1, text.size(), stream) != text.size()) note_failure(stream);
}

bool output_is_complete() noexcept {
  if (std::fflush(stdout) != 0) note_failure(stdout);
  return !output_lost;
}

}  // namespace stillmap
