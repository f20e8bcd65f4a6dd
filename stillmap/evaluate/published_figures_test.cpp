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

TEST(PublishedFigures, OfAnUnknownPaperNameTheNearest) {
  EXPECT_NE(test::error_of([] { find_paper("seg-msk"); }).find("seg-mask"), std::string::npos);
}

}  // namespace
}  // namespace stillmap
