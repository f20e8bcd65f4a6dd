// SPDX-License-Identifier: Apache-2.0
// Folders and camera files as other data sets and programs have them.
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

namespace fs = std::filesystem;

SourceOptions with_camera() {
  SourceOptions options;
  options.recorded = TestSequence::camera();
  return options;
}

void write_images(const TestSequence& sequence, const std::string& color,
                  const std::string& depth) {
  fs::create_directories(sequence.path(color).parent_path());
  fs::create_directories(sequence.path(depth).parent_path());
  sequence.write_image(color, TestSequence::color_image());
  sequence.write_image(depth, TestSequence::depth_image());
}

// A sequence without lists and images.
void clear(const TestSequence& sequence) {
  for (const auto& entry : fs::directory_iterator(sequence.folder())) fs::remove_all(entry.path());
}

TEST(FolderLayout, SevenScenesPairsTheImagesOfOneNumber) {
  const TestSequence sequence(0);
  clear(sequence);
  for (const char* frame : {"frame-000000", "frame-000001", "frame-000003"})
    write_images(sequence, std::string(frame) + ".color.png", std::string(frame) + ".depth.png");
  sequence.write("frame-000000.pose.txt", "1 0 0 0\n");
  SourceOptions options = with_camera();
  options.fps = 10;
  const auto frames = all_frames(*make_source(sequence.folder().string(), options));
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_DOUBLE_EQ(frames[2]->timestamp, 0.3);
  EXPECT_GT(cv::countNonZero(frames[2]->depth), 0);
  EXPECT_EQ(recorded_camera(sequence.folder().string()).depth_factor, 1000);
  EXPECT_EQ(recorded_camera(sequence.folder().string()).name, "seven_scenes");
}

TEST(FolderLayout, FoldersWithoutListsHaveTimesAsNames) {
  for (const auto& [first, second, depth] :
       {std::tuple("1305031102.175304", "1305031102.211214", "1305031102.160407"),
        std::tuple("1305031102175304000", "1305031102211214000", "1305031102160407000"),
        std::tuple("rgb_1305031102175", "rgb_1305031102211", "depth_1305031102160")}) {
    const TestSequence sequence(0);
    clear(sequence);
    write_images(sequence, fmt::format("color/{}.png", first), fmt::format("depth/{}.png", depth));
    sequence.write_image(fmt::format("color/{}.png", second), TestSequence::color_image());
    const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
    ASSERT_THAT(frames, SizeIs(2)) << first;
    EXPECT_NEAR(frames[0]->timestamp, 1305031102.175, 0.001);
    EXPECT_NEAR(frames[0]->depth_delay, -0.015, 0.001);
    EXPECT_EQ(cv::countNonZero(frames[1]->depth), 0);
  }
}

TEST(FolderLayout, FoldersWithoutListsMayHoldTiff) {
  const TestSequence sequence(0);
  clear(sequence);
  write_images(sequence, "rgb/0.png", "depth/0.tiff");
  write_images(sequence, "rgb/1.png", "depth/1.tif");
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_GT(cv::countNonZero(frames[1]->depth), 0);
}

TEST(FolderLayout, HiddenFilesOfMacsAreNoImages) {
  const TestSequence sequence(0);
  clear(sequence);
  write_images(sequence, "rgb/0.png", "depth/0.png");
  for (const char* name : {"rgb/._0.png", "depth/._0.png", "rgb/.DS_Store"})
    sequence.write(name, "no image");
  const auto source = make_source(sequence.folder().string(), with_camera());
  EXPECT_THAT(all_frames(*source), SizeIs(1));
  EXPECT_THAT(source->skipped(), SizeIs(0));
}

TEST(FolderLayout, ExtensionsMayBeInCapitals) {
  const TestSequence sequence(0);
  clear(sequence);
  write_images(sequence, "rgb/0.png", "depth/0.png");
  fs::rename(sequence.path("rgb/0.png"), sequence.path("rgb/0.PNG"));
  fs::rename(sequence.path("depth/0.png"), sequence.path("depth/0.PNG"));
  EXPECT_THAT(all_frames(*make_source(sequence.folder().string(), with_camera())), SizeIs(1));
}

