// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <filesystem>
#include <memory>
#include <string>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Returns the name of an option's value as help and manual show it: without the checks behind it,
/// N for integers, X for other numbers, or the values to choose from.
std::string value_type(const CLI::Option& option);

/// Returns a text broken into lines of at most `columns` characters, at blanks where possible. All
/// lines but the first are indented by `indent`, and the first is taken to begin there.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t columns);

/// Returns the width of help texts: that of the terminal, at least 16, or 100 without one.
std::size_t help_columns();

/// Returns whether the file descriptor is a terminal that knows codes: TERM is not "dumb".
bool takes_codes(int file_descriptor);

/// Looks of a text on a terminal.
enum class Style { kBold, kRed, kYellow };

/// Returns a text with the codes of a style if the file descriptor is a terminal, TERM is
/// not "dumb" and NO_COLOR (no-color.org) is not set; otherwise the text itself.
std::string styled(const std::string& text, Style style, int file_descriptor);

/// Returns the last line of a command: which of the written files to open first.
std::string open_line(const std::filesystem::path& file, const std::string& alternative = "");

/// Returns a formatter of help texts whose lines have the width of the terminal, or of 100
/// characters without one.
std::shared_ptr<CLI::Formatter> make_help_formatter();

}  // namespace stillmap
