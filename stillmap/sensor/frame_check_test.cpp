// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/frame_check.hpp"

#include <algorithm>
#include <functional>

#include <gmock/gmock.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using testing::AllOf;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

constexpr double kKinectSteps = 0.0029;  // change of the depth per squared depth [1/m]

/// Returns a frame whose depths have the steps of a Kinect with a factor of 5000, from 1 to 3 m, as
/// a camera with another factor reads them; without depth for a factor of 0.
RgbdFrame frame_at(double time, double factor = 5000) {
  RgbdFrame frame;
  frame.timestamp = time;
  cv::Mat1f depth(48, 64, 0.0F);
  double z = 1;
  for (float& pixel : depth) {
    if (factor > 0) pixel = static_cast<float>(std::round(5000 * z) / factor);
    z += kKinectSteps * z * z;
    if (z > 3) z = 1;
  }
  frame.depth = depth;
  return frame;
}

std::vector<std::string> problems_of(double interval, double factor, int frames,
                                     int frames_with_depth) {
  Camera camera;
  camera.depth_factor = factor;
  FrameCheck check(camera);
  for (int i = 0; i < frames; ++i)
    check.add(frame_at(i * interval, i < frames_with_depth ? factor : 0));
  return texts_of(check.findings());
}

TEST(FrameCheck, FindsNothingInAGoodRecording) {
  EXPECT_THAT(problems_of(1.0 / 30, 5000, 60, 60), IsEmpty());
}

TEST(FrameCheck, FindsTimestampsThatAreNoSeconds) {
  EXPECT_THAT(problems_of(33, 5000, 60, 60), ElementsAre(HasSubstr("in milliseconds")));
  EXPECT_THAT(problems_of(33e6, 5000, 60, 60), ElementsAre(HasSubstr("in nanoseconds")));
}

TEST(FrameCheck, FindsDepthThatEnds) {
  EXPECT_THAT(problems_of(0.1, 5000, 60, 40),
              ElementsAre(HasSubstr("20 frames in a row have no depth, from 4.000000 s on")));
  EXPECT_THAT(problems_of(0.1, 5000, 60, 50), IsEmpty()) << "ten frames";
}

/// Returns the problems of 60 frames whose color changes and whose depth is that of frame i / n.
std::vector<std::string> problems_of_repeated_depth(int n) {
  FrameCheck check{Camera()};
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = frame_at(i / 30.0);
    frame.depth += 0.1F * static_cast<float>(i / n);
    frame.gray = cv::Mat1b(48, 64, static_cast<uchar>(i));
    check.add(frame);
  }
  return texts_of(check.findings());
}

TEST(FrameCheck, FindsDepthThatRepeatsWhileTheColorChanges) {
  EXPECT_THAT(problems_of_repeated_depth(30),
              testing::Contains(HasSubstr("29 frames in a row have the depth image of the one")));
  EXPECT_THAT(problems_of_repeated_depth(2),
              testing::Not(testing::Contains(HasSubstr("frames in a row"))));
}

/// Returns the problems of 60 frames with the images of frame i / n.
std::vector<std::string> problems_of_repeated_images(int n) {
  FrameCheck check{Camera()};
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = frame_at(i / 30.0);
    frame.gray = cv::Mat1b(48, 64, static_cast<uchar>(i / n));
    check.add(frame);
  }
  return texts_of(check.findings());
}

TEST(FrameCheck, FindsImagesThatRepeat) {
  EXPECT_THAT(problems_of_repeated_images(1), testing::Not(testing::Contains(HasSubstr("jumped"))));
  EXPECT_THAT(
      problems_of_repeated_images(3),
      testing::Contains(HasSubstr("40 of 60 frames have the color image of the one before")));
  EXPECT_THAT(problems_of_repeated_images(30), testing::Not(testing::Contains(HasSubstr("jumped"))))
      << "a camera at rest";
}

TEST(FrameCheck, FindsACameraThatHangs) {
  FrameCheck check{Camera()};
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = frame_at(i / 30.0);
    frame.gray = cv::Mat1b(48, 64, static_cast<uchar>(std::min(i, 30)));
    check.add(frame);
  }
  EXPECT_THAT(texts_of(check.findings()),
              testing::Contains(AllOf(HasSubstr("29 frames in a row have the color image"),
                                      HasSubstr("from 1.033333 s on"))));
}

/// Returns a frame of a camera that moves along a textured wall, at a place [pixels].
RgbdFrame frame_of_wall(double time, int place) {
  static const cv::Mat1b wall = [] {
    cv::Mat1b noise(480, 4000);
    cv::RNG(1).fill(noise, cv::RNG::UNIFORM, 0, 255);
    cv::GaussianBlur(noise, noise, {}, 30);
    cv::normalize(noise, noise, 0, 255, cv::NORM_MINMAX);
    return noise;
  }();
  RgbdFrame frame;
  frame.timestamp = time;
  frame.gray = wall({place, 0, 640, 480});
  frame.gray.convertTo(frame.depth, CV_32F, 1.0 / 100, 1);
  return frame;
}

