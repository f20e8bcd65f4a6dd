// SPDX-License-Identifier: Apache-2.0
#include "stillmap/map/keyframe_pager.hpp"

#include "stillmap/base/test_memory.hpp"
#include "stillmap/base/test_path.hpp"

#include <algorithm>
#include <filesystem>
#include <memory>
#include <string>
#include <vector>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

constexpr int kKeypoints = 1000, kKeyframes = 10;

/// Returns features that differ from those of every other seed.
Features features(int seed) {
  Features made;
  for (int i = 0; i < kKeypoints; ++i) {
    const auto x = static_cast<float>(i % 64), y = static_cast<float>((i + seed) % 48);
    made.keypoints.push_back({.u = x, .v = y, .depth = static_cast<float>(seed)});
    made.descriptors.push_back({static_cast<std::uint64_t>(i), static_cast<std::uint64_t>(seed)});
  }
  made.grid = KeypointGrid(made.keypoints, 64, 48);
  return made;
}

/// Returns the keypoints near a pixel, as matching searches them.
std::vector<std::uint32_t> near(const Features& features) {
  std::vector<std::uint32_t> found;
  features.grid.for_each_near(20, 20, 6, 0, 7, [&](std::uint32_t i) { found.push_back(i); });
  return found;
}

bool equal(const Features& a, const Features& b) {
  const auto same = [](const Keypoint& p, const Keypoint& q) {
    return p.u == q.u && p.v == q.v && p.depth == q.depth && p.level == q.level;
  };
  return std::ranges::equal(a.keypoints, b.keypoints, same) && a.descriptors == b.descriptors &&
         near(a) == near(b) && !near(a).empty();
}

class KeyframePagerTest : public ::testing::Test {
 protected:
  KeyframePagerTest() {
    for (int seed = 0; seed < kKeyframes; ++seed) {
      Keyframe made;
      made.features = std::make_shared<Features>(features(seed));
      made.static_weight.assign(kKeypoints, 1);
      ids_.push_back(map_.add_keyframe(std::move(made)).id);
    }
  }
  void TearDown() override { std::filesystem::remove_all(folder_); }

  void expect_unchanged() const {
    for (int seed = 0; seed < kKeyframes; ++seed) {
      if (const Keyframe* keyframe = map_.find(ids_[seed])) {
        EXPECT_TRUE(equal(*keyframe->features, features(seed))) << seed;
      }
    }
  }
  bool in_file(int keyframe) const {
    return before_[keyframe] != map_.at(ids_[keyframe]).features.get();
  }
  void remember() {
    before_.clear();
    map_.for_each_keyframe([this](const Keyframe& k) { before_.push_back(k.features.get()); });
  }

  Map map_{Camera{.width = 64, .height = 48, .fx = 50, .fy = 50, .cx = 32, .cy = 24}, {}};
  std::vector<KeyframeId> ids_;
  std::vector<const Features*> before_;
  const std::filesystem::path folder_ = test::own_path("keyframes");
  const std::size_t one_ = features(0).bytes();
};

TEST_F(KeyframePagerTest, KeepsTheKeyframesUsedLast) {
  remember();
  KeyframePager pager({3 * one_, folder_});
  pager.use(map_, ids_);
  EXPECT_EQ(pager.bytes_in_memory(), 3 * one_);
  EXPECT_EQ(pager.paged_out(), 7U);
  for (int i = 0; i < kKeyframes; ++i) EXPECT_EQ(in_file(i), i >= 3) << "the first is the nearest";
  expect_unchanged();
}

TEST_F(KeyframePagerTest, FeaturesComeBackWhenTheyAreUsedAgain) {
  KeyframePager pager({3 * one_, folder_});
  pager.use(map_, ids_);
  expect_unchanged();  // reads all of the file
  const auto again = std::span(ids_).last(2);
  pager.use(map_, again);
  EXPECT_EQ(pager.bytes_in_memory(), 3 * one_);
  EXPECT_GT(test::resident_kib(folder_), 0);
  EXPECT_LE(test::resident_kib(folder_) * 1024, 2 * static_cast<long>(one_ + 4096))
      << "only those in use stay in memory";
  expect_unchanged();
}

TEST_F(KeyframePagerTest, FreesTheMemoryOfErasedKeyframes) {
  KeyframePager pager({3 * one_, folder_});
  pager.use(map_, ids_);
  map_.erase(ids_[0], ids_[1]);
  map_.erase(ids_[9], ids_[1]);
  pager.use(map_, std::span(ids_).subspan(1, 1));
  EXPECT_EQ(pager.bytes_in_memory(), 2 * one_);
  EXPECT_EQ(pager.paged_out(), 6U);
  expect_unchanged();
}

TEST_F(KeyframePagerTest, ReplacedFeaturesAreMovedToTheFileAgain) {
  KeyframePager pager({3 * one_, folder_});
  pager.use(map_, ids_);
  for (int i = 0; i < kKeyframes; ++i)
    pager.replace(map_, ids_[i], std::make_shared<Features>(features(i + 20)));
  EXPECT_EQ(pager.bytes_in_memory(), 3 * one_);
  EXPECT_EQ(pager.paged_out(), 7U);
  for (int i = 0; i < kKeyframes; ++i)
    EXPECT_TRUE(equal(*map_.at(ids_[i]).features, features(i + 20))) << i;
}

TEST_F(KeyframePagerTest, OutlivedByFeaturesInUse) {
  auto pager = std::make_unique<KeyframePager>(MemoryLimit{0, folder_});
  pager->use(map_, ids_);
  const FeaturesPtr used = map_.at(ids_[4]).features;
  pager.reset();
  map_.erase(ids_[4], ids_[0]);
  EXPECT_TRUE(equal(*used, features(4)));
}

TEST_F(KeyframePagerTest, OnAFullDiskAllStaysInMemory) {
  testing::internal::CaptureStderr();
  KeyframePager pager({0, folder_});
  {
    const test::FullDisk full(2 * one_);
    pager.use(map_, ids_);
  }
  pager.use(map_, ids_);
  const std::string warnings = testing::internal::GetCapturedStderr();
  EXPECT_NE(warnings.find("cannot be written"), std::string::npos) << warnings;
  EXPECT_EQ(warnings.find("warning"), warnings.rfind("warning")) << "told once";
  EXPECT_EQ(pager.paged_out(), 1U) << "the one that there was room for";
  expect_unchanged();
}

}  // namespace
}  // namespace stillmap
