// SPDX-License-Identifier: Apache-2.0
// Camera files as other programs write them.
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/lens.hpp"

#include <fstream>
#include <sstream>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/core.hpp>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

namespace fs = std::filesystem;

class CameraFormats : public ::testing::Test {
 protected:
  /// Returns the camera of a file with this text, for images of 640 x 480 pixels.
  Camera load(const std::string& text, const std::string& name = "camera.yaml") {
    fs::create_directories(folder_);
    std::ofstream(folder_ / name) << text;
    return read_camera((folder_ / name).string(), [] { return cv::Size(640, 480); });
  }
  void TearDown() override { fs::remove_all(folder_); }

  /// Expects the camera that all files of this test describe.
  static void expect_same(const Camera& camera, double depth_factor = 1000) {
    EXPECT_EQ(camera.width, 640);
    EXPECT_EQ(camera.height, 480);
    EXPECT_EQ(camera.fx, 525.5);
    EXPECT_EQ(camera.fy, 526.5);
    EXPECT_EQ(camera.cx, 319.25);
    EXPECT_EQ(camera.cy, 239.75);
    EXPECT_DOUBLE_EQ(camera.depth_factor, depth_factor);
  }
  static void expect_distortion(const Camera& camera, double k3) {
    const double expected[] = {0.1, -0.2, 0.001, 0.002, k3};
    for (int i = 0; i < 5; ++i) EXPECT_EQ(camera.distortion(i), expected[i]) << i;
  }

  fs::path folder_ = test::own_path("cameras");
};

constexpr const char* kMatrixOfSample = R"(camera_matrix: !!opencv-matrix
   rows: 3
   cols: 3
   dt: d
   data: [ 5.255e+02, 0., 3.1925e+02, 0.,
       5.265e+02, 2.3975e+02, 0., 0., 1. ]
distortion_coefficients: !!opencv-matrix
   rows: 5
   cols: 1
   dt: d
   data: [ 0.1, -0.2, 0.001, 0.002, 0.3 ]
)";

TEST_F(CameraFormats, YamlOfOpenCvsCalibrationSampleIsRead) {
  const Camera camera =
      load(std::string("%YAML:1.0\n---\ncalibration_time: \"Wed Mar  6 17:35:39 2019\"\n"
                       "image_width: 640\nimage_height: 480\nflags: 0\n") +
           kMatrixOfSample + "avg_reprojection_error: 1.6e-01\n");
  expect_same(camera);
  expect_distortion(camera, 0.3);
}

TEST_F(CameraFormats, OtherSpellingsOfOpenCvsUsersAreRead) {
  expect_same(
      load("cameraMatrix: {rows: 3, cols: 3, dt: d, data: [525.5, 0, 319.25, 0, 526.5, "
           "239.75, 0, 0, 1]}\ndistCoeffs: {data: [0.1, -0.2, 0.001, 0.002]}\n"
           "imageSize: [640, 480]\n"));
  expect_same(
      load("mtx: [[525.5, 0, 319.25], [0, 526.5, 239.75], [0, 0, 1]]\n"
           "dist: [[0.1, -0.2, 0.001, 0.002, 0.3]]\n"));
  expect_distortion(load("Camera_Matrix: {data: [525.5, 0, 319.25, 0, 526.5, 239.75, 0, 0, 1]}\n"
                         "Distortion_Coefficients: {data: [0.1, -0.2, 0.001, 0.002, 0.3]}\n"),
                    0.3);
}

