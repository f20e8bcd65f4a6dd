// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/figure_table.hpp"

#include <algorithm>
#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

/// Returns the width of each column [characters].
std::vector<std::size_t> widths_of(const FigureTable& table) {
  std::vector<std::size_t> widths;
  for (const std::string& column : table.columns) widths.push_back(column.size());
  for (const auto& row : table.rows) {
    for (std::size_t i = 0; i < row.size(); ++i)
      widths[i] = std::max(widths[i], row[i].shown().size());
  }
  return widths;
}

/// Returns whether a column contains numbers, which are aligned to the right.
bool is_numeric(const FigureTable& table, std::size_t column) {
  return std::any_of(table.rows.begin(), table.rows.end(),
                     [&](const auto& row) { return row[column].value.has_value(); });
}

std::string in_latex(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '\\') {
      escaped += "\\textbackslash{}";
    } else if (c == '~') {
      escaped += "\\textasciitilde{}";
    } else if (c == '^') {
      escaped += "\\textasciicircum{}";
    } else {
      if (std::string_view("%_&#${}").find(c) != std::string_view::npos) escaped += '\\';
      escaped += c;
    }
  }
  return escaped;
}

/// Returns a text as it stands in a cell of Markdown, which a | would end.
std::string in_cell(const std::string& text) {
  std::string escaped;
  for (const char c : text) {
    if (c == '|') escaped += '\\';
    escaped += c;
  }
  return escaped;
}

/// Returns the table with the texts of its cells and columns as Markdown needs them.
FigureTable in_markdown(FigureTable table) {
  for (std::string& column : table.columns) column = in_cell(column);
  for (auto& row : table.rows)
    for (FigureCell& cell : row) cell.text = in_cell(cell.text);
  return table;
}

/// Returns a number with these decimals, ties away from zero: 83.355, which no binary number is,
/// becomes 83.36.
std::string rounded(double value, int decimals) {
  constexpr double kError = 1e-12;  // of a binary number, relative
  return fmt::format("{:.{}f}", value * (1 + kError), decimals);
}

}  // namespace

FigureCell::FigureCell(std::optional<double> figure, int digits) : decimals(digits) {
  if (figure && std::isfinite(*figure)) value = figure;
}

std::string FigureCell::shown() const {
  if (value) return rounded(*value, decimals);
  return text.empty() ? "-" : text;
}

std::string table_markdown(const FigureTable& unescaped) {
  const FigureTable table = in_markdown(unescaped);
  const std::vector<std::size_t> widths = widths_of(table);
  std::string text = fmt::format("**{}**\n\n|", table.title), rule = "|";
  for (std::size_t i = 0; i < widths.size(); ++i) {
    text += fmt::format(" {:<{}} |", table.columns[i], widths[i]);
    const bool numeric = is_numeric(table, i);
    rule += fmt::format("{:-<{}}{}", "", widths[i] + (numeric ? 1 : 2), numeric ? ":|" : "|");
  }
  text += "\n" + rule + "\n";
  for (const auto& row : table.rows) {
    text += "|";
    for (std::size_t i = 0; i < row.size(); ++i) {
      text += is_numeric(table, i) ? fmt::format(" {:>{}} |", row[i].shown(), widths[i])
                                   : fmt::format(" {:<{}} |", row[i].shown(), widths[i]);
    }
    text += "\n";
  }
  for (const std::string& note : table.notes) text += fmt::format("\n{}\n", note);
  return text;
}

std::string table_latex(const FigureTable& table) {
  std::string alignment;
  std::vector<std::string> head;
  for (std::size_t i = 0; i < table.columns.size(); ++i) {
    alignment += is_numeric(table, i) ? 'r' : 'l';
    head.push_back(in_latex(table.columns[i]));
  }
  std::string text = fmt::format(
      "\\begin{{table}}\n\\caption{{{}}}\n\\begin{{tabular}}{{{}}}\n\\hline\n{} \\\\\n\\hline\n",
      in_latex(table.title), alignment, fmt::join(head, " & "));
  for (const auto& row : table.rows) {
    std::vector<std::string> cells;
    for (const FigureCell& cell : row) cells.push_back(in_latex(cell.shown()));
    text += fmt::format("{} \\\\\n", fmt::join(cells, " & "));
  }
  text += "\\hline\n\\end{tabular}\n";
  for (const std::string& note : table.notes) text += fmt::format("\n{}\n", in_latex(note));
  return text + "\\end{table}\n";
}

}  // namespace stillmap
