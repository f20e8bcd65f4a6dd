// SPDX-License-Identifier: Apache-2.0
#include "stillmap/evaluate/motion_labels.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"

#include <filesystem>
#include <limits>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

class LabelFiles : public ::testing::Test {
 protected:
  void SetUp() override { fs::create_directories(folder_); }
  void TearDown() override { fs::remove_all(folder_); }
  std::vector<LabeledFrame> read_back(const std::string& bytes) const {
    write_file(file_, bytes);
    return read_labels(file_);
  }
  std::string problem_with(const std::string& bytes) const {
    try {
      read_back(bytes);
    } catch (const Error& e) {
      return e.what();
    }
    return "";
  }

  const fs::path folder_ = test::own_path("verdicts");
  const fs::path file_ = folder_ / "verdicts.bin";
};

TEST_F(LabelFiles, AreReadAsTheyWereWritten) {
  LabelFile file;
  file.add({7, 1311868164.363181, {{12.34F, 456.78F, 2.3456F, -1.2345F, 0.5F}, {0, 0, 0, 3, 1}}});
  file.add({8, 1311868164.399, {}});
  const auto frames = read_back(file.bytes());
  ASSERT_EQ(frames.size(), 2U);
  EXPECT_EQ(frames[0].index, 7U);
  EXPECT_EQ(frames[0].timestamp, 1311868164.363181);
  ASSERT_EQ(frames[0].keypoints.size(), 2U);
  const KeypointLabel& k = frames[0].keypoints[0];  // half a unit of the format off at most
  EXPECT_NEAR(k.u, 12.34, 1.0 / 16);
  EXPECT_NEAR(k.v, 456.78, 1.0 / 16);
  EXPECT_NEAR(k.depth, 2.3456, 0.0005001);
  EXPECT_NEAR(k.static_log_odds, -1.2345, 1.0 / 512);
  EXPECT_NEAR(k.weight, 0.5, 1.0 / 509);
  EXPECT_EQ(frames[1].index, 8U);
  EXPECT_TRUE(frames[1].keypoints.empty());
}

TEST_F(LabelFiles, OnlyAWeightOfZeroMeansMoving) {
  LabelFile file;
  file.add({0, 0, {{0, 0, 0, 0, 0.0F}, {0, 0, 0, 0, 1e-6F}}});
  const auto frames = read_back(file.bytes());
  EXPECT_TRUE(frames[0].keypoints[0].moving());
  EXPECT_FALSE(frames[0].keypoints[1].moving());
}

TEST_F(LabelFiles, ClipValuesOutOfRange) {
  constexpr float kMany = std::numeric_limits<float>::infinity();
  LabelFile file;
  file.add({0, 0, {{-3, 1e6F, 100, -kMany, 2}, {0, 0, std::nanf(""), kMany, 1}}});
  const auto keypoints = read_back(file.bytes())[0].keypoints;
  EXPECT_EQ(keypoints[0].u, 0);
  EXPECT_EQ(keypoints[0].v, 65535.0F / 8);
  EXPECT_EQ(keypoints[0].depth, 65.535F);
  EXPECT_EQ(keypoints[0].static_log_odds, -128);
  EXPECT_EQ(keypoints[0].weight, 1);
  EXPECT_EQ(keypoints[1].depth, 0);
  EXPECT_NEAR(keypoints[1].static_log_odds, 128, 0.01);
}

TEST_F(LabelFiles, StaySmall) {
  LabelFile file;
  file.add({0, 0, std::vector<KeypointLabel>(1000)});
  EXPECT_LT(file.bytes().size(), 10100U);
}

TEST_F(LabelFiles, ThatAreNoneOrCutShortAreNamed) {
  EXPECT_THAT(problem_with("timestamp,u,v\n"), HasSubstr("is not a file of motion labels"));
  LabelFile file;
  file.add({0, 0, {{}, {}}});
  file.add({1, 0.1, {{}, {}}});
  EXPECT_THAT(problem_with(file.bytes().substr(0, file.bytes().size() - 1)),
              HasSubstr("ends within frame number 2"));
  EXPECT_EQ(read_back(LabelFile().bytes()).size(), 0U);
}

}  // namespace
}  // namespace stillmap
