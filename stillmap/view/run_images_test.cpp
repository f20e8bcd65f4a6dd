// SPDX-License-Identifier: Apache-2.0
#include "stillmap/view/run_images.hpp"

#include "stillmap/recording/test_recording.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <cmath>
#include <cstdint>
#include <filesystem>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgcodecs.hpp>

namespace stillmap {
namespace {

using test::TestCamera;
using test::TestFolder;
using test::TestMessage;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr int kFrames = 6;

/// Brightness of the images of frame i.
int brightness(int i) { return 20 + 30 * i; }

/// Returns the number of the frame that an image is of; -1 without an image.
int frame_in(const ViewedImage& image) {
  if (image.jpeg.empty()) return -1;
  const std::vector<std::uint8_t> bytes(image.jpeg.begin(), image.jpeg.end());
  const cv::Mat decoded = cv::imdecode(bytes, cv::IMREAD_GRAYSCALE);
  return static_cast<int>(std::lround((cv::mean(decoded)[0] - 20) / 30));
}

cv::Mat color_of(int i) { return cv::Mat(48, 64, CV_8UC3, cv::Scalar::all(brightness(i))); }

/// Returns the messages of a recorded file with the images of a TestSequence.
std::vector<TestMessage> messages() {
  const TestCamera camera{.frame = "color"};
  const std::string depth(std::size_t{64} * 48 * 2, '\x07');
  std::vector<TestMessage> all;
  for (int i = 0; i < kFrames; ++i) {
    const std::int64_t time = 100'000'000'000 + i * 33'333'333LL;
    const auto second = static_cast<std::uint32_t>(time / 1'000'000'000);
    const auto nanosecond = static_cast<std::uint32_t>(time % 1'000'000'000);
    const std::string color(std::size_t{64} * 48 * 3, static_cast<char>(brightness(i)));
    all.push_back({"/rgb/info/camera_info", "sensor_msgs/msg/CameraInfo",
                   camera.info(64, 48, 60, "plumb_bob", {}), time});
    all.push_back({"/rgb/info/image", "sensor_msgs/msg/Image",
                   camera.image(second, nanosecond, 64, 48, "rgb8", 3, color), time});
    all.push_back({"/depth/image", "sensor_msgs/msg/Image",
                   camera.image(second, nanosecond, 64, 48, "16UC1", 2, depth), time});
  }
  return all;
}

void expect_nearest_images(RunImages& images) {
  EXPECT_THAT(images.problem(), IsEmpty());
  for (const int i : {0, 4, 4, 1, 5, 2}) {  // forwards and back
    EXPECT_EQ(frame_in(images.at(TestSequence::stamp(i))), i);
    EXPECT_EQ(frame_in(images.at(TestSequence::stamp(i) + 0.01)), i);
    EXPECT_EQ(frame_in(images.at(TestSequence::stamp(i) - 0.01)), i);
  }
  EXPECT_THAT(images.at(200).problem, HasSubstr("No image of this time"));
  EXPECT_THAT(images.at(0).problem, HasSubstr("No image of this time"));
}

TEST(RunImages, OfAFolderAreThoseNearestToTheTime) {
  const TestSequence sequence(kFrames);
  for (int i = 0; i < kFrames; ++i) sequence.write_image(TestSequence::color_name(i), color_of(i));
  RunImages images(sequence.folder().string());
  expect_nearest_images(images);
}

TEST(RunImages, OfARecordedFileAreThoseNearestToTheTime) {
  const TestFolder folder;
  const auto file = folder.write("a.mcap", test::mcap_of(messages(), "cdr", "zstd", 4, true));
  RunImages images(file.string());
  expect_nearest_images(images);
}

TEST(RunImages, LargeOnesAreReduced) {
  const TestSequence sequence(1);
  sequence.write_image(TestSequence::color_name(0), TestSequence::color_image({1280, 720}));
  const ViewedImage image = RunImages(sequence.folder().string()).at(TestSequence::stamp(0));
  const std::vector<std::uint8_t> bytes(image.jpeg.begin(), image.jpeg.end());
  EXPECT_EQ(cv::imdecode(bytes, cv::IMREAD_COLOR).size(), cv::Size(640, 360));
}

TEST(RunImages, SayWhyThereAreNone) {
  EXPECT_THAT(RunImages("").problem(), HasSubstr("does not tell which recording"));
  EXPECT_THAT(RunImages("realsense:").problem(), HasSubstr("live camera"));
  EXPECT_THAT(RunImages("/no/such/recording").problem(), HasSubstr("is not there any more"));
  const TestFolder folder;
  std::filesystem::create_directories(folder.path("empty"));
  EXPECT_THAT(RunImages(folder.path("empty").string()).at(0).problem, HasSubstr("No image"));
  const TestSequence sequence(2);
  sequence.write(TestSequence::color_name(1), "no image");
  RunImages images(sequence.folder().string());
  EXPECT_THAT(images.at(TestSequence::stamp(1)).problem, HasSubstr("No image"));
}

}  // namespace
}  // namespace stillmap
