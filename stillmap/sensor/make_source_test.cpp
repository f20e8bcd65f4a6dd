// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/make_source.hpp"

#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using testing::HasSubstr;

TEST(MakeSource, AFolderIsASource) {
  const TestSequence sequence(3);
  write_camera(sequence.path("camera.yaml"), TestSequence::camera());
  for (const char* prefix : {"", "tum:"}) {
    const auto source = make_source(std::string(prefix) + sequence.folder().string());
    EXPECT_EQ(all_frames(*source).size(), 3U) << prefix;
  }
}

TEST(MakeSource, TheRangeIsThatOfTheOptions) {
  const TestSequence sequence(6);
  write_camera(sequence.path("small.yaml"), TestSequence::camera());
  SourceOptions options;
  options.camera = sequence.path("small.yaml").string();
  options.first = 1;
  options.stride = 2;
  EXPECT_EQ(make_source(sequence.folder().string(), options)->size(), 3U);
}

// An image in the size of the sequence's images that is white in these columns.
cv::Mat white(int begin, int end) {
  cv::Mat image(48, 64, CV_8UC1, cv::Scalar(0));
  image.colRange(begin, end).setTo(255);
  return image;
}

TEST(MakeSource, IgnoredPixelsAreThoseOfTheCameraFileOrOfTheOptions) {
  const TestSequence sequence(1);
  Camera camera = TestSequence::camera();
  camera.ignore = sequence.path("gripper.png").string();
  write_camera(sequence.path("camera.yaml"), camera);
  sequence.write_image("gripper.png", white(0, 16));
  sequence.write_image("arm.png", white(32, 64));
  for (const bool named : {false, true}) {
    SourceOptions options;
    if (named) options.ignore = sequence.path("arm.png").string();
    const auto source = make_source(sequence.folder().string(), options);
    const auto frame = source->next();
    EXPECT_EQ(cv::norm(frame->ignored, named ? white(32, 64) : white(0, 16), cv::NORM_INF), 0);
    EXPECT_EQ(cv::countNonZero(frame->depth), named ? 32 * 48 : 48 * 48);
    EXPECT_EQ(cv::countNonZero((frame->depth > 0) & frame->ignored), 0);
    EXPECT_THAT(source->notes(),
                testing::Contains(HasSubstr(named ? "ignored: 50.0 %" : "25.0 %")));
    EXPECT_EQ(source->camera().ignore, "") << "the frames' own pixels are not ignored twice";
  }
}

TEST(MakeSource, AnUnusableImageOfIgnoredPixelsIsAnErrorWithAFix) {
  const TestSequence sequence(1);
  write_camera(sequence.path("camera.yaml"), TestSequence::camera());
  SourceOptions options;
  options.ignore = sequence.path("robot.png").string();
  const auto error = [&] {
    return error_of([&] { make_source(sequence.folder().string(), options); });
  };
  const auto is = [](const char* problem) {
    return testing::AllOf(HasSubstr(problem), HasSubstr("robot.png"),
                          HasSubstr("8-bit PNG of 64 x 48 pixels"));
  };
  EXPECT_THAT(error(), is("is missing"));
  sequence.write_image("robot.png", cv::Mat(24, 32, CV_8UC1, cv::Scalar(255)));
  EXPECT_THAT(error(), is("is 32 x 24 pixels"));
  sequence.write_image("robot.png", cv::Mat(48, 64, CV_16UC1, cv::Scalar(65535)));
  EXPECT_THAT(error(), is("16 bits"));
  sequence.write_image("robot.png", white(0, 0));
  EXPECT_THAT(error(), is("black everywhere"));
  sequence.write_image("robot.png", white(0, 64));
  EXPECT_THAT(error(), is("black nowhere"));
  sequence.write("robot.png", "no image");
  EXPECT_THAT(error(), is("robot.png"));
}

TEST(MakeSource, AnUnknownFormIsAnErrorThatNamesTheKnownOnes) {
  for (const char* text : {"", "kinect:0", "rtsp://camera"}) {
    EXPECT_THAT(error_of([&] { make_source(text); }), HasSubstr("tum:FOLDER")) << text;
  }
}

}  // namespace
}  // namespace stillmap
