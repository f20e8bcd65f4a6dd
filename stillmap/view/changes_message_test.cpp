// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/changes_message.hpp"

#include "stillmap/base/test_error.hpp"
#include "stillmap/pipeline/map_changes.hpp"
#include "stillmap/recording/test_recording.hpp"

#include <filesystem>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using test::TestFolder;
using ::testing::AllOf;
using ::testing::HasSubstr;

/// Returns a surface of one point, which is 1 m above the low corner of its box.
ChangedSurface surface(double x) {
  const Eigen::Vector3d low(x, 0, 0), high = low.array() + 1;
  return {{high.cast<float>()}, {low, high}, "chair"};
}

/// Something that went, appeared, and moved.
MapChanges found() {
  MapChanges changes;
  changes.before.name = "monday";
  changes.after.name = "friday";
  changes.changes = {{surface(1), {}}, {{}, surface(2)}, {surface(3), surface(4)}};
  return changes;
}

/// Writes what `stillmap map changes` writes, with another text of changes.json.
std::filesystem::path written(const TestFolder& folder, const std::string& json) {
  folder.write("changes.json", json);
  write_ply(folder.path("changes.ply"), changes_cloud(found()));
  for (const char* name : {"after.ply", "after.txt"}) folder.write(name, "");
  return folder.path("");
}

TEST(ChangesMessage, HasTheBoxesOfBothVisitsAndThePointsOfTheEarlierOne) {
  const TestFolder folder;
  const auto message = changes_message(written(folder, changes_json(found()).dump()));
  EXPECT_EQ(message["before"], "monday");
  EXPECT_EQ(message["after"], "friday");
  const auto box = [](double x) {
    return nlohmann::json{{"min", {x, 0.0, 0.0}}, {"max", {x + 1, 1.0, 1.0}}};
  };
  const nlohmann::json& changes = message["changes"];
  ASSERT_EQ(changes.size(), 3);
  EXPECT_EQ(changes[0], (nlohmann::json{{"kind", "went"}, {"class", "chair"}, {"before", box(1)}}));
  EXPECT_EQ(changes[1],
            (nlohmann::json{{"kind", "appeared"}, {"class", "chair"}, {"after", box(2)}}));
  EXPECT_EQ(changes[2]["before"], box(3));
  EXPECT_EQ(changes[2]["after"], box(4));
  EXPECT_EQ(message["went"], (std::vector<double>{2, 1, 1}));
  EXPECT_EQ(message["from"], (std::vector<double>{4, 1, 1}));
}

TEST(ChangesMessage, DamagedOrMissingFilesAreErrorsWithAFix) {
  const TestFolder folder;
  const auto error = [&] { return test::error_of([&] { changes_message(folder.path("")); }); };
  const auto fix = HasSubstr("run `stillmap map changes` again");
  auto json = changes_json(found());
  json["changes"][0]["before"]["min"] = {0, 1};
  for (const std::string& text : {std::string("{"), std::string("[]"), json.dump()}) {
    written(folder, text);
    EXPECT_THAT(error(), AllOf(HasSubstr("changes.json"), fix)) << text;
  }
  json["changes"][0].erase("before");
  written(folder, json.dump());
  EXPECT_THAT(error(), AllOf(HasSubstr("'before' not found"), fix));
  std::filesystem::remove(folder.path("after.ply"));
  EXPECT_THAT(error(), AllOf(HasSubstr("has no after.ply"), fix));
}

}  // namespace
}  // namespace stillmap
