// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

/// The figures that the four papers print, from published_figures.json, which also names their
/// sources. The file is compiled in.
namespace stillmap {

/// An error or time that a table of a paper compares.
enum class PaperMeasure {
  kAte,                   ///< Absolute trajectory error [m].
  kRpeFrameTranslation,   ///< Relative pose error from frame to frame, translation [m].
  kRpeFrameRotation,      ///< Relative pose error from frame to frame, rotation [deg].
  kRpeSecondTranslation,  ///< Relative pose error over one second, translation [m].
  kTrackingTime,          ///< Tracking time per frame [ms].
  kAteImprovement,        ///< Improvement of the ATE over the baseline [%].
};

/// Figures of one sequence, in the order of the table's systems and statistics.
struct PublishedRow {
  /// Value by system and statistic; none where the paper has a dash.
  std::vector<std::vector<std::optional<double>>> values;
  std::vector<double> improvement;  ///< Printed improvement per statistic [%]; may be empty.
};

/// A table of a paper.
struct PublishedTable {
  std::string number;  ///< Number in the paper, or the section of figures in the text.
  PaperMeasure measure = PaperMeasure::kAte;
  std::vector<std::string> statistics;  ///< Of "rmse", "mean", "median" and "sd".
  std::vector<std::string> systems;     ///< Compared systems, in the order of the columns.
  std::string remark;                   ///< What the reader must know to compare; may be empty.
  std::map<std::string, PublishedRow> rows;  ///< By sequence, such as "walking_xyz".

  /// Returns a value; none if the table does not have it.
  std::optional<double> value(const std::string& sequence, const std::string& system,
                              const std::string& statistic) const;
};

/// A paper with its experiment.
struct Paper {
  std::string preset;  ///< Name of the preset that rebuilds its system.
  std::string title, authors, source;
  int year = 0;
  std::string baseline,
      system;  ///< Names of the baseline and the paper's own system in the tables.
  std::vector<std::string> sequences;  ///< Sequences of TUM freiburg3, such as "walking_xyz".
  std::string crane;  ///< What it reports about its experiment with a crane; empty without one.
  std::vector<PublishedTable> tables;
};

/// Returns the four papers.
const std::vector<Paper>& papers();

/// Returns the paper of a preset. Throws Error for an unknown name.
const Paper& find_paper(const std::string& preset);

/// Returns the content of published_figures.json.
std::string_view published_figures_text();

}  // namespace stillmap