TEST(FolderLayout, NamesMayHoldMoreThanTheTime) {
  for (const auto& [color, depth, time] :
       {std::tuple("000038_rgb", "000038_depth", 38 / 30.0),
        std::tuple("000038_10", "000038_10", 38 / 30.0),
        std::tuple("40753679_6792.023", "40753679_6792.023", 6792.023),
        std::tuple("2024-05-17_12-30-11.033", "2024-05-17_12-30-11.040", 1715949011.033),
        std::tuple("2024-05-17_12-30-11-033", "2024-05-17_12-30-11-040", 1715949011.033),
        std::tuple("2024-05-17T12:30:11.033771Z", "2024-05-17T12:30:11.040Z", 1715949011.033771),
        std::tuple("20240517_123011_033", "20240517_123011_040", 1715949011.033),
        std::tuple("IMG_20240517_123011033", "IMG_20240517_123011040", 1715949011.033),
        std::tuple("20240517_123011", "20240517_123011", 1715949011.0),
        std::tuple("20245117_123011.5", "20245117_123011.5", 123011.5)}) {  // no date
    const TestSequence sequence(0);
    clear(sequence);
    write_images(sequence, fmt::format("rgb/{}.png", color), fmt::format("depth/{}.png", depth));
    const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
    ASSERT_THAT(frames, SizeIs(1)) << color;
    EXPECT_NEAR(frames[0]->timestamp, time, 1e-6) << color;
    EXPECT_GT(cv::countNonZero(frames[0]->depth), 0) << color;
  }
}

TEST(FolderLayout, ListsMayNameFilesOfAnotherComputer) {
  for (const char* prefix : {"/home/somebody/recording/rgb/", R"(C:\recording\rgb\)", R"(rgb\)"}) {
    const TestSequence sequence(2);
    std::string list;
    for (const auto* name : {"0.png", "1.png"})
      list += fmt::format("{} {}{}\n", name[0], prefix, name);
    std::string depth = list;
    for (std::size_t at = 0; (at = depth.find("rgb", at)) != std::string::npos;)
      depth.replace(at, 3, "depth");
    sequence.write("rgb.txt", list);
    sequence.write("depth.txt", depth);
    EXPECT_THAT(all_frames(*make_source(sequence.folder().string(), with_camera())), SizeIs(2))
        << prefix;
  }
}

TEST(FolderLayout, AssociationsMayBeginWithThePose) {
  const TestSequence sequence(2);
  fs::remove(sequence.path("rgb.txt"));
  fs::remove(sequence.path("depth.txt"));
  sequence.write("associations.txt",
                 "0.001 1 2 3 0 0 0 1 0.01 rgb/0.png 0 depth/0.png\n"
                 "1.001 1 2 3 0 0 0 1 1.01 rgb/1.png 1 depth/1.png\n");
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_DOUBLE_EQ(frames[1]->timestamp, 1.01);
}

TEST(FolderLayout, AssociationsMayEndWithThePose) {
  const TestSequence sequence(2);
  fs::remove(sequence.path("rgb.txt"));
  fs::remove(sequence.path("depth.txt"));
  sequence.write("associations.txt",
                 "0.01 rgb/0.png 0 depth/0.png 0.001 1 2 3 0 0 0 1\n"
                 "1.01 rgb/1.png 1 depth/1.png 1.001 1 2 3 0 0 0 1\n");
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_DOUBLE_EQ(frames[1]->timestamp, 1.01);
}

TEST(FolderLayout, ListsMayBeginWithTheNamesOfTheirColumns) {
  const TestSequence sequence(2);
  sequence.write("rgb.txt", "timestamp filename\n100.0 rgb/0.png\n100.03 rgb/1.png\n");
  const auto source = make_source(sequence.folder().string(), with_camera());
  EXPECT_THAT(all_frames(*source), SizeIs(2));
  EXPECT_THAT(source->skipped(), testing::IsEmpty());
}

