// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_file.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"

#include <cmath>
#include <fstream>
#include <numbers>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;

class CameraFile : public ::testing::Test {
 protected:
  std::filesystem::path file_ = test::own_path("camera.yaml");
  Camera load(const std::string& text) {
    std::ofstream(file_) << text;
    return read_camera(file_.string());
  }
  void TearDown() override { std::filesystem::remove(file_); }
};

TEST(CameraPresets, HaveThePublishedCalibration) {
  const Camera fr1 = read_camera("tum_fr1");
  EXPECT_EQ(fr1.name, "tum_fr1");
  EXPECT_EQ(fr1.fx, 517.3);
  EXPECT_EQ(fr1.cy, 255.3);
  EXPECT_TRUE(fr1.distorted());
  EXPECT_EQ(fr1.distortion(4), 1.1633);
  const Camera fr3 = read_camera("tum_fr3");
  EXPECT_EQ(fr3.fy, 539.2);
  EXPECT_FALSE(fr3.distorted());
  EXPECT_EQ(fr3.depth_factor, 5000);
  EXPECT_EQ(read_camera("kitchen").cx, 321);
}

TEST(CameraPresets, IncludeTheRealSenseWithItsFieldOfViewAndSensor) {
  const Camera camera = read_camera("realsense_d435i");
  EXPECT_EQ(camera.width, 1280);
  EXPECT_EQ(camera.height, 720);
  const double degrees = 2 * std::atan(camera.width / 2.0 / camera.fx) * 180 / std::numbers::pi;
  EXPECT_NEAR(degrees, 69.4, 0.01);
  EXPECT_EQ(camera.depth_sensor.name, "realsense_d435i");
  EXPECT_EQ(camera.depth_sensor.max_depth, 10);
  EXPECT_EQ(camera.depth_factor, 1000);
}

TEST(CameraPresets, AllPassTheirOwnCheck) {
  for (const auto& name : camera_presets()) EXPECT_NO_THROW(check_camera(read_camera(name), name));
}

TEST(Camera, WithAnImpossibleDepthSensorIsAnErrorThatListsTheModels) {
  Camera camera;
  camera.depth_sensor.name = "kinect_v2";
  EXPECT_THAT(test::error_of([&] { check_camera(camera, "camera"); }),
              AllOf(HasSubstr("'kinect_v2' is no known depth sensor"), HasSubstr("azure_kinect")));
  camera.depth_sensor = find_depth_sensor("kinect_v1");
  camera.depth_sensor.max_depth = camera.depth_sensor.min_depth;
  EXPECT_THAT(test::error_of([&] { check_camera(camera, "camera"); }),
              AllOf(HasSubstr("measures from 0.45 m to 0.45 m"), HasSubstr("azure_kinect")));
  camera.depth_sensor = find_depth_sensor("kinect_v1");
  camera.depth_sensor.noise.quadratic = -1;
  EXPECT_THAT(test::error_of([&] { check_camera(camera, "camera"); }), HasSubstr("deviations"));
}

TEST_F(CameraFile, RoundTrip) {
  Camera written = read_camera("tum_fr2");
  written.name = "my \"odd\" camera: 2";
  written.fx = 520.123456789012;
  written.width = 1280;
  written.height = 960;
  written.fps = 29.97;
  written.baseline = 0.0512;
  written.depth_sensor = find_depth_sensor("azure_kinect");
  written.shutter = {.readout = 0.0271, .depth_delay = -0.0153};
  written.disparity_bias = {.offset = 0.0123, .bow = -0.0045};
  written.ignore = (file_.parent_path() / "robot \"arm\".png").string();
  write_camera(file_, written);
  const Camera read = read_camera(file_.string());
  EXPECT_EQ(read.name, written.name);
  EXPECT_EQ(read.width, 1280);
  EXPECT_EQ(read.height, 960);
  EXPECT_EQ(read.fx, written.fx);
  EXPECT_EQ(read.fy, written.fy);
  EXPECT_EQ(read.cx, written.cx);
  EXPECT_EQ(read.cy, written.cy);
  EXPECT_EQ(read.distortion, written.distortion);
  EXPECT_EQ(read.depth_factor, written.depth_factor);
  EXPECT_EQ(read.fps, written.fps);
  EXPECT_EQ(read.baseline, written.baseline);
  EXPECT_EQ(read.depth_sensor.name, "azure_kinect");
  EXPECT_EQ(read.shutter, written.shutter);
  EXPECT_EQ(read.disparity_bias, written.disparity_bias);
  EXPECT_EQ(std::filesystem::path(read.ignore).lexically_normal(), written.ignore);
  EXPECT_EQ(read.depth_sensor.max_depth, written.depth_sensor.max_depth);
}

