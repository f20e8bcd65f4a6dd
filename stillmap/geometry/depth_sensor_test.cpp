// SPDX-License-Identifier: Apache-2.0
#include "stillmap/geometry/depth_sensor.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/geometry/observation_noise.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using testing::HasSubstr;

TEST(DepthSensor, OfAKinectErrsAsNguyenMeasuredAndAboutAsKhoshelhamDid) {
  const DepthSensor& kinect = find_depth_sensor("kinect_v1");
  for (const double z : {0.5, 1.0, 2.0, 4.0, 7.0}) {
    EXPECT_NEAR(kinect.sigma(z), 0.0012 + 0.0019 * (z - 0.4) * (z - 0.4), 1e-12) << z;
  }
  for (const double z : {1.3, 2.0, 3.0, 5.0}) {
    EXPECT_NEAR(kinect.sigma(z), 1.4e-3 * z * z, 0.2 * 1.4e-3 * z * z) << z;
  }
}

TEST(DepthSensor, OfARealSenseErrsAsItsDisparityDoes) {
  const DepthSensor& d435i = find_depth_sensor("realsense_d435i");
  const DepthSensor& d455 = find_depth_sensor("realsense_d455");
  // z^2 * subpixel / (f * baseline)
  EXPECT_NEAR(d435i.sigma(2), 4 * 0.08 / (446.8 * 0.050), 1e-12);
  EXPECT_NEAR(d455.sigma(2), 4 * 0.08 / (446.8 * 0.095), 1e-12);
  EXPECT_NEAR(d435i.min_depth, 0.177, 0.001);
  EXPECT_NEAR(find_depth_sensor("realsense_d405").min_depth, 0.064, 0.001);
}

TEST(DepthSensor, IsKnownByTheNameOfARealSense) {
  EXPECT_EQ(realsense_sensor_named("Intel RealSense D455"), "realsense_d455");
  EXPECT_EQ(realsense_sensor_named("/camera/d405/aligned_depth_to_color"), "realsense_d405");
  EXPECT_EQ(realsense_sensor_named("/camera/aligned_depth_to_color"), "realsense_d435i");
}

TEST(DepthSensor, OfAnAzureKinectErrsAtItsFarEndAsMuchAsSpecified) {
  const DepthSensor& azure = find_depth_sensor("azure_kinect");
  EXPECT_NEAR(azure.sigma(azure.max_depth), 0.017, 1e-12);
}

TEST(DepthSensor, OfAStereoPairMakesLandmarksUpToFortyBaselines) {
  for (const auto& [focal, baseline] : {std::pair(718.856, 0.537), std::pair(458.0, 0.11)}) {
    const DepthSensor stereo = stereo_sensor(focal, baseline);
    EXPECT_NEAR(stereo.sigma(10), 100 * 0.3 / (focal * baseline), 1e-12);
    EXPECT_NEAR(stereo.depth_at_sigma(0.060784), 40 * baseline, 1e-4);
    EXPECT_NEAR(focal * baseline / stereo.min_depth, focal / 5, 1e-9);
    EXPECT_EQ(depth_sensor_of("stereo", focal, baseline).max_depth, focal * baseline / 2);
  }
  EXPECT_EQ(depth_sensor_of("kinect_v1", 700, 1).baseline, 0.075);
}

TEST(DepthSensor, ThatIsIdealDoesNotErr) {
  const DepthSensor& ideal = find_depth_sensor("ideal");
  for (const double z : {0.3, 2.0, 15.0}) EXPECT_EQ(ideal.sigma(z), 0);
  EXPECT_EQ(ideal.depth_at_sigma(0.01), static_cast<float>(ideal.max_depth));
}

TEST(DepthSensor, KnowsTheDepthOfASigma) {
  for (const std::string& name : depth_sensor_names()) {
    const DepthSensor& sensor = find_depth_sensor(name);
    if (sensor.principle == DepthPrinciple::kIdeal) continue;
    for (double z = 1; z < sensor.max_depth; z += 0.5) {
      EXPECT_EQ(sensor.depth_at_sigma(sensor.sigma(z) / sensor.scene_scale), static_cast<float>(z))
          << name;
    }
    EXPECT_EQ(sensor.depth_at_sigma(1e3), static_cast<float>(sensor.max_depth)) << name;
  }
  EXPECT_EQ(find_depth_sensor("kinect_v1").depth_at_sigma(0.001), 0);  // it never errs so little
  const DepthSensor linear{.noise = {.constant = 0.001, .linear = 0.002}};
  EXPECT_NEAR(linear.depth_at_sigma(0.005), 2, 1e-6);
}

TEST(DepthSensor, ItsToleranceIsAFloorAndAMultipleOfItsSigma) {
  const DepthSensor sensor{.noise = {.constant = 0.001, .linear = 0.002, .quadratic = 0.003}};
  const auto tolerance = sensor.tolerance<double>(4, 0.05);
  for (const double z : {0.5, 2.0}) {
    EXPECT_NEAR(tolerance.at(z), 0.05 + 4 * sensor.sigma(z), 1e-12);
  }
}

TEST(DepthSensor, ThatIsUnknownIsAnErrorWithTheNearestName) {
  try {
    find_depth_sensor("realsense_d435");
    FAIL();
  } catch (const Error& e) {
    EXPECT_THAT(e.what(), HasSubstr("did you mean 'realsense_d435i'?"));
  }
}

TEST(ObservationNoise, IsThatOfTheRegistrationOrOfTheSensorWhicheverIsLarger) {
  Camera camera;
  for (const double z : {0.5, 3.0, 8.0}) {
    EXPECT_EQ(observation_noise(camera, z).disparity_sigma, 0.3);  // a Kinect alone: 0.055
  }
  camera.depth_sensor.noise = {.quadratic = 0.02};
  EXPECT_NEAR(observation_noise(camera, 2).disparity_sigma, 525 * 0.075 * 0.02, 1e-12);
  EXPECT_EQ(observation_noise(camera, 0).disparity_sigma, 0.3);
}

}  // namespace
}  // namespace stillmap