TEST(FolderLayout, FoldersHaveOtherNamesAndCapitals) {
  for (const auto& [color, depth] :
       {std::pair("RGB", "Depth"), {"images", "depths"}, {"image", "depth_raw"}}) {
    const TestSequence sequence(0);
    clear(sequence);
    write_images(sequence, fmt::format("{}/0.png", color), fmt::format("{}/0.png", depth));
    EXPECT_THAT(all_frames(*make_source(sequence.folder().string(), with_camera())), SizeIs(1))
        << color;
  }
}

TEST(FolderLayout, NumbersAreOrderedByValue) {
  const TestSequence sequence(0);
  clear(sequence);
  for (const int i : {2, 10, 9})
    write_images(sequence, fmt::format("rgb/{}.jpg", i), fmt::format("depth/{}.png", i));
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_DOUBLE_EQ(frames[2]->timestamp, 10 / 30.0);
}

TEST(FolderLayout, IclNuimHasDepthFirstAndNumbersForTimes) {
  const TestSequence sequence(3);
  fs::remove(sequence.path("rgb.txt"));
  fs::remove(sequence.path("depth.txt"));
  sequence.write(
      "associations.txt",
      "0 depth/0.png 0 rgb/0.png\n1 depth/1.png 1 rgb/1.png\n2 depth/2.png 2 rgb/2.png\n");
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_DOUBLE_EQ(frames[2]->timestamp, 2 / 30.0);
  EXPECT_EQ(cv::norm(frames[0]->color, TestSequence::color_image(), cv::NORM_INF), 0);
}

TEST(FolderLayout, ExchangedListsAreRecognizedByTheirImages) {
  const TestSequence sequence(3);
  fs::rename(sequence.path("rgb.txt"), sequence.path("both.txt"));
  fs::rename(sequence.path("depth.txt"), sequence.path("rgb.txt"));
  fs::rename(sequence.path("both.txt"), sequence.path("depth.txt"));
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(3));
  EXPECT_EQ(cv::norm(frames[0]->color, TestSequence::color_image(), cv::NORM_INF), 0);
}

TEST(FolderLayout, StampsSince1970MayBeInOtherUnits) {
  const TestSequence sequence(3);
  const double begin = 1305031229.5;
  constexpr double kAccuracy = 1e-6;  // s
  for (const double unit : {1e-3, 1e-6, 1e-9}) {
    std::string color, depth, both;
    for (int i = 0; i < 3; ++i) {
      const double stamp = (begin + 0.04 * i) / unit;
      color += fmt::format("{:.0f} rgb/{}.png\n", stamp, i);
      depth += fmt::format("{:.0f} depth/{}.png\n", stamp + 0.01 / unit, i);
      both += fmt::format("{:.0f} rgb/{}.png {:.0f} depth/{}.png\n", stamp, i, stamp, i);
    }
    sequence.write("rgb.txt", color);
    sequence.write("depth.txt", depth);
    sequence.write("pairs.txt", both);
    for (const fs::path& associations : {fs::path(), sequence.path("pairs.txt")}) {
      const auto frames = list_frames(find_sequence(sequence.folder(), associations)).frames;
      ASSERT_THAT(frames, SizeIs(3)) << unit;
      EXPECT_NEAR(frames[2].timestamp, begin + 0.08, kAccuracy);
      EXPECT_NEAR(frames[2].depth_timestamp, begin + (associations.empty() ? 0.09 : 0.08),
                  kAccuracy);
    }
  }
}

TEST(FolderLayout, OpenLorisHasListsOfColorAndAlignedDepth) {
  const TestSequence sequence(3);
  fs::rename(sequence.path("rgb.txt"), sequence.path("color.txt"));
  fs::rename(sequence.path("depth.txt"), sequence.path("aligned_depth.txt"));
  EXPECT_THAT(all_frames(*make_source(sequence.folder().string(), with_camera())), SizeIs(3));
}

