// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/compare.hpp"

#include <algorithm>
#include <cmath>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

/// Returns a loop in the x-z plane of a world with y down.
Trajectory loop() {
  Trajectory trajectory;
  for (int i = 0; i < 200; ++i) {
    const double t = i / 30.0;
    trajectory.push_back({t, Pose(so3_exp({0, 0.2 * std::sin(t), 0}),
                                  {std::sin(t), 0.2 * std::sin(3 * t), 0.7 * std::cos(t)})});
  }
  return trajectory;
}

/// Returns the loop with a wobble of the given size; errors grow in proportion to it.
Trajectory wobbling(double size) {
  Trajectory trajectory = loop();
  for (auto& [t, T] : trajectory) {
    T = Pose(T.quaternion(),
             T.translation() + size * Eigen::Vector3d(std::sin(9 * t), 0, std::cos(7 * t)));
  }
  return trajectory;
}

std::vector<RecordedRun> two_systems() {
  return {{"static", "walk", wobbling(0.08), loop(), 200},
          {"seg-mask", "walk", wobbling(0.02), loop(), 200}};
}

TEST(ImprovementRate, IsEquation4) {
  EXPECT_DOUBLE_EQ(improvement_rate(0.2837, 0.0130), (0.2837 - 0.0130) / 0.2837 * 100);
  EXPECT_DOUBLE_EQ(improvement_rate(1, 2), -100);
  EXPECT_TRUE(std::isnan(improvement_rate(0, 1)));
}

TEST(Compare, TheTablesOfTheDemoFitIntoATerminal) {
  const std::vector<RecordedRun> runs{{"static", "", wobbling(0.08), loop(), 200},
                                      {"seg-mask", "", wobbling(0.02), loop(), 200},
                                      {"fused", "", wobbling(0.01), loop(), 200}};
  std::istringstream lines(comparison_markdown(compare_runs(runs)));
  for (std::string line; std::getline(lines, line);) EXPECT_LE(line.size(), 80U) << line;
}

TEST(Compare, MeasuresImprovementAgainstTheFirstRunOfTheSequence) {
  std::vector<RecordedRun> runs = two_systems();
  runs.push_back({"static", "sit", wobbling(0.01), loop(), 250});
  runs.push_back({"seg-mask", "sit", wobbling(0.02), loop(), 200});
  const Comparison comparison = compare_runs(runs);
  const nlohmann::json json = comparison;
  const auto improvement = [&json](int i) {
    return json.at("runs").at(i).at("improvement_percent").at("ate_translation").at("rmse");
  };
  EXPECT_FALSE(json.at("runs").at(0).contains("improvement_percent"));
  EXPECT_NEAR(improvement(1).get<double>(), 75, 1);  // a quarter of the error
  EXPECT_FALSE(json.at("runs").at(2).contains("improvement_percent"));
  EXPECT_NEAR(improvement(3).get<double>(), -100, 5);
  const std::string text = comparison_markdown(comparison);
  EXPECT_THAT(text, HasSubstr("| seg-mask  walk |"));
  EXPECT_THAT(text, HasSubstr("200/250"));
  EXPECT_THAT(text, HasSubstr("only 80 % of the frames have a pose"));
}

TEST(Compare, DoubtsOfARunAreRepeatedInAllTables) {
  std::vector<RecordedRun> runs = two_systems();
  runs[1].findings = {make_finding("low-coverage", "the floor, say, was not seen")};
  const Comparison comparison = compare_runs(runs);
  EXPECT_THAT(texts_of(findings_of(comparison)),
              ::testing::ElementsAre("seg-mask, walk: the floor, say, was not seen"));
  for (const FigureTable& table : comparison_tables(comparison)) {
    EXPECT_EQ(table.rows.at(0).at(0).shown(), "static  walk");
    EXPECT_EQ(table.rows.at(1).at(0).shown(), "seg-mask  walk (untrusted)");
  }
  for (const std::string& text : {comparison_markdown(comparison), comparison_latex(comparison)})
    EXPECT_THAT(text, HasSubstr("trust this result: seg-mask, walk: the floor, say, was not seen"));
  EXPECT_THAT(comparison_csv(comparison), HasSubstr(",\"the floor, say, was not seen\"\n"));
  const nlohmann::json json = comparison;
  EXPECT_TRUE(json.at("runs").at(0).at("findings").empty());
  EXPECT_EQ(json.at("runs").at(1).at("findings").at(0).at("message"),
            "the floor, say, was not seen");
}