TEST_F(CameraFormats, XmlOfOpenCvIsRead) {
  const std::string text = R"(<?xml version="1.0"?>
<opencv_storage>
<!-- a comment -->
<calibration_Time>"Wed Mar  6 17:35:39 2019"</calibration_Time>
<image_Width>640</image_Width>
<image_Height>480</image_Height>
<Camera_Matrix type_id="opencv-matrix">
  <rows>3</rows>
  <cols>3</cols>
  <dt>d</dt>
  <data>
    5.255e+02 0. 3.1925e+02 0. 5.265e+02
    2.3975e+02 0. 0. 1.</data></Camera_Matrix>
<Distortion_Coefficients type_id="opencv-matrix">
  <rows>5</rows><cols>1</cols><dt>d</dt>
  <data>0.1 -0.2 0.001 0.002 0.3</data></Distortion_Coefficients>
<images><_>1.png</_><_>2.png</_></images>
</opencv_storage>
)";
  const Camera camera = load(text, "camera.xml");
  expect_same(camera);
  expect_distortion(camera, 0.3);
  EXPECT_THAT(error_of([&] { load(text.substr(0, text.size() / 2), "camera.xml"); }),
              HasSubstr("is truncated: <"));
  std::string deep = "<opencv_storage>";
  for (int i = 0; i < 10000; ++i) deep += "<a>";
  EXPECT_THAT(error_of([&] { load(deep, "camera.xml"); }), HasSubstr("too deeply"));
}

TEST_F(CameraFormats, AFisheyeOfOpenCvHasAtMostFourCoefficients) {
  EXPECT_THAT(error_of([&] { load(std::string("fisheye_model: 1\n") + kMatrixOfSample); }),
              AllOf(HasSubstr("'fisheye' at most 4"), HasSubstr("rectify")));
}

/// Returns the largest distance of the pixels of a lens from those of a camera's Brown model.
double difference(const Camera& camera, const LensDistortion& lens) {
  Camera pinhole = camera;
  pinhole.distortion.setZero();
  const auto [x, y] = rectification_maps(pinhole, lens);
  const auto [u, v] = rectification_maps(
      pinhole, {.coefficients = {camera.distortion.begin(), camera.distortion.end()}});
  return std::max(cv::norm(x, u, cv::NORM_INF), cv::norm(y, v, cv::NORM_INF));
}

TEST_F(CameraFormats, BrownsModelIsFittedToOtherLensesOfFewDegrees) {
  const std::string matrix =
      "camera_matrix: {data: [610, 0, 320, 0, 610, 240, 0, 0, 1]}\ndistortion_coefficients: "
      "{data: ";
  const std::vector<double> rational{0.52, -2.6, 0.0006, -0.0002, 1.5, 0.4, -2.4, 1.4};
  const Camera kinect = load(matrix +
                             "[0.52, -2.6, 0.0006, -0.0002, 1.5, 0.4, -2.4, 1.4]}\n"
                             "distortion_model: rational_polynomial\n");
  EXPECT_LT(difference(kinect, {.coefficients = rational}), 0.25);
  const Camera fisheye =
      load(matrix + "[0.01, -0.02, 0.003, 0.001]}\ndistortion_model: equidistant\n");
  EXPECT_LT(difference(fisheye, {LensDistortion::Model::kFisheye, {0.01, -0.02, 0.003, 0.001}}),
            0.25);
  EXPECT_LT(fisheye.distortion(0), -0.2) << "r = atan(tan(theta)) = tan(theta) - tan(theta)^3 / 3";
}

TEST_F(CameraFormats, AWideFisheyeIsRefusedWithTheDifference) {
  const std::string wide =
      "Camera.type: KannalaBrandt8\nCamera1.fx: 190\nCamera1.fy: 190\nCamera1.cx: 320\nCamera1.cy: "
      "240\nCamera1.k1: 0.003\nCamera1.k2: 0.0007\nCamera1.k3: -0.002\nCamera1.k4: 0.0002\n"
      "RGBD.DepthMapFactor: 1000\n";
  EXPECT_THAT(error_of([&] { load(wide); }),
              AllOf(HasSubstr("the lens has a fisheye model"), HasSubstr("rectify the images")));
}