TEST(FolderLayout, FoldersWithoutImagesOrTimesAreErrors) {
  const TestSequence sequence(0);
  clear(sequence);
  fs::create_directories(sequence.path("rgb"));
  fs::create_directories(sequence.path("depth"));
  const auto open = [&] { make_source(sequence.folder().string(), with_camera()); };
  EXPECT_THAT(error_of(open), HasSubstr("contains no image"));
  write_images(sequence, "rgb/a.png", "depth/b.png");
  EXPECT_THAT(error_of(open), HasSubstr("contains no image"));
}

TEST(FolderLayout, ImagesThatCannotBeReadAreNamed) {
  const TestSequence sequence(0);
  clear(sequence);
  for (const char* folder : {"rgb", "depth"}) fs::create_directories(sequence.path(folder));
  sequence.write("rgb/0.bmp", "x");
  const auto open = [&] { make_source(sequence.folder().string(), with_camera()); };
  EXPECT_THAT(error_of(open), HasSubstr("most of its files are '.bmp'"));
}

TEST(FolderLayout, NumbersThatRunAlongEachOtherWithAnOffsetAreAnError) {
  const TestSequence sequence(0);
  clear(sequence);
  for (int i = 0; i < 4; ++i)
    write_images(sequence, fmt::format("rgb/{}.png", i), fmt::format("depth/{}.png", i + 1));
  const auto open = [&] { return make_source(sequence.folder().string(), with_camera()); };
  EXPECT_THAT(error_of(open), HasSubstr("numbered 0 to 3, and as many depth images that are "
                                        "numbered 1 to 4"));
  fs::remove(sequence.path("depth/1.png"));  // a depth image that is missing is no offset
  fs::copy(sequence.path("depth/2.png"), sequence.path("depth/0.png"));
  const auto source = open();
  EXPECT_THAT(source->notes(), ::testing::Contains(HasSubstr("1 of 4 color images has no depth")));
}

TEST(FolderLayout, NamesOfOpen3dHaveANumberAndATime) {
  const TestSequence sequence(0);
  clear(sequence);
  for (const char* name : {"0000001-000000033369", "0000002-000000066738"})
    write_images(sequence, fmt::format("image/{}.jpg", name), fmt::format("depth/{}.png", name));
  const auto frames = all_frames(*make_source(sequence.folder().string(), with_camera()));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_DOUBLE_EQ(frames[1]->timestamp, 0.066738);
}

TEST(CameraNames, DataSetsAndOrbSlamNamesAreKnown) {
  EXPECT_EQ(read_camera("TUM3").fx, 535.4);
  EXPECT_EQ(read_camera("bonn").distortion[0], 0.039903);
  EXPECT_EQ(read_camera("icl_nuim").fx, 481.2);
  EXPECT_EQ(camera_of_dataset("/data/rgbd_dataset_freiburg2_desk/"), "tum_fr2");
  EXPECT_EQ(camera_of_dataset("rgbd_bonn_crowd2"), "bonn");
  EXPECT_EQ(camera_of_dataset("/data/living_room_traj1_frei_png"), "icl_nuim");
  EXPECT_EQ(camera_of_dataset("/data/mine"), "");
}

// What `ros2 topic echo --once` prints, shortened; `rostopic echo` names the lists D and K.
constexpr const char* kPrintedCameraInfo = R"(header:
  stamp:
    sec: 1700000000
    nanosec: 250000000
  frame_id: camera_color_optical_frame
height: 480
width: 640
distortion_model: plumb_bob
d:
- 0.1
- -0.2
- 0.001
- 0.002
- 0.0
k:
- 525.1
- 0.0
- 319.5
- 0.0
- 526.2
- 239.5
- 0.0
- 0.0
- 1.0
r: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]
p: [520.0, 0.0, 310.0, 0.0, 0.0, 521.0, 230.0, 0.0, 0.0, 0.0, 1.0, 0.0]
binning_x: 0
binning_y: 0
roi:
  x_offset: 0
  height: 0
  width: 0
  do_rectify: false
---
)";

