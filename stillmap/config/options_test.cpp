// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/config/option_values.hpp"
#include "stillmap/config/preset_files.hpp"
#include "stillmap/config/write_options.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <set>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

constexpr int kMostOptions = 60;

std::string error_of_setting(const std::string& assignment) {
  Options options;
  return error_of([&] { set_option(assignment, options); });
}

std::string read_source(const std::string& file) {
  return read_file(std::filesystem::path(STILLMAP_SOURCE_DIR) / file);
}

/// Text without comment signs and line breaks, each run of blanks as one.
std::string flattened(const std::string& text) {
  std::istringstream words(text);
  std::string flat;
  for (std::string word; words >> word;) {
    if (word != "///") flat += " " + word;
  }
  return flat;
}

TEST(OptionTable, HoldsNoMoreThanAUserCanOverlook) {
  int count = 0;
  const Options options;
  visit_options(options, [&](const OptionInfo&, const auto&) { ++count; });
  EXPECT_LE(count, kMostOptions);
}

TEST(OptionTable, ListsEveryOptionOnceByGroupAndName) {
  std::set<std::string> paths;
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto&) {
    EXPECT_EQ(std::count(info.path.begin(), info.path.end(), '.'), 1) << info.path;
    EXPECT_TRUE(paths.insert(info.path).second) << info.path;
  });
}

TEST(OptionTable, ExplainsEveryOptionInAWholeSentence) {
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto&) {
    EXPECT_TRUE(info.sentence.ends_with(".")) << info.path;
    EXPECT_TRUE(std::isupper(info.sentence.front()) || info.sentence.starts_with("lockstep"))
        << info.path;
  });
}

TEST(OptionTable, HasARangeForEveryNumberThatContainsTheDefault) {
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto& value) {
    if constexpr (is_number<std::decay_t<decltype(value)>>) {
      EXPECT_LT(info.range.lowest, info.range.highest) << info.path;
    }
    EXPECT_FALSE(range_problem(info, value)) << info.path;
  });
}

TEST(OptionTable, AgreesWithThePublicHeader) {
  const std::string header = flattened(read_source("stillmap/options.hpp"));
  const Options options;
  visit_options(options, [&](const OptionInfo& info, const auto&) {
    EXPECT_THAT(header, HasSubstr(flattened(info.sentence))) << info.path;
  });
}

TEST(OptionTable, IsTheDocumentation) {
  EXPECT_EQ(read_source("docs/options.md"), options_markdown())
      << "out of date: run `stillmap options --markdown > docs/options.md`";
}

TEST(Options, OutsideTheirRangeAreRefusedWithTheRange) {
  EXPECT_THAT(error_of_setting("features.keypoints=5"),
              HasSubstr("option features.keypoints is 5: it must be from 50 to 10000"));
  EXPECT_THAT(error_of_setting("dense.voxel=0"), HasSubstr("it must be from 0.001 to 1 [m]"));
  EXPECT_THAT(error_of_setting("dense.voxel=.nan"), HasSubstr("it must be from 0.001 to 1 [m]"));
  EXPECT_THAT(error_of_setting("schedule.mode=sometimes"),
              AllOf(HasSubstr("is 'sometimes': it must be one of lockstep, realtime"),
                    HasSubstr("fix: give one of these words")));
  EXPECT_THAT(error_of_setting("motion.cues=semantic,magic"),
              AllOf(HasSubstr("has the item 'magic'"), HasSubstr("epipolar")));
}

/// Every number just outside either end of its range.
TEST(Options, AreAllCheckedWhereTheyWereNotRead) {
  Options options;
  visit_options(options, [&](const OptionInfo& info, auto& value) {
    using Value = std::decay_t<decltype(value)>;
    if constexpr (is_number<Value>) {
      const Value before = value;
      for (const double outside : {info.range.lowest - 1, info.range.highest + 1}) {
        value = static_cast<Value>(outside);
        EXPECT_THAT(error_of([&] { check_options(options); }),
                    AllOf(HasSubstr(info.path), HasSubstr(range_text(info))));
      }
      value = before;
    }
  });
  EXPECT_NO_THROW(check_options(options));
}

