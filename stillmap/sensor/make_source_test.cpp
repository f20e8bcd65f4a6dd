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

TEST(MakeSource, AnUnknownFormIsAnErrorThatNamesTheKnownOnes) {
  for (const char* text : {"", "kinect:0", "rtsp://camera"}) {
    EXPECT_THAT(error_of([&] { make_source(text); }), HasSubstr("tum:FOLDER")) << text;
  }
}

}  // namespace
}  // namespace stillmap