TEST(CameraFiles, PrintedByRosAreRead) {
  const TestSequence sequence(0);
  const auto load = [&](const std::string& text) {
    sequence.write("info.yaml", text);
    return read_camera(sequence.path("info.yaml").string());
  };
  const Camera camera = load(kPrintedCameraInfo);
  EXPECT_EQ(camera.width, 640);
  EXPECT_EQ(camera.height, 480);
  EXPECT_EQ(camera.fx, 525.1);
  EXPECT_EQ(camera.fy, 526.2);
  EXPECT_EQ(camera.cx, 319.5);
  EXPECT_EQ(camera.cy, 239.5);
  EXPECT_EQ(camera.distortion[1], -0.2);
  EXPECT_EQ(camera.distortion[3], 0.002);
  EXPECT_EQ(camera.depth_factor, 1000);
  EXPECT_EQ(camera.name, "info");
  // Two messages of ROS 1, the second one cut.
  const std::string ros1 =
      "height: 480\nwidth: 640\ndistortion_model: \"plumb_bob\"\nD: [0.1, 0.0, 0.0, 0.0, 0.0]\n"
      "K: [525.1, 0.0, 319.5, 0.0, 526.2, 239.5, 0.0, 0.0, 1.0]\n---\n";
  EXPECT_EQ(load(ros1 + "height: 480\nwid").distortion[0], 0.1);
  EXPECT_THAT(error_of([&] { load("height: 480\nwidth: 640\nk: [525.1, 0.0]\n"); }),
              HasSubstr("key 'k': expected 9 numbers, found 2"));
}

TEST(CameraFiles, OfRosOpen3dAndRealSenseAreRead) {
  const TestSequence sequence(0);
  sequence.write("ros.yaml", R"(image_width: 640
image_height: 480
camera_name: head
camera_matrix:
  rows: 3
  cols: 3
  data: [525.1, 0, 319.5, 0, 526.2, 239.5, 0, 0, 1]
distortion_model: plumb_bob
distortion_coefficients: {rows: 1, cols: 5, data: [0.1, -0.2, 0.001, 0.002, 0]}
)");
  Camera camera = read_camera(sequence.path("ros.yaml").string());
  EXPECT_EQ(camera.fy, 526.2);
  EXPECT_EQ(camera.cx, 319.5);
  EXPECT_EQ(camera.distortion[1], -0.2);
  EXPECT_EQ(camera.depth_factor, 1000);

  sequence.write("open3d.json", R"({
    "width": 640, "height": 480,
    "intrinsic_matrix": [525.1, 0, 0, 0, 526.2, 0, 319.5, 239.5, 1]
})");
  camera = read_camera(sequence.path("open3d.json").string());
  EXPECT_EQ(camera.fx, 525.1);
  EXPECT_EQ(camera.cy, 239.5);
  sequence.write("parameters.json", R"({"class_name": "PinholeCameraParameters", "intrinsic": {
    "width": 640, "height": 480,
    "intrinsic_matrix": [525.1, 0, 0, 0, 526.2, 0, 319.5, 239.5, 1]}})");
  EXPECT_EQ(read_camera(sequence.path("parameters.json").string()).cx, 319.5);

  sequence.write("realsense.json", R"({"width": 640, "height": 480, "ppx": 319.5, "ppy": 239.5,
"fx": 615.1, "fy": 616.2, "model": "distortion.inverse_brown_conrady", "coeffs": [0, 0, 0, 0, 0], "depth_units": 0.00025})");
  camera = read_camera(sequence.path("realsense.json").string());
  EXPECT_EQ(camera.fy, 616.2);
  EXPECT_DOUBLE_EQ(camera.depth_factor, 4000);
  EXPECT_EQ(camera.depth_sensor.name, "realsense_d435i");

  sequence.write("bad.yaml",
                 "image_width: 640\nimage_height: 480\ncamera_matrix: {data: [1, 2]}\n");
  EXPECT_THAT(error_of([&] { read_camera(sequence.path("bad.yaml").string()); }),
              HasSubstr("expected 9 numbers, found 2"));
  sequence.write(
      "fisheye.yaml",
      "image_width: 640\nimage_height: 480\ncamera_matrix: {data: [525, 0, 320, 0, 525, 240, 0, 0, "
      "1]}\ndistortion_model: cylindrical\ndistortion_coefficients: {data: [0.1, 0, 0, 0]}\n");
  EXPECT_THAT(error_of([&] { read_camera(sequence.path("fisheye.yaml").string()); }),
              HasSubstr("rectify"));
}