TEST(Options, ThatContradictEachOtherAreRefused) {
  Options heights;
  heights.outputs.planner_lowest = heights.outputs.planner_highest;
  EXPECT_THAT(error_of([&] { check_options(heights); }), HasSubstr("planner_highest"));
  Options delays;
  delays.schedule.insert_delay = delays.schedule.refine_delay + 1;
  EXPECT_THAT(error_of([&] { check_options(delays); }), HasSubstr("schedule.refine_delay"));
}

TEST(Options, AreSetByName) {
  Options options;
  set_option("features.keypoints=1500", options);
  set_option("dense.voxel=0.02", options);
  set_option("dense.enabled=false", options);
  set_option("network.model=a=b,c.onnx", options);
  set_option("motion.moving_classes=person,dining table", options);
  set_option("motion.cues=", options);
  EXPECT_EQ(options.features.keypoints, 1500);
  EXPECT_EQ(options.dense.voxel, 0.02);
  EXPECT_FALSE(options.dense.enabled);
  EXPECT_EQ(options.network.model, "a=b,c.onnx");
  EXPECT_EQ(options.motion.moving_classes, (std::vector<std::string>{"person", "dining table"}));
  EXPECT_TRUE(options.motion.cues.empty());
}

TEST(Options, AListIsAYamlListOrItsItemsWithCommas) {
  const std::vector<std::string> expected{"person", "dining table"};
  for (const char* list : {"[person, dining table]", " [ person, 'dining table' ]",
                           "person, dining table", "person,dining table"}) {
    Options options;
    set_option(std::string("motion.moving_classes=") + list, options);
    EXPECT_EQ(options.motion.moving_classes, expected) << list;
  }
  EXPECT_THAT(error_of_setting("motion.moving_classes=[person"), HasSubstr("is not a YAML list"));
  EXPECT_THAT(error_of_setting("motion.moving_classes=[[person]]"), HasSubstr("expected list"));
}

TEST(Options, AnUnknownNameSuggestsTheNearest) {
  EXPECT_THAT(error_of_setting("features.keypoint=1"),
              AllOf(HasSubstr("there is no option 'features.keypoint'"),
                    HasSubstr("did you mean 'keypoints'?")));
  EXPECT_THAT(error_of_setting("orb.keypoints=1"), HasSubstr("did you mean 'features.keypoints'?"));
  EXPECT_THAT(error_of_setting("densee.enabled=1"), HasSubstr("did you mean 'dense.enabled'?"));
  EXPECT_THAT(error_of_setting("mover.enabled=1"), HasSubstr("did you mean 'movers.enabled'?"));
  EXPECT_THAT(error_of_setting("tracing.speed=1"), HasSubstr("did you mean 'tracking'?"));
}

TEST(Options, AValueOfTheWrongTypeIsAnError) {
  EXPECT_THAT(error_of_setting("features.keypoints=many"), HasSubstr("expected whole number"));
  EXPECT_THAT(error_of_setting("features.keypoints=100.5"), HasSubstr("expected whole number"));
  EXPECT_THAT(error_of_setting("dense.enabled=perhaps"), HasSubstr("true or false"));
  EXPECT_THAT(error_of_setting("features=3"), HasSubstr("features is a group of options"));
  EXPECT_THAT(error_of_setting("features.keypoints"),
              HasSubstr("is not of the form group.name=value"));
  EXPECT_THAT(error_of_setting("preset=static"), HasSubstr("--preset NAME"));
  EXPECT_THAT(error_of_setting("features.keypoints=many"),
              HasSubstr("option 'features.keypoints=many': "));
}

class OptionFile : public ::testing::Test {
 protected:
  std::filesystem::path file_ = test::own_path("options.yaml");
  void TearDown() override { std::filesystem::remove(file_); }
  std::string error_of_reading(const std::string& text, const std::string& preset = "") {
    write_file(file_, text);
    return error_of([&] { read_options(preset, file_); });
  }
};