TEST_F(CameraFormats, OfRtabMapAreReadWithTheirRectification) {
  const std::string rest = R"(distortion_coefficients:
   rows: 1
   cols: 5
   data: [ 0.1, -0.2, 0.001, 0.002, 0.3 ]
distortion_model: plumb_bob
rectification_matrix:
   rows: 3
   cols: 3
   data: [ 0.9999, -0.001, 0.01, 0.001, 0.9999, -0.003, -0.01, 0.003, 0.9999 ]
projection_matrix:
   rows: 3
   cols: 4
   data: [ 525.5, 0., 319.25, 0., 0., 526.5, 239.75, 0., 0., 0., 1., 0. ]
local_transform:
   rows: 3
   cols: 4
   data: [ 0., 0., 1., 0., -1., 0., 0., 0., 0., -1., 0., 0. ]
)";
  const std::string head =
      "%YAML:1.0\n---\ncamera_name: \"0001\"\nimage_width: 640\nimage_height: 480\n"
      "camera_matrix:\n   rows: 3\n   cols: 3\n   data: ";
  const Camera camera =
      load(head + "[ 525.5, 0., 319.25, 0.,\n      526.5, 239.75, 0., 0., 1. ]\n" + rest);
  expect_same(camera);
  expect_distortion(camera, 0.3);
  // As versions before 2024 wrote it when they exported images.
  expect_same(load(head + "[ 525.5, 0., 319.25, 0., 0.,\n      526.5, 239.75, 0., 0. ]\n" + rest));
}

TEST_F(CameraFormats, OfStellaVslamAndOpenVslamAreRead) {
  const std::string values =
      "name: \"a camera\"\nsetup: \"RGBD\"\nmodel: \"perspective\"\nfx: 525.5\nfy: 526.5\n"
      "cx: 319.25\ncy: 239.75\nk1: 0.1\nk2: -0.2\np1: 0.001\np2: 0.002\nk3: 0.3\nfps: 15.0\n"
      "focal_x_baseline: 52.55\ncolor_order: \"RGB\"\n";
  std::string nested = "Camera:\n", flat;
  std::istringstream lines(values);
  for (std::string line; std::getline(lines, line);) {
    nested += "  " + line + '\n';
    flat += "Camera." + line + '\n';
  }
  nested += "Preprocessing:\n  min_size: 800\n  depthmap_factor: 5000.0\n";
  flat += "Camera.cols: 640\nCamera.rows: 480\ndepthmap_factor: 5000.0\n";
  for (const std::string& text : {nested, flat}) {
    const Camera camera = load(text);
    expect_same(camera, 5000);
    expect_distortion(camera, 0.3);
    EXPECT_EQ(camera.fps, 15);
    EXPECT_NEAR(camera.baseline, 0.1, 1e-12);
  }
  std::string panorama = nested;
  panorama.replace(panorama.find("perspective"), 11, "equirectangular");
  EXPECT_THAT(error_of([&] { load(panorama); }),
              AllOf(HasSubstr("key 'Camera.model'"), HasSubstr("'equirectangular' is not supp")));
}

TEST_F(CameraFormats, OfVinsAreRead) {
  const std::string text =
      "%YAML:1.0\n---\nmodel_type: PINHOLE\ncamera_name: camera\nimage_width: 640\n"
      "image_height: 480\ndistortion_parameters:\n   k1: 0.1\n   k2: -0.2\n   p1: 0.001\n"
      "   p2: 0.002\nprojection_parameters:\n   fx: 525.5\n   fy: 526.5\n   cx: 319.25\n"
      "   cy: 239.75\n";
  const Camera camera = load(text);
  expect_same(camera);
  expect_distortion(camera, 0);
  std::string other = text;
  other.replace(other.find("PINHOLE"), 7, "MEI");
  EXPECT_THAT(error_of([&] { load(other); }), HasSubstr("'MEI' is not supported"));
  EXPECT_THAT(error_of([&] { load(text.substr(0, text.find("   cy"))); }),
              HasSubstr("the key 'projection_parameters.cy' is missing"));
}

