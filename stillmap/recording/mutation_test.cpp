// SPDX-License-Identifier: Apache-2.0
// Files with altered, missing and inserted bytes: everything that the readers return is read, and
// each failure is an Error. STILLMAP_MUTATIONS is the number of files per container (default 300).
#include "stillmap/base/error.hpp"
#include "stillmap/recording/if_readable.hpp"
#include "stillmap/recording/rgbd_streams.hpp"
#include "stillmap/recording/test_recording.hpp"

#include <cstdlib>
#include <random>

#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::Kind;
using test::TestCamera;
using test::TestFolder;
using test::TestMessage;

int mutations() {
  const char* text = std::getenv("STILLMAP_MUTATIONS");
  return text == nullptr ? 300 : static_cast<int>(std::strtol(text, nullptr, 10));
}

// One message of every type that is read, of two cameras with a transform between them.
std::vector<TestMessage> messages(Kind kind) {
  const bool ros1 = kind == Kind::kRos1;
  const auto type = [&](const std::string& package, const std::string& name) {
    return package + (ros1 ? "/" : "/msg/") + name;
  };
  const TestCamera color{.kind = kind, .frame = "color"}, depth{.kind = kind, .frame = "depth"};
  std::vector<TestMessage> all;
  for (std::uint32_t i = 0; i < 3; ++i) {
    const std::string root = "/device_0/sensor_0/", time = std::to_string(i);
    all.push_back({root + "Color_0/image/data", type("sensor_msgs", "Image"),
                   color.image(i, 7, 12, 10, "rgb8", 3, std::string(360, 'c')), i});
    all.push_back(
        {root + "Depth_0/image/data/compressedDepth", type("sensor_msgs", "CompressedImage"),
         depth.compressed_image(i, 9, "16UC1; compressedDepth png", std::string(90, 'd')), i});
    all.push_back({root + "Color_0/image/camera_info", type("sensor_msgs", "CameraInfo"),
                   color.info(12, 10, 14, "plumb_bob", {0.1, 0, 0, 0, 0}), i});
    all.push_back({root + "Depth_0/image/camera_info", type("sensor_msgs", "CameraInfo"),
                   depth.info(8, 6, 9, "rational_polynomial", {0.1, 0, 0, 0, 0, 0.1, 0, 0}), i});
    all.push_back({"/tf_static", type("tf2_msgs", "TFMessage"),
                   color.transform("color", "depth", {0.1, 0, 0, 0, 0, 0, 1}), i});
    all.push_back({root + "Color_0/image/metadata", type("std_msgs", "String"),
                   test::MessageWriter(kind).text("timestamp=" + time + "5.5;").bytes(), i});
    all.push_back({root + "option/Depth_Units/value", type("std_msgs", "Float32"),
                   test::MessageWriter(kind).put(0.001F).bytes(), i});
  }
  return all;
}

// Alters up to eight places: a bit, a byte, a number, a removed, repeated or inserted part, the
// end.
std::string mutated(std::string bytes, std::mt19937& random) {
  const auto any = [&](std::size_t end) { return end == 0 ? 0 : random() % end; };
  const std::size_t places = 1 + any(8);
  for (std::size_t i = 0; i < places && !bytes.empty(); ++i) {
    const std::size_t at = any(bytes.size());
    switch (any(8)) {
      case 0:
        bytes[at] ^= static_cast<char>(1 << any(8));
        break;
      case 1:
        bytes[at] = static_cast<char>(random());
        break;
      case 2:
      case 3: {  // A length or count becomes extreme.
        const std::uint32_t numbers[] = {0, 1, 0x7fffffff, 0x80000000, 0xffffffff, 0xfffffff0};
        const std::string number = test::le(numbers[any(6)]);
        if (at + 4 <= bytes.size()) bytes.replace(at, 4, number);
        break;
      }
      case 4:
        bytes.erase(at, any(40));
        break;
      case 5:
        bytes.insert(any(bytes.size()), bytes.substr(at, any(200)));
        break;
      case 6:
        bytes.insert(at, std::string(any(20), static_cast<char>(random())));
        break;
      default:
        if (any(4) == 0) bytes.resize(at);
    }
  }
  return bytes;
}

// Returns whether the file could be opened, after reading all that it has.
bool read_everything(const std::filesystem::path& path) {
  try {
    Recording recording(path);
    for (const MessageEntry& entry : recording.messages()) {
      if_readable([&] { return recording.read(entry).size(); });
    }
    find_rgbd_streams(recording);
    return true;
  } catch (const Error&) {
    return false;
  }
}

void try_mutations(const std::vector<std::string>& files, unsigned seed) {
  const TestFolder folder;
  std::mt19937 random(seed);
  int opened = 0;
  for (int i = 0; i < mutations(); ++i) {
    const auto path = folder.write("mutated", mutated(files[i % files.size()], random));
    opened += read_everything(path) ? 1 : 0;
  }
  EXPECT_GT(opened, mutations() / 50);  // Some damage is survived, otherwise nothing was tried.
}

TEST(Mutations, OfBagsAreErrorsOrWarnings) {
  const auto written = messages(Kind::kRos1);
  try_mutations({test::bag_of(written, "none", 50, true), test::bag_of(written, "bz2", 6, false),
                 test::bag_of(written, "lz4", 6, true)},
                1);
}

TEST(Mutations, OfMcapFilesAreErrorsOrWarnings) {
  const auto little = messages(Kind::kLittleCdr), big = messages(Kind::kBigCdr);
  try_mutations(
      {test::mcap_of(little, "cdr", "", 0, true), test::mcap_of(big, "cdr", "", 6, true),
       test::mcap_of(little, "cdr", "lz4", 6, true), test::mcap_of(big, "cdr", "zstd", 6, false)},
      2);
}

TEST(Mutations, OfSqliteFilesAreErrorsOrWarnings) {
  const TestFolder folder;
  const auto path = folder.write_sqlite("whole.db3", messages(Kind::kLittleCdr));
  std::ifstream in(path, std::ios::binary);
  const std::string bytes{std::istreambuf_iterator<char>(in), {}};
  try_mutations({bytes}, 3);
}

}  // namespace
}  // namespace stillmap
