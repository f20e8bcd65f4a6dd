// SPDX-License-Identifier: Apache-2.0
#include "stillmap/report/result_folder.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <array>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {
namespace fs = std::filesystem;

using ::testing::HasSubstr;

/// A temporary folder, removed at the end.
class Results : public ::testing::Test {
 protected:
  ~Results() override { fs::remove_all(folder_.parent_path()); }

  /// Simulates a run that writes these files and finishes.
  void run(const std::vector<std::string>& names,
           ResultFolder::Foreign foreign = ResultFolder::Foreign::kKeep) {
    ResultFolder results(folder_, foreign);
    for (const std::string& name : names) results.write_text(name, "written");
    results.remove_stale();
    results.require_all();
  }
  void put(const std::string& name, const std::string& content) {
    fs::create_directories((folder_ / name).parent_path());
    write_file(folder_ / name, content);
  }
  std::string content(const std::string& name) { return read_file(folder_ / name); }
  bool has(const std::string& name) { return fs::exists(folder_ / name); }

  const fs::path folder_ = test::own_path("results") / "run";
};

TEST_F(Results, FilesThatARunDoesNotWriteAgainAreRemoved) {
  run({"a.txt", "b.txt", "images/0.png", "images/1.png"});
  run({"b.txt", "images/1.png"});
  EXPECT_FALSE(has("a.txt"));
  EXPECT_TRUE(has("b.txt"));
  EXPECT_FALSE(has("images/0.png"));
  EXPECT_TRUE(has("images/1.png"));
  run({"b.txt"});
  EXPECT_FALSE(has("images")) << "an empty folder is removed";
}

TEST_F(Results, ForeignFilesAreNeitherRemovedNorOverwritten) {
  put("notes.txt", "mine");
  put("a.txt", "mine, too");
  run({"b.txt"});
  run({"c.txt"});
  EXPECT_EQ(content("notes.txt"), "mine");
  try {
    run({"a.txt", "c.txt"});
    FAIL() << "no Error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("a.txt"));
    EXPECT_THAT(e.what(), HasSubstr("--force"));
    EXPECT_THAT(e.what(), HasSubstr("--out"));
  }
  EXPECT_EQ(content("a.txt"), "mine, too");
  EXPECT_EQ(content("c.txt"), "written") << "the other files are written";
}

TEST_F(Results, ForceOverwritesForeignFilesAndFromThenOnTheyAreOwn) {
  put("a.txt", "mine");
  run({"a.txt"}, ResultFolder::Foreign::kOverwrite);
  EXPECT_EQ(content("a.txt"), "written");
  EXPECT_NO_THROW(run({"a.txt"}));
}

TEST_F(Results, ForeignFilesAreFoundBeforeTheRun) {
  put("a.txt", "mine");
  const std::array<std::string, 2> colliding{"b.txt", "a.txt"}, available{"b.txt", "c.txt"};
  EXPECT_THROW(ResultFolder(folder_).require_free(colliding), Error);
  EXPECT_NO_THROW(ResultFolder(folder_).require_free(available));
  EXPECT_NO_THROW(ResultFolder(folder_, ResultFolder::Foreign::kOverwrite).require_free(colliding));
}

TEST_F(Results, AFolderOfAnOlderVersionIsItsOwn) {
  put("summary.json", R"({"stillmap": "0.0.1"})");
  put("trajectory.txt", "old");
  put("mesh.ply", "old");
  put("notes.txt", "mine");
  run({"trajectory.txt", "summary.json"});
  EXPECT_EQ(content("trajectory.txt"), "written");
  EXPECT_FALSE(has("mesh.ply"));
  EXPECT_TRUE(has("notes.txt"));
}

TEST_F(Results, ASummaryOfAnotherProgramIsForeign) {
  put("summary.json", R"({"accuracy": 1})");
  put("trajectory.txt", "mine");
  EXPECT_THROW(run({"trajectory.txt"}), Error);
  EXPECT_EQ(content("trajectory.txt"), "mine");
}

