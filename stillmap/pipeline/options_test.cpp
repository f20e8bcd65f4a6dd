// SPDX-License-Identifier: Apache-2.0
#include "stillmap/pipeline/options.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

namespace stillmap {
namespace {

using ::testing::HasSubstr;

std::string error_of(const std::string& assignment) {
  SlamOptions options;
  try {
    set_option(assignment, options);
  } catch (const Error& e) {
    return e.what();
  }
  return "";
}

TEST(Options, AreOverriddenByName) {
  SlamOptions options;
  set_option("orb.keypoints=1500", options);
  set_option("places.relocalizer.wide.radius=7.5", options);
  set_option("motion.preset=static", options);
  set_option("dense_cloud=false", options);
  set_option("motion.semantic.classes.dynamic=person,dog", options);
  EXPECT_EQ(options.orb.keypoints, 1500);
  EXPECT_EQ(options.places.relocalizer.wide.radius, 7.5);
  EXPECT_EQ(options.motion.preset, "static");
  EXPECT_FALSE(options.dense_cloud);
  EXPECT_EQ(options.motion.semantic.classes.dynamic, (std::vector<std::string>{"person", "dog"}));
}

TEST(Options, AnUnknownNameSuggestsTheNearest) {
  EXPECT_THAT(error_of("orb.keypoint=1"), HasSubstr("there is no option 'orb.keypoint'"));
  EXPECT_THAT(error_of("orb.keypoint=1"), HasSubstr("did you mean 'keypoints'?"));
  EXPECT_THAT(error_of("tracking.min_inliers=1"), HasSubstr("did you mean 'tracker'?"));
}

TEST(Options, AValueOfTheWrongKindIsAnError) {
  EXPECT_THAT(error_of("orb.keypoints=many"), HasSubstr("wants a whole number"));
  EXPECT_THAT(error_of("dense_cloud=perhaps"), HasSubstr("wants true or false"));
  EXPECT_THAT(error_of("orb=3"), HasSubstr("orb holds further options"));
  EXPECT_THAT(error_of("orb.keypoints"), HasSubstr("is no assignment"));
  EXPECT_THAT(error_of("schedule.mode=sometimes"), HasSubstr("'lockstep' or 'realtime'"));
}

class OptionsFile : public ::testing::Test {
 protected:
  std::filesystem::path file_ = test::own_path("options.yaml");
  void TearDown() override { std::filesystem::remove(file_); }
};

TEST_F(OptionsFile, WhatIsDumpedReadsBackTheSame) {
  SlamOptions written;
  written.orb.keypoints = 777;
  written.mapper.fusion.radius = 0.1;  // no finite binary fraction
  written.motion.semantic.classes.dynamic = {"person", "hand truck"};
  write_file(file_, options_yaml(written));
  SlamOptions read;
  load_options(file_, read);
  EXPECT_EQ(options_json(read), options_json(written));
}

TEST_F(OptionsFile, NamesTheLineOfAMistake) {
  write_file(file_, "orb:\n  keypoints: 500\n  color: red\n");
  SlamOptions options;
  try {
    load_options(file_, options);
    FAIL() << "no error";
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("options.yaml:3: there is no option 'orb.color'"));
  }
}

TEST_F(OptionsFile, SaysWhatIsNoYaml) {
  write_file(file_, "orb: [1, 2\n");
  SlamOptions options;
  EXPECT_THROW(load_options(file_, options), Error);
  EXPECT_THROW(load_options("/nonexistent.yaml", options), Error);
}

}  // namespace
}  // namespace stillmap
