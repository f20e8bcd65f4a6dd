#include "stillmap/evaluate/crane_table.hpp"

#include <gtest/gtest.h>

namespace stillmap {
namespace {

/// Returns a run whose true path is 10 m long and closed, and whose estimate ends at `end`.
PaperRun run_ending_at(const std::string& preset, const Eigen::Vector3d& end) {
  PaperRun run{preset, "yard_dynamic", 0, Evaluation{}, 10 * end.x(), 0, ""};
  const Eigen::Vector3d origin(0, 0, 0), far(3, 4, 0);
  run.evaluation->ate.pairs = {
      {0, 0, origin, origin, 0}, {1, 1, far, far, 0}, {2, 2, origin, end, end.norm()}};
  run.evaluation->ate.translation.rmse = end.norm() / 2;
  run.evaluation->coverage = {3, 4, false};
  return run;
}

TEST(CraneTable, AveragesClosureErrorsAndComparesThemWithTheBaseline) {
  const std::vector<PaperRun> runs{run_ending_at("orb-rgbd", {0.3, 0.4, 1.2}),
                                   run_ending_at("orb-rgbd", {0.3, 0, 0}),
                                   run_ending_at("seg-mask", {0.06, 0.08, 0})};
  const FigureTable table = crane_table(find_paper("seg-mask"), runs);
  ASSERT_EQ(table.rows.size(), 2U);
  const auto shown = [&](std::size_t row, std::size_t column) {
    return table.rows[row][column].shown();
  };
  EXPECT_EQ(shown(0, 1), "orb-rgbd");
  EXPECT_EQ(shown(0, 2), "0.4000 (0.5000 0.3000)") << "mean, and each run in the plane";
  EXPECT_EQ(shown(0, 3), "-");
  EXPECT_EQ(shown(0, 4), "4.000") << "of a path of 10 m";
  EXPECT_EQ(shown(0, 5), "0.8000") << "mean of 1.3 m and 0.3 m in space";
  EXPECT_EQ(shown(0, 7), "75.0");
  EXPECT_EQ(shown(0, 8), "3.0") << "milliseconds of tracking";
  EXPECT_EQ(shown(1, 2), "0.1000");
  EXPECT_EQ(shown(1, 3), "75.00");
}

TEST(CraneTable, ComparesWithAnotherSystemOfWhichNoTimesAreKnown) {
  std::vector<PaperRun> runs{run_ending_at("orb-rgbd", {0.3, 0.4, 0}),
                             run_ending_at("ORB-SLAM3", {1, 0, 0})};
  runs.back().timed = false;
  const FigureTable table = crane_table(find_paper("seg-mask"), runs, "ORB-SLAM3");
  EXPECT_EQ(table.rows[0][3].shown(), "50.00");
  EXPECT_EQ(table.rows[0][8].shown(), "3.0");
  EXPECT_EQ(table.rows[1][3].shown(), "-") << "it is the reference";
  EXPECT_EQ(table.rows[1][8].shown(), "-");
}

TEST(CraneTable, ShowsDashesForRunsWithoutEvaluationAndWhatThePaperReports) {
  const std::vector<PaperRun> runs{{"seg-mask", "yard_static", 0, std::nullopt, 0, 0, "lost"}};
  const FigureTable table = crane_table(find_paper("seg-mask"), runs);
  ASSERT_EQ(table.rows.size(), 1U);
  EXPECT_EQ(table.rows[0][2].shown(), "-");
  ASSERT_EQ(table.notes.size(), 1U);
  EXPECT_NE(table.notes[0].find("Figure 9"), std::string::npos);
}

}  // namespace
}  // namespace stillmap
