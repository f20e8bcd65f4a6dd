// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <cstddef>
#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

namespace stillmap {

/// Returns the width of the terminal behind a file descriptor [characters]; none if it is no
/// terminal or does not tell.
std::optional<std::size_t> terminal_columns(int file_descriptor);

/// Returns a text broken into lines of at most `columns` characters, at blanks where possible. All
/// lines but the first are indented by `indent`, and the first is taken to begin there.
std::string wrapped(const std::string& text, std::size_t indent, std::size_t columns);

/// Returns a formatter of help texts whose lines have the width of the terminal, or of 100
/// characters without one.
std::shared_ptr<CLI::Formatter> make_help_formatter();

}  // namespace stillmap
