// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/finding.hpp"

#include "stillmap/base/finding_json.hpp"

#include <set>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

TEST(Finding, EveryKindHasACodeOfItsOwnAndAMeaning) {
  std::set<std::string_view> codes;
  for (const FindingKind& kind : kFindingKinds) {
    EXPECT_TRUE(codes.insert(kind.code).second) << kind.code;
    EXPECT_FALSE(kind.meaning.empty()) << kind.code;
    EXPECT_NE(kind.severity, Severity::kOk) << kind.code;
  }
}

TEST(Finding, HasTheSeverityOfItsKind) {
  const Finding note = make_finding("late-frames", "9 of 18 frames came late");
  const Finding wrong = make_finding("depth-factor", "depths are 5 times too large", "set 5000");
  EXPECT_EQ(note.severity, Severity::kNote);
  EXPECT_EQ(note.text(), "9 of 18 frames came late");
  EXPECT_EQ(wrong.severity, Severity::kUntrusted);
  EXPECT_EQ(wrong.text(), "depths are 5 times too large; set 5000");
  EXPECT_EQ(worst(std::vector{note, wrong}), Severity::kUntrusted);
  EXPECT_EQ(worst({}), Severity::kOk);
  EXPECT_EQ(findings_with(Severity::kNote, std::vector{wrong, note}), std::vector{note});
}

TEST(Finding, AMissingFloorSaysNothingAboutTheTrajectory) {
  const std::vector<Finding> findings{make_finding("floor-unknown", "the floor is unknown"),
                                      make_finding("path-gap", "20 frames have no pose")};
  EXPECT_EQ(findings_on_trajectory(findings), std::vector{findings[1]});
}

TEST(Finding, IsReadFromJsonAsItWasWritten) {
  const Finding finding =
      make_finding("focal-length", "525 pixels are given", "calibrate", {{"given_px", 525}});
  EXPECT_EQ(nlohmann::json(finding).get<Finding>(), finding);
  EXPECT_EQ(nlohmann::json(finding).at("severity"), "untrusted");
  EXPECT_TRUE(nlohmann::json(make_finding("path-gap", "20 frames")).at("fix").is_null());
}

}  // namespace
}  // namespace stillmap
