// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/live_changes.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/pipeline/visits_test.hpp"

#include <filesystem>
#include <set>
#include <sstream>
#include <string>
#include <vector>

#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

/// Returns a frame of a path that takes eight times as long, so that there are three comparisons.
RgbdFramePtr slower(const RgbdFrame& frame) {
  auto slow = std::make_shared<RgbdFrame>(frame);
  slow->timestamp *= 8;
  return slow;
}

struct Told {
  std::string file;
  std::vector<std::string> shown;
};

/// Maps a second visit in the map of the first one.
Told told_of(const std::string& visit) {
  static const SavedMap first = visits::run(visits::visit("xyz")).map;
  const SlamParameters options = recorded::small_options("static");
  const std::filesystem::path out = test::own_path("changes");
  ResultFolder folder(out);
  Told told;
  SlamSystem slam(visits::visit(visit).camera(), options, nullptr, StartingMap{first, true});
  LiveChanges changes(slam, options, folder,
                      [&](const std::string& line) { told.shown.push_back(line); });
  for (const auto& frame : visits::visit(visit).frames) {
    slam.push(slower(*frame));
    changes.on_frame(slam);
  }
  RunRecord record;
  changes.on_last_frame(record);
  told.file = read_file(out / kLiveChanges);
  std::filesystem::remove_all(out);
  return told;
}

TEST(LiveChanges, TellEachObjectOnceAndTheSameInEveryRun) {
  const Told told = told_of("rearranged");
  std::multiset<std::string> kinds;
  std::set<double> times;
  std::istringstream lines(told.file);
  for (std::string line; std::getline(lines, line);) {
    const auto change = nlohmann::json::parse(line);
    kinds.insert(change.at("kind").get<std::string>());
    times.insert(change.at("timestamp").get<double>());
  }
  EXPECT_EQ(kinds, (std::multiset<std::string>{"appeared", "went", "went"})) << told.file;
  EXPECT_EQ(told.shown.size(), kinds.size());
  EXPECT_LT(*times.begin(), 21) << "by the second comparison";
  EXPECT_EQ(told.file, told_of("rearranged").file);
}

TEST(LiveChanges, AreNoneOnAnotherPath) {
  const Told told = told_of("slower");
  EXPECT_EQ(told.file, "");
  EXPECT_TRUE(told.shown.empty());
}

}  // namespace
}  // namespace stillmap
