#include "stillmap/evaluate/figure_table.hpp"

#include <cmath>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

FigureTable small_table() {
  return {"errors [m]",
          {"sequence", "gain [%]"},
          {{"walking_xyz", {95.418, 2}}, {"still", {std::nullopt, 2}}},
          {"Mean of 3 runs."}};
}

TEST(FigureTable, IsAlignedInMarkdown) {
  EXPECT_EQ(table_markdown(small_table()),
            "**errors [m]**\n\n"
            "| sequence    | gain [%] |\n"
            "|-------------|---------:|\n"
            "| walking_xyz |    95.42 |\n"
            "| still       |        - |\n"
            "\nMean of 3 runs.\n");
}

TEST(FigureTable, IsEscapedInLatex) {
  EXPECT_EQ(table_latex(small_table()),
            "\\begin{table}\n\\caption{errors [m]}\n\\begin{tabular}{lr}\n\\hline\n"
            "sequence & gain [\\%] \\\\\n\\hline\n"
            "walking\\_xyz & 95.42 \\\\\nstill & - \\\\\n\\hline\n\\end{tabular}\n"
            "\nMean of 3 runs.\n\\end{table}\n");
}

TEST(FigureTable, EscapesTheNamesOfRuns) {
  const FigureTable table{"t", {"run", "a|b"}, {{"x|y", {1.0, 0}}, {"~^\\{}", {2.0, 0}}}, {}};
  const std::string markdown = table_markdown(table), latex = table_latex(table);
  EXPECT_NE(markdown.find("| x\\|y  |"), std::string::npos) << markdown;
  EXPECT_NE(markdown.find("a\\|b"), std::string::npos) << markdown;
  EXPECT_NE(latex.find("\\textasciitilde{}\\textasciicircum{}\\textbackslash{}\\{\\} & 2"),
            std::string::npos)
      << latex;
}

TEST(FigureCell, IsADashForAValueThatIsNotFinite) {
  EXPECT_EQ(FigureCell(NAN, 2).shown(), "-");
  EXPECT_EQ(FigureCell(0.00194, 4).shown(), "0.0019");
}

TEST(FigureCell, RoundsTiesOfDecimalNumbersUp) {
  EXPECT_EQ(FigureCell((83.35 + 83.36) / 2, 2).shown(), "83.36");
  EXPECT_EQ(FigureCell(-27.345, 2).shown(), "-27.35");
  EXPECT_EQ(FigureCell(83.3549, 2).shown(), "83.35");
}

}  // namespace
}  // namespace stillmap