TEST_F(CameraFile, MayNameTheDepthSensor) {
  const std::string base =
      "width: 640\nheight: 480\nfx: 500\nfy: 501\ncx: 320\ncy: 240\ndepth_factor: 1000\n";
  EXPECT_EQ(load(base).depth_sensor.name, "kinect_v1");
  EXPECT_EQ(load(base).baseline, 0.075);
  const Camera stereo = load(base + "sensor: realsense_d455\n");
  EXPECT_EQ(stereo.depth_sensor.principle, DepthPrinciple::kActiveStereo);
  EXPECT_EQ(stereo.baseline, 0.095);
  EXPECT_EQ(load(base + "sensor: realsense_d455\nbaseline: 0.1\n").baseline, 0.1);
  EXPECT_EQ(load(base + "sensor: azure_kinect\n").baseline, 0.075);  // it has no baseline itself
}

TEST_F(CameraFile, DistortionMayBeShortOrMissing) {
  const std::string base =
      "width: 640\nheight: 480\nfx: 500\nfy: 501\ncx: 320\ncy: 240\ndepth_factor: 1000\n";
  EXPECT_FALSE(load(base).distorted());
  const Camera camera = load(base + "distortion: [0.1, -0.2]\n");
  EXPECT_EQ(camera.distortion(1), -0.2);
  EXPECT_EQ(camera.distortion(2), 0);
  EXPECT_EQ(camera.name, file_.stem().string());
}

TEST_F(CameraFile, ReadsOlderSettingsFilesWithMatricesAndTabs) {
  const Camera camera = load(
      "%YAML:1.0\n\n#-----\n# Camera Parameters\n#-----\n"
      "Camera.fx: 517.306408\nCamera.fy:\t516.469215\nCamera.cx: 318.643040\nCamera.cy: "
      "255.313989\n\n"
      "Camera.k1: 0.262383\nCamera.k2: -0.953104\nCamera.p1: -0.005358\nCamera.p2: 0.002628\n"
      "Camera.k3: 1.163314\n\nCamera.width: 640\nCamera.height: 480\n\n"
      "# Camera frames per second\nCamera.fps: 30.0\n\n# IR projector baseline times fx (aprox.)\n"
      "Camera.bf: 40.0\n\n# Color order\nCamera.RGB: 1\nThDepth: 40.0\nDepthMapFactor: 5000.0\n"
      "LEFT.D: !!opencv-matrix\n   rows: 1\n   cols: 5\n   dt: d\n   data:[-0.28, 0.07,\n     0.0, "
      "1e-5, 0.0]\n"
      "ORBextractor.nFeatures: 1000\n");
  EXPECT_EQ(camera.fx, 517.306408);
  EXPECT_EQ(camera.fy, 516.469215);
  EXPECT_EQ(camera.distortion(4), 1.163314);
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.fps, 30);
  EXPECT_EQ(camera.depth_factor, 5000);
  EXPECT_NEAR(camera.bf(), 40, 1e-9);
}

TEST_F(CameraFile, ReadsNewerSettingsFiles) {
  const Camera camera = load(
      "%YAML:1.0\nFile.version: \"1.0\"\nCamera.type: \"PinHole\"\nCamera1.fx: 535.4\nCamera1.fy: "
      "539.2\n"
      "Camera1.cx: 320.1\nCamera1.cy: 247.6\nCamera1.k1: 0.1\nCamera.width: 640\nCamera.height: "
      "480\n"
      "Camera.fps: 15\nCamera.RGB: 1\nStereo.ThDepth: 40.0\nStereo.b: 0.0745\nRGBD.DepthMapFactor: "
      "1000.0\n"
      "IMU.T_b_c1: !!opencv-matrix\n  rows: 2\n  cols: 2\n  dt: f\n  data: [1.0, 0.0,\n         "
      "0.0, 1.0]\n");
  EXPECT_EQ(camera.fx, 535.4);
  EXPECT_EQ(camera.distortion(0), 0.1);
  EXPECT_EQ(camera.distortion(1), 0);
  EXPECT_EQ(camera.fps, 15);
  EXPECT_EQ(camera.depth_factor, 1000);
  EXPECT_NEAR(camera.baseline, 0.0745, 1e-12);
}

TEST_F(CameraFile, ReadsFilesOfTheBenchmarkTool) {
  const Camera camera = load(
      "%YAML:1.0\nCamera.fx: 528.0\nCamera.fy: 528.0\nCamera.cx: 321.0\nCamera.cy: "
      "239.5\nCamera.k1: 0.0\n"
      "Camera.k2: 0.0\nCamera.p1: 0.0\nCamera.p2: 0.0\nCamera.width: 640\nCamera.height: 480\n"
      "Camera.fps: 30.0\nDepthMapFactor: 5000.0\n");
  const Camera kitchen = read_camera("kitchen");
  EXPECT_EQ(camera.fx, kitchen.fx);
  EXPECT_EQ(camera.cx, kitchen.cx);
  EXPECT_FALSE(camera.distorted());
}

}  // namespace
}  // namespace stillmap