TEST_F(Results, FilesOfARunThatWasCutShortAreItsOwn) {
  {
    ResultFolder results(folder_);
    results.write_text("a.txt", "half a run");  // no remove_stale(): the process ends here
  }
  EXPECT_NO_THROW(run({"b.txt"}));
  EXPECT_FALSE(has("a.txt"));
}

TEST_F(Results, AddingFilesKeepsTheOthers) {
  run({"a.txt"});
  {
    ResultFolder results(folder_);
    results.write_text("b.txt", "added");
    results.require_all();
  }
  EXPECT_TRUE(has("a.txt"));
  run({"b.txt"});
  EXPECT_FALSE(has("a.txt"));
}

TEST_F(Results, AfterAProblemNothingIsRemoved) {
  run({"a.txt"});
  ResultFolder results(folder_);
  results.write("b.txt", [](const fs::path& file) { throw Error("disk full", file, ""); });
  results.remove_stale();
  EXPECT_TRUE(has("a.txt"));
  EXPECT_THROW(results.require_all(), Error);
}

TEST_F(Results, TheListForTheUserSummarizesSubfolders) {
  ResultFolder results(folder_);
  for (const char* name : {"a.txt", "images/0.png", "images/1.png"}) results.write_text(name, "");
  const std::string text = results.written_text();
  EXPECT_THAT(text, HasSubstr((folder_ / "a.txt").string()));
  EXPECT_THAT(text, HasSubstr("images (2 files)"));
  EXPECT_THAT(text, ::testing::Not(HasSubstr("0.png")));
}

TEST_F(Results, AManifestReachesNoFileOutsideTheFolder) {
  run({"a.txt"});
  const fs::path outside = folder_.parent_path() / "outside.txt";
  write_file(outside, "mine");
  for (const std::string& name :
       {std::string("../outside.txt"), outside.string(), std::string("x/../../outside.txt")}) {
    put(kManifestName, R"({"files": [")" + name + R"("]})");
    EXPECT_THROW(run({"b.txt"}), Error) << name;
  }
  EXPECT_EQ(read_file(outside), "mine");
}

TEST_F(Results, ADamagedManifestIsNamed) {
  run({"a.txt"});
  put(kManifestName, R"({"files": ["a.t)");
  try {
    run({"a.txt"});
    FAIL() << "no Error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr(kManifestName));
  }
}

TEST_F(Results, DrawingsMakeRoomForResultsOnceTheDiskIsFull) {
  ResultFolder results(folder_);
  const auto draw = [](const fs::path& file) { write_file(file, "drawing"); };
  results.write_text("labels/text.txt", "no drawing");
  results.write_drawing("labels/0.png", draw);
  EXPECT_TRUE(has("labels/0.png"));
  results.write_drawing("labels/1.png", [](const fs::path& file) {
    throw Error("cannot be written (No space left on device)", file.string(), "");
  });
  results.write_drawing("labels/2.png", draw);
  EXPECT_FALSE(has("labels/0.png"));
  EXPECT_FALSE(has("labels/2.png"));
  EXPECT_TRUE(has("labels/text.txt"));
  results.write_text("trajectory.txt", "result");
  EXPECT_EQ(results.written().size(), 2U);
  try {
    results.require_all();
    ADD_FAILURE() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("1.png"));
    EXPECT_THAT(e.what(), HasSubstr("the drawings were removed"));
  }
}

TEST_F(Results, TheSpareFileStaysWhileTheDiskHasRoom) {
  ResultFolder results(folder_);
  results.write_text("run.journal", "journal");
  results.make_room_by("run.journal");
  results.write("trajectory.txt", [](const fs::path& file) {
    throw Error("cannot be written (Permission denied)", file.string(), "");
  });
  EXPECT_TRUE(has("run.journal"));
}

}  // namespace
}  // namespace stillmap
