// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <cstdio>
#include <optional>
#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

namespace stillmap {

/// Writes a text to a stream. A stream that cannot be written (full disk, closed terminal or pipe)
/// is no reason to lose the results of a run, so this never throws: see output_is_complete().
void write_text(std::FILE* stream, std::string_view text) noexcept;

/// Returns the width of the terminal behind a file descriptor [characters]; none if it is no
/// terminal or does not tell.
std::optional<std::size_t> terminal_columns(int file_descriptor);

/// Returns a text whose lines of more than `columns` characters are broken at blanks. They continue
/// below the text of the line, if a name and at least two blanks precede it, or otherwise two
/// characters to the right of its beginning. Colors take no width.
std::string fitted(std::string_view text, std::size_t columns);

/// Writes formatted text to a stream, to standard output, or to standard error, by write_text(). On
/// a terminal its lines are fitted to the width.
template <typename... T>
void print_to(std::FILE* stream, fmt::format_string<T...> format, T&&... values) {
  const std::string text = fmt::format(format, std::forward<T>(values)...);
  const auto columns = terminal_columns(fileno(stream));
  write_text(stream, columns ? fitted(text, *columns) : text);
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
