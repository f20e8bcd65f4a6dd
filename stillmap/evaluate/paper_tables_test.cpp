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
  run.waiting_ms = 250 * rmse;
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

TEST(PaperTables, TellWhichRunsHavePosesForAPartOfTheFramesOnly) {
  std::vector<PaperRun> runs = some_runs();
  for (PaperRun& run : runs) run.evaluation->coverage = {99, 100, false};
  runs.push_back(run_of("ORB-SLAM3", "walking_xyz", 0.001, 0));
  runs.back().evaluation->coverage = {12, 60, false};
  runs.back().timed = false;
  const auto tables = paper_tables(find_paper("seg-mask"), runs, {.others = {"ORB-SLAM3"}});
  const auto& notes = tables.front().notes;
  EXPECT_EQ(std::count_if(notes.begin(), notes.end(),
                          [](const std::string& note) {
                            return note.starts_with(
                                "ORB-SLAM3 has poses for 20.0 % of the frames of walking_xyz");
                          }),
            1);
  EXPECT_EQ(std::count_if(notes.begin(), notes.end(),
                          [](const std::string& note) {
                            return note.find("has poses for") != std::string::npos;
                          }),
            1);
  const auto& columns = tables.back().columns;
  EXPECT_NE(std::find(columns.begin(), columns.end(), "ORB-SLAM3, frames tracked [%]"),
            columns.end());
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
  const auto figure = [&](const std::string& column) {
    const auto at = std::find(costs.columns.begin(), costs.columns.end(), column);
    return *costs.rows[0].at(static_cast<std::size_t>(at - costs.columns.begin())).value;
  };
  EXPECT_NEAR(figure("orb-rgbd, tracking [ms]"), 4, 1e-12);
  EXPECT_NEAR(figure("seg-mask, tracking with the detector [ms]"), 5.2, 1e-12);
  EXPECT_NEAR(figure("seg-mask, whole system [ms]"), 0.8, 1e-12);
  EXPECT_NEAR(figure("orb-rgbd, frames tracked [%]"), 90, 1e-12);
  for (const std::string& column : costs.columns)
    EXPECT_FALSE(column.starts_with("fused")) << "was not run";
}

TEST(PaperTables, ShowTheRunsBesideTheirMean) {
  const FigureTable table = paper_tables(find_paper("seg-mask"), some_runs()).at(0);
  EXPECT_EQ(cell(table, "walking_xyz", "RMSE", "seg-mask").shown(), "0.0200 (0.0100 0.0300)");
  EXPECT_EQ(cell(table, "kitchen_still", "RMSE", "orb-rgbd").shown(), "0.0020") << "one run";
}

TEST(PaperTables, EndWithTheMeansOverTheWalkingSequencesAsTheAbstractsDo) {
  std::vector<PaperRun> runs = some_runs();
  for (const char* name : {"walking_halfsphere", "walking_rpy", "walking_static"}) {
    runs.push_back(run_of("orb-rgbd", name, 0.4, 0.2));
    runs.push_back(run_of("seg-mask", name, 0.1, 0.1));
  }
  const FigureTable table = paper_tables(find_paper("seg-mask"), runs).at(0);
  const std::string mean = "mean of walking_*";
  EXPECT_EQ(cell(table, mean, "RMSE", "improved, from the published [%]").shown(), "83.08");
  EXPECT_EQ(cell(table, mean, "SD", "improved, from the published [%]").shown(), "83.35");
  EXPECT_NEAR(*cell(table, mean, "RMSE", "seg-mask").value, 0.08, 1e-12);
  EXPECT_NEAR(*cell(table, mean, "RMSE", "seg-mask improved [%]").value, (95 + 3 * 75) / 4.0, 1e-9);
  const FigureTable one = paper_tables(find_paper("seg-mask"), some_runs()).at(0);
  EXPECT_EQ(cell(one, mean, "RMSE", "seg-mask").value, std::nullopt) << "three are missing";
}

TEST(PaperTables, OfTimesEndWithTheMeanOverAllSequencesOfThePaper) {
  const auto tables = paper_tables(find_paper("seg-mask"), some_runs());
  const FigureTable& times = tables.at(3);
  EXPECT_EQ(cell(times, "mean of the paper's sequences", "mean", "published: SLAM3-YOLOv8").shown(),
            "18.08");
  EXPECT_EQ(cell(times, "mean of the paper's sequences", "mean", "orb-rgbd").value, std::nullopt)
      << "only one of them was run";
}

TEST(PaperTables, HaveColumnsForOtherSystemsOverWhichTheRatesMayBe) {
  std::vector<PaperRun> runs = some_runs();
  runs.push_back(run_of("ORB-SLAM3", "walking_xyz", 0.2, 0.1));
  runs.back().timed = false;
  const auto tables = paper_tables(find_paper("seg-mask"), runs,
                                   {.reference = "ORB-SLAM3", .others = {"ORB-SLAM3"}});
  EXPECT_NEAR(*cell(tables[0], "walking_xyz", "RMSE", "ORB-SLAM3").value, 0.2, 1e-12);
  EXPECT_NEAR(*cell(tables[0], "walking_xyz", "RMSE", "seg-mask improved [%]").value, 90, 1e-9);
  EXPECT_EQ(cell(tables[3], "walking_xyz", "mean", "ORB-SLAM3").value, std::nullopt) << "a time";
}

TEST(SummaryTables, ShowMedianAndWorstPerSystemAndSequence) {
  std::vector<PaperRun> runs = some_runs();
  runs.push_back(run_of("seg-mask", "walking_xyz", 0.011, 0.1));
  runs.front().highly_dynamic = 0.25;
  const auto tables = summary_tables(runs, {"orb-rgbd", "seg-mask", "absent"}, "orb-rgbd");
  const auto table = [&](const std::string& key) {
    return std::find_if(tables.begin(), tables.end(), [&](auto& t) { return t.first == key; })
        ->second;
  };
  const FigureTable ate = table("ate");
  EXPECT_EQ(ate.columns, (std::vector<std::string>{"system", "walking_xyz", "kitchen_still"}));
  ASSERT_EQ(ate.rows.size(), 2U);
  EXPECT_EQ(ate.rows[1][1].shown(), "11.0; 30.0");
  EXPECT_EQ(ate.rows[0][2].shown(), "2.0");
  EXPECT_NEAR(*table("improvement").rows[0][1].value, 100 * (1 - 0.017 / 0.4), 1e-9);
  EXPECT_NEAR(*table("tracked").rows[0][1].value, 90, 1e-9);
}

TEST(PaperRun, GivesTheProblemInJsonIfThereAreNoErrors) {
  const nlohmann::json json = failed_run();
  EXPECT_EQ(json["problem"], "lost");
  EXPECT_EQ(json["first_frame"], 2);
}

}  // namespace
}  // namespace stillmap