/// Returns what is told of 60 frames at the places that `place` returns.
std::vector<std::string> problems_of_places(const std::function<int(int)>& place) {
  FrameCheck check{Camera()};
  for (int i = 0; i < 60; ++i) check.add(frame_of_wall(i / 30.0, place(i)));
  return texts_of(check.findings());
}

TEST(FrameCheck, FindsFramesOfTwoCamerasInTurn) {
  EXPECT_THAT(problems_of_places([](int i) { return 4 * i + 2000 * (i % 2); }),
              testing::Contains(HasSubstr("58 of 60 frames resemble the frame before the last")));
  const auto told = testing::Contains(HasSubstr("in turn"));
  EXPECT_THAT(problems_of_places([](int i) { return 4 * i; }), testing::Not(told));
  EXPECT_THAT(problems_of_places([](int i) { return 50 * i; }), testing::Not(told)) << "fast";
  EXPECT_THAT(problems_of_places([](int i) { return 4 * i + 3 * (i % 2); }), testing::Not(told))
      << "a camera that shakes";
}

TEST(FrameCheck, ExposuresInTurnAreOfOneCamera) {
  FrameCheck check{Camera()};
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = frame_of_wall(i / 30.0, 4 * i);
    frame.gray = frame.gray * (i % 2 == 0 ? 1.0 : 0.6);
    check.add(frame);
  }
  EXPECT_THAT(texts_of(check.findings()), testing::Not(testing::Contains(HasSubstr("in turn"))));
}

TEST(FrameCheck, FindsDepthThatIsTheSameEverywhere) {
  FrameCheck check{Camera()};
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = frame_at(i / 30.0);
    frame.depth = cv::Mat1f(48, 64, 2.0F);
    check.add(frame);
  }
  EXPECT_THAT(texts_of(check.findings()),
              testing::Contains(HasSubstr("the same depth everywhere")));
}

TEST(FrameCheck, FindsThatThereIsNoDepth) {
  EXPECT_THAT(problems_of(0.1, 5000, 60, 0), ElementsAre(HasSubstr("no frame has a depth")));
}

TEST(FrameCheck, FindsADepthFactorThatTheStepsContradict) {
  EXPECT_THAT(problems_of(0.1, 10000, 60, 60), ElementsAre(HasSubstr("set the depth factor to 5")));
}

TEST(FrameCheck, FindsDepthsThatWereSavedWithEightBits) {
  Camera camera;
  camera.depth_factor = 1000;
  FrameCheck check(camera);
  for (int i = 0; i < 60; ++i) {
    RgbdFrame frame = frame_at(i / 30.0);
    cv::Mat bytes;
    frame.depth.convertTo(bytes, CV_8U, 255.0 / 10);
    bytes.convertTo(frame.depth, CV_32F, 10.0 / 255);
    check.add(frame);
  }
  EXPECT_THAT(texts_of(check.findings()), ElementsAre(HasSubstr("multiples of about 39 mm")));
}

/// Returns the problems of 30 frames whose depth edges are those of the mirrored images.
std::vector<std::string> problems_of_mirrored_depth(const DepthSensor& sensor) {
  Camera camera;
  camera.depth_sensor = sensor;
  FrameCheck check(camera);
  cv::RNG random(3);
  for (int i = 0; i < 30; ++i) {
    RgbdFrame frame;
    frame.timestamp = i;
    frame.gray = cv::Mat1b(480, 640, std::uint8_t{90});
    cv::Mat1f depth(480, 640, 9.0F);
    for (int box = 0; box < 30; ++box) {
      const cv::Rect at(random(560), random(400), 80, 80);
      cv::rectangle(frame.gray, at, random(255), cv::FILLED);
      cv::rectangle(depth, at, 3 + random(500) / 100.0, cv::FILLED);
    }
    cv::flip(depth, frame.depth, 1);
    check.add(frame);
  }
  return texts_of(check.findings());
}

TEST(FrameCheck, ComparesEdgesOfDepthCamerasOnly) {
  EXPECT_THAT(problems_of_mirrored_depth(find_depth_sensor("azure_kinect")),
              testing::Contains(HasSubstr("mirrored")));
  EXPECT_THAT(problems_of_mirrored_depth(stereo_sensor(700, 0.54)), IsEmpty())
      << "its depth is computed from the images";
}

TEST(FrameCheck, WithoutStereoDepthNamesThePairOfImages) {
  Camera camera;
  camera.depth_sensor = stereo_sensor(700, 0.54);
  FrameCheck check(camera);
  for (int i = 0; i < 60; ++i) check.add(frame_at(i / 30.0, 0));
  EXPECT_THAT(texts_of(check.findings()),
              ElementsAre(HasSubstr("left and right show the same moment")));
}

TEST(FrameCheck, TheStepsOfOtherSensorsSayNothingOfTheDepthFactor) {
  Camera camera;
  camera.depth_factor = 10000;
  camera.depth_sensor = find_depth_sensor("realsense_d435i");
  FrameCheck check(camera);
  for (int i = 0; i < 60; ++i) check.add(frame_at(i / 30.0, 10000));
  EXPECT_THAT(texts_of(check.findings()), ::testing::IsEmpty());
}

}  // namespace
}  // namespace stillmap
