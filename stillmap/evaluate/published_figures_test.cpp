#include "stillmap/evaluate/published_figures.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/evaluate/compare.hpp"

#include <algorithm>
#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(PublishedFigures, AreThoseOfFourPapersWithTheirSources) {
  ASSERT_EQ(papers().size(), 4U);
  for (const Paper& paper : papers()) {
    EXPECT_FALSE(paper.source.empty()) << paper.preset;
    EXPECT_FALSE(paper.authors.empty()) << paper.preset;
    EXPECT_EQ(paper.tables.front().measure, PaperMeasure::kAte) << paper.preset;
  }
  EXPECT_EQ(find_paper("box-flow").year, 2026);
}

TEST(PublishedFigures, AreReadFromTheirPlaceInTheTable) {
  const PublishedTable& table = find_paper("seg-mask").tables.front();
  EXPECT_EQ(table.value("walking_rpy", "SLAM3-YOLOv5", "sd"), 0.0739);
  EXPECT_EQ(table.value("walking_rpy", "SLAM3-YOLOv5", "median"), std::nullopt);
  EXPECT_EQ(table.value("sitting_rpy", "SLAM3-YOLOv5", "sd"), std::nullopt);
  const PublishedTable& dashes = find_paper("gated-seg").tables.front();
  EXPECT_EQ(dashes.value("sitting_rpy", "RDS-SLAM", "rmse"), std::nullopt);
}

TEST(PublishedFigures, NameOnlySequencesOfThePaperAndHaveAValuePerStatistic) {
  for (const Paper& paper : papers()) {
    for (const PublishedTable& table : paper.tables) {
      for (const auto& [sequence, row] : table.rows) {
        EXPECT_EQ(std::count(paper.sequences.begin(), paper.sequences.end(), sequence), 1);
        ASSERT_EQ(row.values.size(), table.systems.size());
        for (const auto& values : row.values)
          EXPECT_EQ(values.size(), table.statistics.size()) << paper.preset << " " << table.number;
      }
    }
  }
}

/// An error in a transcribed value changes the improvement rate that follows from it.
TEST(PublishedFigures, GiveTheImprovementRatesThatThePapersPrint) {
  int compared = 0;
  for (const Paper& paper : papers()) {
    for (const PublishedTable& table : paper.tables) {
      for (const auto& [sequence, row] : table.rows) {
        for (std::size_t i = 0; i < row.improvement.size(); ++i) {
          const std::string& statistic = table.statistics[i];
          const double rate = improvement_rate(*table.value(sequence, paper.baseline, statistic),
                                               *table.value(sequence, paper.system, statistic));
          EXPECT_NEAR(rate, row.improvement[i], 0.0051)
              << paper.preset << " " << table.number << " " << sequence << " " << statistic;
          ++compared;
        }
      }
    }
  }
  EXPECT_EQ(compared, 60);
}

TEST(PublishedFigures, OfTheImprovementTablesFollowFromTheAteTables) {
  int compared = 0;
  for (const Paper& paper : papers()) {
    const PublishedTable& ate = paper.tables.front();
    for (const PublishedTable& table : paper.tables) {
      if (table.measure != PaperMeasure::kAteImprovement) continue;
      for (const auto& [sequence, row] : table.rows) {
        const double rate = improvement_rate(*ate.value(sequence, paper.baseline, "rmse"),
                                             *ate.value(sequence, paper.system, "rmse"));
        // The paper of box-flow prints 95.26 where its values give 95.267.
        EXPECT_NEAR(rate, *table.value(sequence, paper.system, "rmse"), 0.0071) << sequence;
        ++compared;
      }
    }
  }
  EXPECT_EQ(compared, 10);
}

/// Returns the mean improvement rate of a statistic over the walking sequences, from rates that are
/// rounded as printed in the papers [%].
double walking_rate(const Paper& paper, const PublishedTable& table, const std::string& statistic) {
  double sum = 0;
  int count = 0;
  for (const auto& [sequence, row] : table.rows) {
    if (!sequence.starts_with("walking_")) continue;
    sum += std::round(100 * improvement_rate(*table.value(sequence, paper.baseline, statistic),
                                             *table.value(sequence, paper.system, statistic))) /
           100;
    ++count;
  }
  return sum / count;
}

TEST(PublishedFigures, OfTheAbstractsAreRemarkedAtTheTablesFromWhichTheyFollow) {
  struct Claim {
    const char *preset, *table, *statistic, *text;
    double value, tolerance;  // half of the last printed digit
  };
  constexpr double kHundredth = 0.0051, kTenth = 0.051, kOne = 0.51;
  for (const Claim& claim : {Claim{"seg-mask", "1", "rmse", "83.08 %", 83.08, kHundredth},
                             Claim{"seg-mask", "1", "sd", "83.36 %", 83.36, kHundredth},
                             Claim{"seg-mask", "2", "rmse", "42.97 %", 42.97, kHundredth},
                             Claim{"seg-mask", "2", "sd", "45.6 %", 45.6, kTenth},
                             Claim{"seg-mask", "3", "rmse", "27.35 %", 27.35, kHundredth},
                             Claim{"seg-mask", "3", "sd", "28.92 %", 28.92, kHundredth},
                             Claim{"box-flow", "2", "rmse", "94.60 %", 94.60, kHundredth},
                             Claim{"box-flow", "2", "mean", "95.03 %", 95.03, kHundredth},
                             Claim{"box-epipolar", "1", "rmse", "96.5 %", 96.5, kTenth},
                             Claim{"box-epipolar", "2", "rmse", "93 %", 93, kOne}}) {
    const Paper& paper = find_paper(claim.preset);
    const auto table = std::find_if(paper.tables.begin(), paper.tables.end(),
                                    [&](const auto& one) { return one.number == claim.table; });
    EXPECT_NE(table->remark.find(claim.text), std::string::npos) << claim.preset;
    EXPECT_NEAR(walking_rate(paper, *table, claim.statistic), claim.value, claim.tolerance)
        << claim.preset << " " << claim.table << " " << claim.statistic;
  }
}

/// The paper of box-flow compares its rates with those of other systems by their ratio.
TEST(PublishedFigures, OfBoxFlowOverOtherSystemsAreMeansOfRatios) {
  const Paper& paper = find_paper("box-flow");
  const PublishedTable& table = paper.tables.back();
  const auto gain_over = [&](const char* system) {
    double sum = 0;
    for (const auto& [sequence, row] : table.rows)
      sum += *table.value(sequence, paper.system, "rmse") / *table.value(sequence, system, "rmse");
    return 100 * (sum / static_cast<double>(table.rows.size()) - 1);
  };
  EXPECT_NEAR(gain_over("DynaSLAM"), 3.94, 0.0051);
  EXPECT_NEAR(gain_over("DS-SLAM"), 3.68, 0.0051);
}

TEST(PublishedFigures, OfAnUnknownPaperNameTheNearest) {
  EXPECT_NE(test::error_of([] { find_paper("seg-msk"); }).find("seg-mask"), std::string::npos);
}

}  // namespace
}  // namespace stillmap
