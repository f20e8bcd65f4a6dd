// SPDX-License-Identifier: Apache-2.0
#include "stillmap/track/dead_reckoning.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

/// Returns the messages about ten frames, the first of which have samples.
std::vector<std::string> messages(std::size_t with_samples) {
  Camera camera;
  camera.imu = Imu();
  camera.wheels = Wheels();
  DeadReckoning reckoning(camera);
  for (std::size_t i = 0; i < 10; ++i) {
    RgbdFrame image;
    image.timestamp = 0.1 * static_cast<double>(i);
    if (i < with_samples) {
      image.imu = {{.timestamp = image.timestamp}};
      image.odometry = {{image.timestamp, Pose()}};
    } else if (i % 2 == 0) {  // the first sample after the frame is far away
      image.imu = {{.timestamp = 1e9}};
      image.odometry = {{1e9, Pose()}};
    }
    reckoning.propagate(image);
  }
  std::vector<std::string> texts;
  for (const Finding& finding : reckoning.findings()) texts.push_back(finding.message);
  return texts;
}

TEST(DeadReckoning, TellsThatMostFramesHaveNoSamples) {
  EXPECT_THAT(messages(4), ElementsAre(HasSubstr("6 of 10 frames have no samples of the IMU"),
                                       HasSubstr("6 of 10 frames have no samples of the wheels")));
  EXPECT_THAT(messages(5), IsEmpty());
}

TEST(DeadReckoning, TellsNothingWithoutSensors) {
  DeadReckoning reckoning{Camera()};
  reckoning.propagate(RgbdFrame());
  EXPECT_THAT(reckoning.findings(), IsEmpty());
}

}  // namespace
}  // namespace stillmap