TEST_F(OptionFile, ThatIsWrittenReadsBackTheSame) {
  Options written = read_options("box-epipolar");  // with long lists, and names of two words
  written.features.keypoints = 777;
  written.dense.voxel = 0.1;  // no finite binary fraction
  written.network.model = "folder: of #1/net.onnx";
  written.motion.cues.clear();
  write_file(file_, options_yaml(written));
  EXPECT_EQ(options_json(read_options("", file_)), options_json(written));
}

TEST_F(OptionFile, ExplainsEveryOptionInAComment) {
  const std::string text = options_yaml(Options());
  EXPECT_THAT(text, HasSubstr("  # Maximum number of keypoints per image, over all pyramid levels. "
                              "Range: 50 to 10000. Default:\n  # 1000.\n  keypoints: 1000\n"));
  EXPECT_THAT(text, HasSubstr("Unit: m. Range: 0.001 to 1. Default: 0.01."));
  EXPECT_THAT(text, HasSubstr("Words: lockstep, realtime. Default: lockstep."));
}

TEST_F(OptionFile, NamesTheLineOfAMistake) {
  EXPECT_THAT(error_of_reading("features:\n  keypoints: 500\n  color: red\n"),
              HasSubstr("options.yaml:3: there is no option 'features.color'"));
  EXPECT_THAT(error_of_reading("features:\n  keypoints: 5\n"),
              HasSubstr("options.yaml:2: option features.keypoints is 5"));
  EXPECT_THAT(error_of_reading("preset: fused\norb:\n  keypoints: 500\n"),
              HasSubstr("options.yaml:2: there is no option 'orb'"));
  EXPECT_THAT(error_of_reading("features: 3\n"), HasSubstr("features is a group of options"));
}

TEST_F(OptionFile, WithARepeatedKeyIsAnErrorThatNamesItsLine) {
  EXPECT_THAT(error_of_reading("features:\n  levels: 4\n  keypoints: 500\n  levels: 5\n"),
              HasSubstr("options.yaml:4: the key 'levels' is given twice"));
  EXPECT_THAT(error_of_reading("features:\n  levels: 4\nfeatures:\n  keypoints: 500\n"),
              HasSubstr("options.yaml:3: the key 'features' is given twice"));
  EXPECT_THAT(error_of_reading("preset: fused\npreset: static\n"),
              HasSubstr("options.yaml:2: the key 'preset' is given twice"));
}

TEST_F(OptionFile, WithAFlatNameOfAnOptionSaysHowToNestIt) {
  EXPECT_THAT(error_of_reading("features.keypoints: 500\n"),
              AllOf(HasSubstr("options.yaml:1: option features.keypoints is outside its group"),
                    HasSubstr("write 'features:' and in the next line '  keypoints: VALUE'")));
}

TEST_F(OptionFile, ThatIsNoYamlIsAnError) {
  EXPECT_THAT(error_of_reading("features: [1, 2\n"), HasSubstr("is not YAML"));
  EXPECT_THAT(error_of_reading("just words\n"), HasSubstr("holds no groups of options"));
  EXPECT_THROW(read_options("", "/nonexistent.yaml"), Error);
}

TEST_F(OptionFile, StartsFromThePresetThatItNames) {
  write_file(file_, "preset: seg-mask\nfeatures:\n  keypoints: 500\n");
  const Options options = read_options("", file_);
  EXPECT_EQ(options.preset(), "seg-mask");
  EXPECT_EQ(options.motion.cues, (std::vector<std::string>{"semantic"}));
  EXPECT_EQ(options.features.keypoints, 500);
}

TEST_F(OptionFile, OverridesThePresetThatWasChosen) {
  write_file(file_, "motion:\n  cues: [epipolar]\n");
  const Options options = read_options("seg-mask", file_);
  EXPECT_EQ(options.preset(), "seg-mask");
  EXPECT_EQ(options.motion.cues, (std::vector<std::string>{"epipolar"}));
}