TEST_F(CameraFormats, OfNiceSlamAndItsReplicaDataAreRead) {
  const Camera camera = load(
      "inherit_from: configs/nice_slam.yaml\nscale: 1\nmapping:\n  bound: [[-1.0, 7.0]]\n"
      "cam: #intrinsic is of the images before they are cropped\n  H: 480\n  W: 640\n"
      "  fx: 525.5\n  fy: 526.5\n  cx: 319.25\n  cy: 239.75\n  png_depth_scale: 5000.0\n"
      "  crop_edge: 8\n  distortion: [0.1, -0.2, 0.001, 0.002, 0.3]\n");
  expect_same(camera, 5000);
  expect_distortion(camera, 0.3);
  expect_same(load(R"({"camera": {"w": 640, "h": 480, "fx": 525.5, "fy": 526.5, "cx": 319.25,
                      "cy": 239.75, "scale": 6553.5}})",
                   "cam_params.json"),
              6553.5);
  EXPECT_THAT(
      error_of([&] { load("cam:\n  fx: 525.5\n  fy: 526.5\n  cx: 319.25\n  cy: 239.75\n"); }),
      HasSubstr("the key 'cam.png_depth_scale' is missing"));
}

TEST_F(CameraFormats, OfMonoGsAreRead) {
  const Camera camera = load(
      "dataset:\n  type: tum\n  Calibration:\n    fx: 525.5\n    fy: 526.5\n    cx: 319.25\n"
      "    cy: 239.75\n    k1: 0.1\n    k2: -0.2\n    p1: 0.001\n    p2: 0.002\n    k3: 0.3\n"
      "    width: 640\n    height: 480\n    depth_scale: 5000.0\n    distorted: True\n");
  expect_same(camera, 5000);
  expect_distortion(camera, 0.3);
}

TEST_F(CameraFormats, OfNerfstudioAndInstantNgpAreRead) {
  const std::string values =
      R"("fl_x": 525.5, "fl_y": 526.5, "cx": 319.25, "cy": 239.75, "w": 640, "h": 480, "k1": 0.1,
  "k2": -0.2, "p1": 0.001, "p2": 0.002, "frames": [{"file_path": "rgb/0.png",
  "transform_matrix": [[1, 0, 0, 0], [0, 1, 0, 0], [0, 0, 1, 0], [0, 0, 0, 1]]}])";
  const Camera camera = load(R"({"camera_model": "OPENCV", )" + values + "}", "transforms.json");
  expect_same(camera);
  expect_distortion(camera, 0);
  expect_same(load(R"({"integer_depth_scale": 0.0002, )" + values + "}", "transforms.json"), 5000);
  EXPECT_THAT(error_of([&] {
                load(R"({"camera_model": "EQUIRECTANGULAR", )" + values + "}", "transforms.json");
              }),
              HasSubstr("'EQUIRECTANGULAR' is not supported"));
  EXPECT_LT(load(R"({"camera_model": "OPENCV_FISHEYE", )" + values + "}", "t.json").distortion(0),
            0);
}

TEST_F(CameraFormats, OfPhonesAreRead) {
  expect_same(load(R"({"h": 480, "w": 640, "dw": 256, "dh": 192, "fps": 60,
                      "K": [525.5, 0, 0, 0, 526.5, 0, 319.25, 239.75, 1]})",
                   "metadata.json"));
  expect_same(load("525.5, 0.0, 319.25\n0.0, 526.5, 239.75\n0.0, 0.0, 1.0\n", "camera_matrix.csv"));
  expect_same(load("640 480 525.5 526.5 319.25 239.75\n", "1_2.3.pincam"));
  expect_same(load("525.5 526.5 319.25 239.75\n", "calibration.txt"), 5000);
  expect_same(load(R"({"fx": 525.5, "fy": 526.5, "cx": 319.25, "cy": 239.75, "width": 640,
                       "height": 480, "t_00": 1, "t_01": 0, "blur_score": 100})",
                   "polycam.json"));
  EXPECT_THAT(error_of([&] { load("1,2\n3,4,5\n", "camera_matrix.csv"); }),
              HasSubstr("expected 4, 6, 9 or 16 numbers, found 5"));
  EXPECT_THAT(error_of([&] { load("640 480 wide", "1.pincam"); }),
              HasSubstr("expected a number, found 'wide'"));
}