TEST(Compare, AnErrorOfMoreThanTwiceTheBaselinesIsShownAsARatio) {
  std::vector<RecordedRun> runs = two_systems();
  runs[0].estimate = wobbling(0.002);
  runs.push_back({"slightly", "walk", wobbling(0.0036), loop(), 200});
  const auto tables = comparison_tables(compare_runs(runs));
  EXPECT_THAT(tables[0].rows[1][2].shown(), ::testing::MatchesRegex("(9\\.[0-9]|1[01]) x worse"));
  EXPECT_NEAR(tables[0].rows[2][2].value.value(), -80, 5);
}

TEST(Compare, RunsShorterThanASecondAreComparedByTheirAbsoluteErrors) {
  std::vector<RecordedRun> runs = two_systems();
  for (RecordedRun& run : runs) run.estimate.resize(25), run.truth.resize(25);
  const Comparison comparison = compare_runs(runs);
  const nlohmann::json compared = nlohmann::json(comparison).at("runs").at(1);
  EXPECT_GT(compared.at("improvement_percent").at("ate_translation").at("rmse"), 50);
  EXPECT_TRUE(compared.at("improvement_percent").at("rpe_1s_translation").at("rmse").is_null());
  EXPECT_TRUE(compared.at("rpe_1s").is_null());
  EXPECT_EQ(comparison_tables(comparison).at(1).rows.at(1).at(1).shown(), "-");
}

TEST(Compare, ARunThatCannotBeEvaluatedKeepsItsPlaceWithTheReason) {
  std::vector<RecordedRun> runs = two_systems();
  for (auto& pose : runs[1].estimate) pose.timestamp += 1000;
  runs.push_back({"third", "walk", wobbling(0.01), loop(), 200});
  const Comparison comparison = compare_runs(runs);
  EXPECT_FALSE(comparison.runs[1].evaluation.has_value());
  EXPECT_THAT(comparison_markdown(comparison), HasSubstr("do not overlap in time"));
  EXPECT_TRUE(nlohmann::json(comparison).at("runs").at(1).contains("problem"));
}

TEST(Compare, TheTableOfCommaSeparatedValuesHasALinePerRunAndError) {
  std::vector<RecordedRun> runs = two_systems();
  runs[1].name = "mask, \"dilated\"";
  for (RecordedRun& run : runs) run.sequence = "";
  const Comparison comparison = compare_runs(runs);
  std::istringstream csv(comparison_csv(comparison));
  std::vector<std::string> lines;
  for (std::string line; std::getline(csv, line);) lines.push_back(line);
  ASSERT_EQ(lines.size(), 7U);  // head, two runs with three errors each
  EXPECT_THAT(lines[1], ::testing::StartsWith("static,,ate_translation,0."));
  EXPECT_THAT(lines[1], ::testing::EndsWith(",,,,,200,200,200,")) << "the baseline has no rates";
  EXPECT_THAT(lines[2], ::testing::StartsWith("\"mask, \"\"dilated\"\"\",,ate_translation,0."));
  const auto commas = [](const std::string& line) { return std::ranges::count(line, ','); };
  EXPECT_EQ(commas(lines[1]), commas(lines[0]));
  runs[1].estimate.clear();
  const std::string failed = comparison_csv(compare_runs(runs));
  EXPECT_THAT(failed, HasSubstr("ate_translation,,,,,,,,,,,,,\"cannot be evaluated: "));
}

}  // namespace
}  // namespace stillmap