TEST(CameraFiles, AMatrixOfOpen3dByRowsIsRead) {
  const TestSequence sequence(0);
  sequence.write("open3d.json", R"({"width": 640, "height": 480,
    "intrinsic_matrix": [525.1, 0, 319.5, 0, 526.2, 239.5, 0, 0, 1]})");
  const Camera camera = read_camera(sequence.path("open3d.json").string());
  EXPECT_EQ(camera.cx, 319.5);
  EXPECT_EQ(camera.cy, 239.5);
}

TEST(CameraFiles, OfRealSenseWithAnUnknownDistortionModelAreRefused) {
  const TestSequence sequence(0);
  const auto read = [&](const std::string& model) {
    sequence.write("realsense.json",
                   R"({"width": 640, "height": 480, "ppx": 319.5, "ppy": 239.5, "fx": 615.1,
                      "fy": 616.2, "coeffs": [0.1, -0.2, 0, 0, 0], "model": ")" +
                       model + "\"}");
    return read_camera(sequence.path("realsense.json").string());
  };
  EXPECT_EQ(read("distortion.brown_conrady").distortion(1), -0.2);
  EXPECT_THAT(error_of([&] { read("distortion.ftheta"); }), HasSubstr("rectify the images"));
}

TEST(CameraFiles, OfKalibrAreRead) {
  const TestSequence sequence(0);
  const auto read = [&](const std::string& model) {
    sequence.write("chain.yaml",
                   "cam0:\n  camera_model: pinhole\n  intrinsics: [461.6, 460.3, 363, "
                   "248.1]\n  distortion_model: " +
                       model +
                       "\n  distortion_coeffs: [-0.28, 0.07, 0.0002, 0.00001]\n"
                       "  resolution: [752, 480]\n  rostopic: /cam0/image_raw\n");
    return read_camera(sequence.path("chain.yaml").string());
  };
  const Camera camera = read("radtan");
  EXPECT_EQ(camera.width, 752);
  EXPECT_EQ(camera.fy, 460.3);
  EXPECT_EQ(camera.cx, 363);
  EXPECT_EQ(camera.distortion(0), -0.28);
  EXPECT_EQ(camera.depth_factor, 1000);
  EXPECT_EQ(read("radtan\n  depth_factor: 5000").depth_factor, 5000);
  EXPECT_THAT(error_of([&] { read("fov"); }), HasSubstr("rectify"));
  EXPECT_FALSE(camera.imu);
  const Imu imu = *read(
                       "radtan\n  T_cam_imu:\n  - [0.0, -1.0, 0.0, 0.1]\n  - [1.0, 0.0, 0.0, 0.2]\n"
                       "  - [0.0, 0.0, 1.0, 0.3]\n  - [0.0, 0.0, 0.0, 1.0]\n"
                       "  timeshift_cam_imu: 0.015")
                       .imu;
  EXPECT_EQ(imu.T_camera_imu.translation(), Eigen::Vector3d(0.1, 0.2, 0.3));
  EXPECT_TRUE((imu.T_camera_imu.rotation() * Eigen::Vector3d::UnitX())
                  .isApprox(Eigen::Vector3d::UnitY(), 1e-9));
  EXPECT_EQ(imu.time_offset, 0.015);
}

TEST(CameraFiles, WithThePrincipalPointInACornerAreRefused) {
  Camera camera = TestSequence::camera();
  camera.cx = camera.cy = 0;
  EXPECT_THAT(error_of([&] { check_camera(camera, "camera"); }), HasSubstr("principal point"));
}

TEST(CameraNames, AMissingFileOfAKnownNameSuggestsTheName) {
  EXPECT_THAT(error_of([] { read_camera("/nowhere/TUM1.yaml"); }), HasSubstr("--camera tum_fr1"));
}

}  // namespace
}  // namespace stillmap
