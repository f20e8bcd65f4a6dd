#include "stillmap/evaluate/paper_tables.hpp"

#include <algorithm>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Returns a run with the given ATE statistics; everything else is zero.
PaperRun run_of(const std::string& preset, const std::string& sequence, double rmse, double sd) {
  PaperRun run{preset, sequence, 0, Evaluation{}, 10 * rmse, 40 * rmse};
  run.evaluation->ate.translation.rmse = rmse;
  run.evaluation->ate.translation.sd = sd;
  run.evaluation->ate.translation.count = 100;
  run.evaluation->coverage = {90, 100, false};
  return run;
}

PaperRun failed_run() { return {"seg-mask", "walking_xyz", 2, std::nullopt, 0, 0, "lost"}; }

/// Two runs per preset on a sequence of the paper, and one on another sequence.
std::vector<PaperRun> some_runs() {
  return {run_of("orb-rgbd", "walking_xyz", 0.3, 0.2), run_of("orb-rgbd", "walking_xyz", 0.5, 0.2),
          run_of("seg-mask", "walking_xyz", 0.01, 0.1),
          run_of("seg-mask", "walking_xyz", 0.03, 0.1),
          run_of("orb-rgbd", "kitchen_still", 0.002, 0.001)};
}

/// Returns the cells of a row by the names of their columns.
const FigureCell& cell(const FigureTable& table, const std::string& sequence,
                       const std::string& statistic, const std::string& column) {
  const auto row = std::find_if(table.rows.begin(), table.rows.end(), [&](const auto& cells) {
    return cells[0].text == sequence && cells[1].text == statistic;
  });
  const auto at = std::find(table.columns.begin(), table.columns.end(), column);
  if (row == table.rows.end() || at == table.columns.end()) throw std::out_of_range(column);
  return row->at(static_cast<std::size_t>(at - table.columns.begin()));
}

TEST(PaperTables, AverageTheRunsBeforeTheImprovementRateIsComputed) {
  const FigureTable table = paper_tables(find_paper("seg-mask"), some_runs()).at(0);
  EXPECT_NEAR(*cell(table, "walking_xyz", "RMSE", "orb-rgbd").value, 0.4, 1e-12);
  EXPECT_NEAR(*cell(table, "walking_xyz", "RMSE", "seg-mask").value, 0.02, 1e-12);
  EXPECT_NEAR(*cell(table, "walking_xyz", "RMSE", "seg-mask improved [%]").value, 95, 1e-9);
  EXPECT_NEAR(*cell(table, "walking_xyz", "SD", "seg-mask improved [%]").value, 50, 1e-9);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "fused").value, std::nullopt);
}

TEST(PaperTables, HaveNoMeanOverOtherStartsThanTheBaselines) {
  std::vector<PaperRun> runs = some_runs();
  runs.push_back(failed_run());
  const FigureTable table = paper_tables(find_paper("seg-mask"), runs).at(0);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "seg-mask").value, std::nullopt);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "seg-mask improved [%]").value, std::nullopt);
  EXPECT_NEAR(*cell(table, "walking_xyz", "RMSE", "orb-rgbd").value, 0.4, 1e-12);
}

TEST(PaperTables, ShowThePublishedFiguresWhetherMeasuredOrNot) {
  const FigureTable table = paper_tables(find_paper("seg-mask"), some_runs()).at(0);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "published: SLAM3-YOLOv8").value, 0.013);
  EXPECT_EQ(cell(table, "walking_rpy", "SD", "published: DynaSLAM").value, 0.0206);
  EXPECT_EQ(cell(table, "walking_rpy", "SD", "orb-rgbd").value, std::nullopt);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "improved, from the published [%]").shown(),
            "95.42");
}

TEST(PaperTables, ShowOtherSequencesWithoutPublishedFigures) {
  const FigureTable table = paper_tables(find_paper("seg-mask"), some_runs()).at(0);
  EXPECT_EQ(cell(table, "kitchen_still", "RMSE", "orb-rgbd").shown(), "0.0020");
  EXPECT_EQ(cell(table, "kitchen_still", "RMSE", "published: ORB-SLAM3").shown(), "-");
}

TEST(PaperTables, CompareImprovementRatesWithThoseThatAPaperPrints) {
  std::vector<PaperRun> runs = some_runs();
  runs.push_back(run_of("box-flow", "walking_xyz", 0.1, 0));
  const auto tables = paper_tables(find_paper("box-flow"), runs);
  const FigureTable& table = tables.at(2);
  EXPECT_NEAR(*cell(table, "walking_xyz", "RMSE", "box-flow").value, 75, 1e-9);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "published: DS-SLAM").value, 92.6);
  EXPECT_EQ(std::count(table.columns.begin(), table.columns.end(), "orb-rgbd"), 0);
}

TEST(PaperTables, ShowTimesPerFrameAndTheShareOfTrackedFrames) {
  const auto tables = paper_tables(find_paper("seg-mask"), some_runs());
  EXPECT_NEAR(*cell(tables.at(3), "walking_xyz", "mean", "orb-rgbd").value, 4, 1e-12);
  const FigureTable& costs = tables.back();
  ASSERT_EQ(costs.rows.size(), 2U) << "no row for sequences that were not run";
  const std::vector<std::string> first_columns{"sequence", "orb-rgbd, tracking [ms]",
                                               "seg-mask, tracking [ms]"};
  EXPECT_TRUE(std::equal(first_columns.begin(), first_columns.end(), costs.columns.begin()));
  const auto& row = costs.rows[0];
  ASSERT_EQ(row.size(), costs.columns.size());
  EXPECT_NEAR(*row[1].value, 4, 1e-12) << "orb-rgbd, tracking";
  EXPECT_NEAR(*row[5].value, 0.8, 1e-12) << "seg-mask, whole system";
  EXPECT_NEAR(*row[7].value, 90, 1e-12) << "orb-rgbd, frames tracked";
  EXPECT_EQ(row[9].value, std::nullopt) << "fused was not run";
}

TEST(PaperRun, GivesTheProblemInJsonIfThereAreNoErrors) {
  const nlohmann::json json = failed_run();
  EXPECT_EQ(json["problem"], "lost");
  EXPECT_EQ(json["first_frame"], 2);
}

}  // namespace
}  // namespace stillmap
