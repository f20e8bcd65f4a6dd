// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstdio>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stillmap {

/// Writes a text to a stream. A stream that cannot be written (full disk, closed terminal or pipe)
/// is no reason to lose the results of a run, so this never throws: see output_is_complete().
void write_text(std::FILE* stream, std::string_view text) noexcept;

/// Writes formatted text to a stream, to standard output, or to standard error, by write_text().
template <typename... T>
void print_to(std::FILE* stream, fmt::format_string<T...> format, T&&... values) {
  write_text(stream, fmt::format(format, std::forward<T>(values)...));
}
template <typename... T>
void print_out(fmt::format_string<T...> format, T&&... values) {
  print_to(stdout, format, std::forward<T>(values)...);
}
template <typename... T>
void print_error(fmt::format_string<T...> format, T&&... values) {
  print_to(stderr, format, std::forward<T>(values)...);
}

/// Flushes standard output. Returns whether all text for it was written, except for a reader that
/// closed its pipe.
bool output_is_complete() noexcept;

}  // namespace stillmap
