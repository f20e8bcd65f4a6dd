// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/dense/cloud.hpp"

#include <cstring>
#include <filesystem>
#include <limits>
#include <random>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using ::testing::HasSubstr;

Cloud random_cloud(std::size_t size) {
  std::mt19937 random(7);
  std::uniform_real_distribution<float> meters(-20, 20);
  std::uniform_int_distribution<int> byte(0, 255);
  const auto channel = [&] { return static_cast<std::uint8_t>(byte(random)); };
  Cloud cloud;
  for (std::size_t i = 0; i < size; ++i) {
    const float x = meters(random), y = meters(random), z = meters(random);
    cloud.add({x, y, z}, {channel(), channel(), channel()});
  }
  return cloud;
}

template <typename... Values>
std::string bytes_of(Values... values) {
  std::string bytes;
  const auto append = [&](const auto& value) {
    std::string raw(sizeof(value), '\0');
    std::memcpy(raw.data(), &value, sizeof(value));
    bytes += raw;
  };
  (append(values), ...);
  return bytes;
}

class CloudIo : public ::testing::Test {
 protected:
  void SetUp() override {
    folder_ = test::own_path("cloud");
    fs::remove_all(folder_);
    fs::create_directories(folder_);
  }
  void TearDown() override { fs::remove_all(folder_); }

  // Returns the error of the reader for a file of this content, or "".
  std::string complaint(const std::string& name, const std::string& content) const {
    write_file(folder_ / name, content);
    try {
      read_ply(folder_ / name);
    } catch (const Error& error) {
      EXPECT_FALSE(error.fix().empty());
      EXPECT_THAT(error.where(), HasSubstr(name));
      return error.problem();
    }
    return "";
  }

  fs::path folder_;
};

TEST_F(CloudIo, PlyReadsBackAsItWasWritten) {
  const Cloud cloud = random_cloud(1234);
  write_ply(folder_ / "cloud.ply", cloud);
  EXPECT_EQ(read_ply(folder_ / "cloud.ply"), cloud);
}

TEST_F(CloudIo, AnEmptyCloudReadsBack) {
  write_ply(folder_ / "empty.ply", {});
  EXPECT_TRUE(read_ply(folder_ / "empty.ply").empty());
}

TEST_F(CloudIo, WritesTheBytesThatTheFormatPrescribes) {
  Cloud cloud;
  cloud.add({1, -2, 0.5F}, {1, 2, 3});
  write_ply(folder_ / "one.ply", cloud);
  const std::string ply = read_file(folder_ / "one.ply");
  EXPECT_THAT(ply, ::testing::StartsWith("ply\nformat binary_little_endian 1.0\n"));
  EXPECT_THAT(ply, HasSubstr("element vertex 1\nproperty float x\n"));
  EXPECT_THAT(ply,
              ::testing::EndsWith("end_header\n" + bytes_of(1.0F, -2.0F, 0.5F) + "\x01\x02\x03"));
}

TEST_F(CloudIo, ReadsOtherPlyLayouts) {
  const std::string header =
      "ply\r\nformat binary_little_endian 1.0\r\ncomment by another\r\nobj_info x\r\n"
      "element vertex 2\r\nproperty double x\r\nproperty double y\r\nproperty double z\r\n"
      "property float nx\r\nproperty uint8 diffuse_red\r\nproperty uint8 diffuse_green\r\n"
      "property uint8 diffuse_blue\r\nelement face 1\r\nproperty list uchar int vertex_indices\r\n"
      "end_header\n";
  const auto point = [](double x) {
    return bytes_of(x, 2.0, 3.0, 0.0F, std::uint8_t{4}, std::uint8_t{5}, std::uint8_t{6});
  };
  write_file(folder_ / "other.ply", header + point(1) + point(7) + "faces");
  const Cloud cloud = read_ply(folder_ / "other.ply");
  ASSERT_EQ(cloud.size(), 2U);
  EXPECT_EQ(cloud.points[1], Eigen::Vector3f(7, 2, 3));
  EXPECT_EQ(cloud.colors[1], (Rgb{4, 5, 6}));
}

TEST_F(CloudIo, ReadsPointsWithoutColorAsWhiteAndLeavesOutNotFiniteOnes) {
  const float nan = std::numeric_limits<float>::quiet_NaN();
  const std::string header =
      "ply\nformat binary_little_endian 1.0\nelement vertex 2\nproperty float x\n"
      "property float y\nproperty float z\nend_header\n";
  write_file(folder_ / "bare.ply", header + bytes_of(1.0F, nan, 1.0F, 4.0F, 5.0F, 6.0F));
  const Cloud cloud = read_ply(folder_ / "bare.ply");
  ASSERT_EQ(cloud.size(), 1U);
  EXPECT_EQ(cloud.points[0], Eigen::Vector3f(4, 5, 6));
  EXPECT_EQ(cloud.colors[0], (Rgb{255, 255, 255}));
}

TEST_F(CloudIo, NamesTheProblemOfAPly) {
  const std::string start = "ply\nformat binary_little_endian 1.0\n";
  const std::string xyz = "property float x\nproperty float y\nproperty float z\n";
  const auto says = [&](const std::string& content) { return complaint("bad.ply", content); };
  EXPECT_THAT(says(""), HasSubstr("no end"));
  EXPECT_THAT(says("\x89PNG\r\n\x1a\n"), HasSubstr("begin with 'ply'"));
  EXPECT_THAT(says(start + "element vertex 1\n" + xyz), HasSubstr("no end"));
  EXPECT_THAT(says("ply\nformat ascii 1.0\nelement vertex 0\n" + xyz + "end_header\n"),
              HasSubstr("binary_little_endian"));
  EXPECT_THAT(says(start + "element vertex many\n" + xyz + "end_header\n"), HasSubstr("'many'"));
  EXPECT_THAT(says(start + "element vertex -1\n" + xyz + "end_header\n"), HasSubstr("'-1'"));
  EXPECT_THAT(
      says(start + "element vertex 2\n" + xyz + "end_header\n" + bytes_of(1.0F, 2.0F, 3.0F)),
      HasSubstr("truncated"));
  EXPECT_THAT(says(start + "element vertex 18446744073709551615\n" + xyz + "end_header\n"),
              HasSubstr("truncated"));
  EXPECT_THAT(says(start + "element vertex 1\nproperty float x\nend_header\n1234"),
              HasSubstr("x, y or z"));
  EXPECT_THAT(says(start + "element vertex 1\nend_header\n"), HasSubstr("x, y or z"));
  EXPECT_THAT(says(start + "element vertex 1\nproperty quad x\nend_header\n"), HasSubstr("'quad'"));
  EXPECT_THAT(says(start + "element vertex 1\nproperty list uchar int x\nend_header\n"),
              HasSubstr("no plain number"));
  EXPECT_THAT(says(start + "element face 1\nproperty list uchar int x\nend_header\n"),
              HasSubstr("first element"));
}

TEST_F(CloudIo, RefusesMissingFilesAndMissingColors) {
  Cloud cloud = random_cloud(3);
  EXPECT_THROW(read_ply(folder_ / "missing.ply"), Error);
  EXPECT_THROW(write_ply(folder_ / "no_such_folder" / "cloud.ply", cloud), Error);
  cloud.colors.pop_back();
  EXPECT_THROW(write_ply(folder_ / "half.ply", cloud), Error);
  EXPECT_TRUE(fs::is_empty(folder_)) << "no partly written file remains";
}

}  // namespace
}  // namespace stillmap
