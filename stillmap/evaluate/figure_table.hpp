// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <optional>
#include <string>
#include <vector>

namespace stillmap {

/// A cell of a table: a text, or a number with its decimals, or nothing (shown as a dash).
struct FigureCell {
  FigureCell() = default;
  FigureCell(std::string words) : text(std::move(words)) {}
  FigureCell(const char* words) : text(words) {}
  /// A value that is missing or not finite gives an empty cell.
  FigureCell(std::optional<double> figure, int digits);

  std::string text;             ///< The text of a cell without value.
  std::optional<double> value;  ///< The number, not rounded.
  int decimals = 0;
  /// Returns the cell as it is shown.
  std::string shown() const;
};

/// A table of figures with a title and notes below.
struct FigureTable {
  std::string title;
  std::vector<std::string> columns;
  std::vector<std::vector<FigureCell>> rows;
  std::vector<std::string> notes;
};

/// Returns the table in Markdown, with aligned columns, so that it is also readable as text.
std::string table_markdown(const FigureTable& table);

/// Returns the table as a LaTeX float with a tabular, for which no package is needed.
std::string table_latex(const FigureTable& table);

}  // namespace stillmap
