// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/published_figures.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"

#include <algorithm>

#include <fmt/format.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using Json = nlohmann::json;

PaperMeasure measure_of(const std::string& name) {
  static const std::map<std::string, PaperMeasure> kNames{
      {"ate", PaperMeasure::kAte},
      {"rpe_frame_translation", PaperMeasure::kRpeFrameTranslation},
      {"rpe_frame_rotation", PaperMeasure::kRpeFrameRotation},
      {"rpe_second_translation", PaperMeasure::kRpeSecondTranslation},
      {"tracking_time", PaperMeasure::kTrackingTime},
      {"ate_improvement", PaperMeasure::kAteImprovement}};
  return kNames.at(name);
}

std::vector<std::optional<double>> values_of(const Json& json) {
  std::vector<std::optional<double>> values;
  for (const Json& value : json) {
    values.push_back(value.is_null() ? std::nullopt : std::optional(value.get<double>()));
  }
  return values;
}

PublishedTable table_of(const Json& json) {
  PublishedTable table;
  table.number = json.at("number");
  table.measure = measure_of(json.at("measure"));
  table.statistics = json.at("statistics");
  table.systems = json.at("systems");
  table.remark = json.value("remark", "");
  for (const auto& [sequence, row] : json.at("rows").items()) {
    PublishedRow published;
    for (const std::string& system : table.systems)
      published.values.push_back(values_of(row.at(system)));
    published.improvement = row.value("improvement", std::vector<double>{});
    table.rows.emplace(sequence, std::move(published));
  }
  return table;
}

Paper paper_of(const Json& json) {
  Paper paper;
  paper.preset = json.at("preset");
  paper.title = json.at("title");
  paper.authors = json.at("authors");
  paper.source = json.at("source");
  paper.year = json.at("year");
  paper.baseline = json.at("baseline");
  paper.system = json.at("system");
  paper.sequences = json.at("sequences");
  paper.crane = json.value("crane", "");
  for (const Json& table : json.at("tables")) paper.tables.push_back(table_of(table));
  return paper;
}

/// Returns the position of a name; none if the list does not have it.
std::optional<std::size_t> position(const std::vector<std::string>& names,
                                    const std::string& name) {
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) return std::nullopt;
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace

std::optional<double> PublishedTable::value(const std::string& sequence, const std::string& system,
                                            const std::string& statistic) const {
  const auto row = rows.find(sequence);
  const auto column = position(systems, system), index = position(statistics, statistic);
  if (row == rows.end() || !column || !index) return std::nullopt;
  return row->second.values.at(*column).at(*index);
}

const std::vector<Paper>& papers() {
  static const std::vector<Paper> kPapers = [] {
    const Json json = Json::parse(published_figures_text());
    std::vector<Paper> all;
    for (const Json& paper : json.at("papers")) all.push_back(paper_of(paper));
    return all;
  }();
  return kPapers;
}

const Paper& find_paper(const std::string& preset) {
  std::vector<std::string> names;
  for (const Paper& paper : papers()) {
    if (paper.preset == preset) return paper;
    names.push_back(paper.preset);
  }
  throw Error(fmt::format("there is no paper '{}'", preset), "papers", suggestion(preset, names));
}

}  // namespace stillmap
