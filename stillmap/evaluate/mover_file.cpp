// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/evaluate/mover_error.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <sstream>

#include <fmt/format.h>
#include <fmt/ranges.h>

namespace stillmap {
namespace {

std::vector<std::string> cells_of(std::string line) {
  if (!line.empty() && line.back() == '\r') line.pop_back();
  std::vector<std::string> cells;
  std::istringstream stream(line);
  for (std::string cell; std::getline(stream, cell, ',');) cells.push_back(cell);
  return cells;
}

/// Columns of the box; a table has all of them or none.
constexpr std::array kBoxColumns{"min_x", "min_y", "min_z", "max_x", "max_y", "max_z"};

/// One line of the table; its cells are found by the names of their columns.
class Row {
 public:
  Row(const std::map<std::string, std::size_t>& columns, std::vector<std::string> cells,
      std::string where)
      : columns_(columns), cells_(std::move(cells)), where_(std::move(where)) {
    if (cells_.size() < columns_.size()) {
      throw Error(
          fmt::format("a line of {} cells where {} are named", cells_.size(), columns_.size()),
          where_, "was the file cut short?");
    }
  }
  bool has(const std::string& name) const { return columns_.count(name) > 0; }
  const std::string& text(const std::string& name) const { return cells_[columns_.at(name)]; }
  double number(const std::string& name) const {
    const std::string& cell = text(name);
    const auto value = number_of(cell);
    if (!value || !std::isfinite(*value)) {
      throw Error(fmt::format("'{}' in column {} is no number", cell, name), where_,
                  "the first line of the table names the columns");
    }
    return *value;
  }
  int whole(const std::string& name) const {
    const double value = number(name);
    if (std::abs(value) > std::numeric_limits<int>::max()) {
      throw Error(fmt::format("'{}' in column {} is too large", text(name), name), where_,
                  "write a whole number");
    }
    return static_cast<int>(value);
  }
  Eigen::Vector3d vector(const char* x, const char* y, const char* z) const {
    return {number(x), number(y), number(z)};
  }

 private:
  const std::map<std::string, std::size_t>& columns_;
  std::vector<std::string> cells_;
  std::string where_;
};

std::map<std::string, std::size_t> columns_of(const std::string& line, const std::string& file) {
  std::map<std::string, std::size_t> columns;
  const std::vector<std::string> names = cells_of(line);
  for (std::size_t i = 0; i < names.size(); ++i) {
    if (!columns.emplace(names[i], i).second)
      throw Error(fmt::format("two columns have the name '{}'", names[i]), file, "remove one");
  }
  for (const char* name : {"timestamp", "id", "class", "x", "y", "z", "vx", "vy", "vz"}) {
    if (columns.count(name) == 0) {
      throw Error(fmt::format("no column '{}'", name), file,
                  "name movers.csv of a run, or truth_movers.csv of a simulated sequence");
    }
  }
  const auto has = [&](const char* name) { return columns.count(name) > 0; };
  const auto boxes = std::count_if(kBoxColumns.begin(), kBoxColumns.end(), has);
  if (boxes != 0 && boxes != static_cast<std::ptrdiff_t>(kBoxColumns.size())) {
    throw Error(fmt::format("has {} of the six columns of the box", boxes), file,
                fmt::format("write {} or none of them", fmt::join(kBoxColumns, ", ")));
  }
  return columns;
}

MoverPosition position_of(const Row& row) {
  MoverPosition position;
  position.timestamp = row.number("timestamp");
  position.id = row.whole("id");
  position.class_name = row.text("class");
  position.centroid = row.vector("x", "y", "z");
  position.velocity = row.vector("vx", "vy", "vz");
  if (row.has("state")) position.observed = row.text("state") != "predicted";
  if (row.has("pixels")) position.pixels = row.whole("pixels");
  if (row.has("shown")) position.shown = row.number("shown");
  if (row.has(kBoxColumns.front())) {
    position.box = {row.vector("min_x", "min_y", "min_z"), row.vector("max_x", "max_y", "max_z")};
  }
  return position;
}

}  // namespace

std::vector<MoverPosition> read_movers(const std::filesystem::path& file) {
  std::istringstream text(read_file(file));
  std::map<std::string, std::size_t> columns;
  std::vector<MoverPosition> positions;
  int number = 0;
  for (std::string line; std::getline(text, line);) {
    ++number;
    if (line.empty() || line.front() == '#') continue;
    if (columns.empty()) {
      columns = columns_of(line, file.string());
    } else {
      positions.push_back(
          position_of(Row(columns, cells_of(line), fmt::format("{}:{}", file.string(), number))));
    }
  }
  if (columns.empty())
    throw Error("is empty", file.string(), "a table begins with its columns' names");
  return positions;
}

}  // namespace stillmap