TEST_F(CameraFormats, OfPlainMatricesAreRead) {
  expect_same(load("525.5 0 319.25\n0 526.5 239.75\n0 0 1\n", "K.txt"));
  expect_same(
      load("525.5 0 319.25 0\n0 526.5 239.75 0\n0 0 1 0\n0 0 0 1\n", "intrinsic_color.txt"));
  EXPECT_THAT(error_of([&] { load("525.5 0 0\n0 526.5 0\n319.25 239.75 1\n", "K.txt"); }),
              HasSubstr("the camera matrix is transposed"));
}

TEST_F(CameraFormats, OfColmapAreReadWithTheirCenterOfPixels) {
  const std::string header = "# CAMERA_ID, MODEL, WIDTH, HEIGHT, PARAMS[]\n";
  expect_same(load(header + "1 PINHOLE 640 480 525.5 526.5 319.75 240.25\n", "cameras.txt"));
  const Camera camera = load(
      header + "1 OPENCV 640 480 525.5 526.5 319.75 240.25 0.1 -0.2 0.001 0.002\n", "cameras.txt");
  expect_same(camera);
  expect_distortion(camera, 0);
  const Camera radial = load("1 SIMPLE_RADIAL 640 480 525.5 319.75 240.25 0.1\n", "cameras.txt");
  EXPECT_EQ(radial.fy, 525.5);
  EXPECT_EQ(radial.cx, 319.25);
  EXPECT_EQ(radial.distortion(0), 0.1);
  EXPECT_THAT(error_of([&] { load("1 FOV 640 480 525 525 320 240 1\n", "cameras.txt"); }),
              HasSubstr("'FOV' is not supported"));
  EXPECT_THAT(error_of([&] {
                load("1 PINHOLE 640 480 5 5 3 2\n2 PINHOLE 640 480 5 5 3 2\n", "cameras.txt");
              }),
              HasSubstr("expected one camera with 8 values, found 16"));
}

TEST_F(CameraFormats, OfEurocAndMonoGsAreRead) {
  const Camera euroc = load(R"(sensor_type: camera
T_BS: {cols: 4, rows: 4, data: [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]}
rate_hz: 20
resolution: [640, 480]
camera_model: pinhole
intrinsics: [525.5, 526.5, 319.25, 239.75]
distortion_model: radial-tangential
distortion_coefficients: [0.1, -0.2, 0.001, 0.002]
)");
  expect_same(euroc);
  expect_distortion(euroc, 0);
  EXPECT_EQ(euroc.fps, 20);
  expect_same(load(R"(inherit_from: "configs/rgbd/tum/base_config.yaml"
Dataset:
  dataset_path: "datasets/desk"
  Calibration: {fx: 525.5, fy: 526.5, cx: 319.25, cy: 239.75, width: 640, height: 480,
                depth_scale: 5000.0, distorted: False}
)"),
              5000);
}

TEST_F(CameraFormats, WithoutTheSizeOfTheImagesAreRefusedWhereThereAreNone) {
  const std::string text = "cameraMatrix: {data: [525.5, 0, 319.25, 0, 526.5, 239.75, 0, 0, 1]}\n";
  expect_same(load(text));
  EXPECT_THAT(
      error_of([&] { read_camera((folder_ / "camera.yaml").string()); }),
      AllOf(HasSubstr("does not contain the size of the images"), HasSubstr("image_width")));
}

TEST_F(CameraFormats, MayBeUtf16) {
  std::string text = "\xFF\xFE";
  for (const char c : std::string("640 480 525.5 526.5 319.25 239.75\r\n")) text += {c, '\0'};
  expect_same(load(text, "1.pincam"));
}

}  // namespace
}  // namespace stillmap