TEST_F(OptionFile, WithAnotherPresetThanTheChosenOneIsAnError) {
  EXPECT_THAT(error_of_reading("preset: fused\n", "static"),
              HasSubstr("is based on preset fused, but preset static was chosen"));
}

TEST_F(OptionFile, OfAFormerVersionIsReadIfItHasTheValueThatIsLeft) {
  EXPECT_EQ(error_of_reading("network:\n  nms_iou: 0.7\n  threads: 2\n"), "");
  EXPECT_EQ(read_options("", file_).network.threads, 2);
  EXPECT_THAT(error_of_reading("network:\n  nms_iou: 0.5\n"), HasSubstr("there is no option"));
  EXPECT_EQ(error_of_reading("tracking:\n  odometry_fallback: true\n"), "");
}

TEST_F(OptionFile, ThatSetsEverythingNeedsNoPreset) {
  std::string text = options_yaml(Options());
  const std::string line = "preset: fused\n";
  text.replace(text.find(line), line.size(), "preset: gone.yaml\n");
  write_file(file_, text);
  EXPECT_EQ(read_options("", file_).preset(), "gone.yaml");
  EXPECT_THAT(error_of_reading("preset: gone.yaml\n"), HasSubstr("gone.yaml"));
}

TEST(Presets, ThatAreInstalledLoadAndHaveADescription) {
  EXPECT_EQ(shipped_presets().size(), 7U);
  for (const Preset& preset : presets()) {
    EXPECT_FALSE(preset.description.empty()) << preset.name;
    EXPECT_EQ(read_options(preset.name).preset(), preset.name);
  }
}

TEST(Presets, FusedIsTheDefault) {
  EXPECT_EQ(options_json(read_options("fused")), options_json(Options()));
}

TEST(Presets, AnUnknownNameSuggestsTheNearest) {
  const std::string error = error_of([] { read_options("segmask"); });
  EXPECT_THAT(error, AllOf(HasSubstr("preset 'segmask': "), HasSubstr("did you mean 'seg-mask'?")));
  EXPECT_THAT(error, testing::Not(HasSubstr("--preset")));
}

TEST_F(OptionFile, MayBeAPreset) {
  write_file(file_, "# Mine.\nfeatures:\n  levels: 4\n");
  EXPECT_EQ(read_options(file_.string()).features.levels, 4);
}

TEST_F(OptionFile, AsAPresetMayBeBasedOnAnotherOne) {
  write_file(file_, "preset: seg-mask\ntracking:\n  min_inliers: 40\n");
  const Options options = read_options(file_.string());
  EXPECT_EQ(options.tracking.min_inliers, 40);
  EXPECT_EQ(options.motion.cues, std::vector<std::string>{"semantic"});
  EXPECT_TRUE(options.tracking.extensions.empty());  // seg-mask is itself based on orb-rgbd
}

TEST_F(OptionFile, AsAPresetCannotBeBasedOnItself) {
  write_file(file_, "preset: " + file_.string() + "\n");
  EXPECT_THAT(error_of([&] { read_options(file_.string()); }),
              AllOf(HasSubstr(file_.string() + ":1"), HasSubstr("is based on itself")));
}

TEST(Presets, OfTheUsersOwnFolderComeFirst) {
  const auto folder = test::own_path("presets");
  std::filesystem::create_directories(folder);
  write_file(folder / "static.yaml", "# Mine.\nfeatures:\n  levels: 4\n");
  write_file(folder / "crane.yaml", "# High up.\nfeatures:\n  levels: 5\n");
  setenv("STILLMAP_PRESETS", folder.c_str(), 1);
  EXPECT_EQ(read_options("static").features.levels, 4);
  EXPECT_EQ(read_options("crane").features.levels, 5);
  EXPECT_EQ(presets().size(), 8U);
  EXPECT_THAT(presets_text(), HasSubstr("High up."));
  unsetenv("STILLMAP_PRESETS");
  EXPECT_EQ(read_options("static").features.levels, 8);
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace stillmap
