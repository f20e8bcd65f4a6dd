// SPDX-License-Identifier: Apache-2.0
// Folders of phone apps and of published data sets, and formats of depth files.
#include "stillmap/sensor/camera_file.hpp"
#include "stillmap/sensor/doctor.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/npy_image.hpp"
#include "stillmap/sensor/test_sequence.hpp"

#include <ImfChannelList.h>
#include <ImfFrameBuffer.h>
#include <ImfHeader.h>
#include <ImfOutputFile.h>
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <functional>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::AllOf;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::SizeIs;

namespace fs = std::filesystem;

/// An empty folder for a layout, with images of 64 x 48 pixels unless stated otherwise.
class ProgramFolder : public ::testing::Test {
 protected:
  ProgramFolder() {
    for (const auto& entry : fs::directory_iterator(sequence_.folder()))
      fs::remove_all(entry.path());
  }
  void write(const std::string& name, std::string_view text) const {
    fs::create_directories(sequence_.path(name).parent_path());
    sequence_.write(name, text);
  }
  void write_color(const std::string& name, cv::Size size = {64, 48}) const {
    fs::create_directories(sequence_.path(name).parent_path());
    sequence_.write_image(name, TestSequence::color_image(size));
  }
  /// Writes a depth image of 2 m in millimeters.
  void write_depth(const std::string& name, cv::Size size = {64, 48}) const {
    fs::create_directories(sequence_.path(name).parent_path());
    sequence_.write_image(name, cv::Mat(size, CV_16UC1, cv::Scalar(2000)));
  }
  std::unique_ptr<FrameSource> open(const SourceOptions& options = {}) const {
    return make_source(sequence_.folder().string(), options);
  }
  /// Opens the folder with the camera of TestSequence, in millimeters.
  std::unique_ptr<FrameSource> open_with_camera() const {
    SourceOptions options;
    options.recorded = TestSequence::camera();
    options.recorded->depth_factor = 1000;
    return open(options);
  }

  TestSequence sequence_{0};
};

/// Expects frames of these times whose depth is 2 m everywhere.
void expect_frames(FrameSource& source, const std::vector<double>& times) {
  const auto frames = all_frames(source);
  ASSERT_THAT(frames, SizeIs(times.size()));
  for (std::size_t i = 0; i < times.size(); ++i) {
    EXPECT_NEAR(frames[i]->timestamp, times[i], 1e-9);
    EXPECT_EQ(frames[i]->color.size(), cv::Size(source.camera().width, source.camera().height));
    EXPECT_LT(
        cv::norm(frames[i]->depth, cv::Mat(frames[i]->depth.size(), CV_32FC1, 2.0), cv::NORM_INF),
        1e-3);
  }
}

TEST_F(ProgramFolder, OfReplicaHasItsCameraBesideTheScenes) {
  write("cam_params.json", R"({"camera": {"w": 64, "h": 48, "fx": 60, "fy": 60, "cx": 31.5,
                              "cy": 23.5, "scale": 6553.5}})");
  for (const char* number : {"000000", "000001"}) {
    write_color(fmt::format("room0/results/frame{}.jpg", number));
    sequence_.write_image(fmt::format("room0/results/depth{}.png", number),
                          cv::Mat(48, 64, CV_16UC1, cv::Scalar(13107)));
  }
  write("room0/traj.txt", "1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1\n");
  const std::string scene = sequence_.path("room0").string();
  const auto source = make_source(scene);
  expect_frames(*source, {0, 1 / 30.0});
  EXPECT_EQ(source->camera().name, "cam_params");
  EXPECT_EQ(true_trajectory_file(scene), sequence_.path("room0/traj.txt"));
  fs::remove(sequence_.path("cam_params.json"));
  EXPECT_THAT(error_of([&] { make_source(scene); }), HasSubstr("add --camera"));
}

TEST_F(ProgramFolder, OfStrayScannerHasTimesAndCameraInTables) {
  for (const char* number : {"000000", "000001"}) {
    write_color(fmt::format("rgb/{}.jpg", number), {128, 96});
    write_depth(fmt::format("depth/{}.png", number));
  }
  write("camera_matrix.csv", "120.0,0.0,63.5\n0.0,120.0,47.5\n0.0,0.0,1.0\n");
  write("odometry.csv",
        "timestamp, frame, x, y, z, qx, qy, qz, qw\n"
        "5.5, 000000, 0, 0, 0, 0, 0, 0, 1\n5.517, 000001, 0, 0, 0, 0, 0, 0, 1\n");
  const auto source = open();
  expect_frames(*source, {5.5, 5.517});
  EXPECT_EQ(source->camera().fx, 60);
  EXPECT_EQ(source->camera().cx, 31.5);
  EXPECT_THAT(source->notes(), Contains(HasSubstr("color images of 128 x 96 pixels are scaled")));
}

TEST_F(ProgramFolder, OfStrayScannerWithoutFramesOfItsVideoTellsHowToWriteThem) {
  write_depth("depth/000000.png");
  write("rgb.mp4", "a video");
  EXPECT_THAT(error_of([&] { open(); }),
              AllOf(HasSubstr("as a video, rgb.mp4"), HasSubstr("ffmpeg -noautorotate -i rgb.mp4"),
                    HasSubstr("-start_number 0")));
}

TEST_F(ProgramFolder, WhoseFramesOfAVideoBeginWithOneIsAnError) {
  for (const int number : {0, 1, 2}) {
    write_color(fmt::format("rgb/{:06}.jpg", number + 1));
    write_depth(fmt::format("depth/{:06}.png", number));
  }
  write("odometry.csv", "timestamp, frame\n5.5, 0\n5.6, 1\n5.7, 2\n5.8, 3\n");
  EXPECT_THAT(error_of([&] { open_with_camera(); }), HasSubstr("numbered 1 to 3"));
}

TEST_F(ProgramFolder, OfRecord3dHasTimesAndCameraInItsMetadata) {
  for (const char* number : {"0", "1"}) {
    write_color(fmt::format("rgb/{}.jpg", number), {96, 128});
    write_depth(fmt::format("depth/{}.png", number), {48, 64});
  }
  write("metadata.json", R"({"h": 128, "w": 96, "dw": 48, "dh": 64, "fps": 60,
      "K": [120, 0, 0, 0, 120, 0, 47.5, 63.5, 1], "frameTimestamps": [7.5, 7.6]})");
  const auto source = open();
  expect_frames(*source, {7.5, 7.6});
  EXPECT_EQ(source->camera().width, 48);
  EXPECT_EQ(source->camera().cy, 31.5);
}

TEST_F(ProgramFolder, OfArkitScenesHasItsIntrinsicsPerImage) {
  for (const char* time : {"6792.023", "6792.123"}) {
    write_color(fmt::format("lowres_wide/40753679_{}.png", time));
    write_depth(fmt::format("lowres_depth/40753679_{}.png", time));
    write(fmt::format("lowres_wide_intrinsics/40753679_{}.pincam", time), "64 48 60 60 31.5 23.5");
  }
  write("lowres_wide.traj", "6792.023 0 0 0 0 0 0\n");
  expect_frames(*open(), {6792.023, 6792.123});
  EXPECT_EQ(true_trajectory_file(sequence_.folder().string()), sequence_.path("lowres_wide.traj"));
}

TEST_F(ProgramFolder, WithLargerColorIsExaminedByDoctor) {
  for (int i = 0; i < 4; ++i) {
    write_color(fmt::format("rgb/{}.png", i), {128, 96});
    write_depth(fmt::format("depth/{}.png", i));
  }
  write("camera_matrix.csv", "120.0,0.0,63.5\n0.0,120.0,47.5\n0.0,0.0,1.0\n");
  const Diagnosis diagnosis = diagnose(sequence_.folder(), std::nullopt, {}, {});
  EXPECT_EQ(diagnosis.usable_frames, 4U);
}

TEST_F(ProgramFolder, WithColorOfAnotherShapeIsAnError) {
  write_color("rgb/0.png", {128, 72});
  write_depth("depth/0.png");
  EXPECT_THAT(error_of([&] { open_with_camera(); }), HasSubstr("128 x 72 pixels where the camera"));
}

TEST_F(ProgramFolder, WithADepthFactorForFloatsButWholeNumbersIsAnError) {
  write_color("rgb/0.png");
  write_depth("depth/0.png");
  write("orb.yaml",
        "%YAML:1.0\nCamera.fx: 60\nCamera.fy: 60\nCamera.cx: 31.5\nCamera.cy: 23.5\n"
        "Camera.width: 64\nCamera.height: 48\nDepthMapFactor: 1.0\n");
  SourceOptions options;
  options.camera = sequence_.path("orb.yaml").string();
  EXPECT_THAT(error_of([&] { open(options); }),
              AllOf(HasSubstr("the depth factor is 1, but depth/0.png has whole numbers"),
                    HasSubstr("1000 for millimeters")));
}

// ---- depth files

/// Returns an array as numpy.save() writes it.
std::string npy(const std::string& type, const std::string& shape, const cv::Mat& numbers,
                bool by_columns = false) {
  std::string header = fmt::format("{{'descr': '{}', 'fortran_order': {}, 'shape': {}, }}", type,
                                   by_columns ? "True" : "False", shape);
  header.resize(117, ' ');
  header += '\n';
  const std::string_view data(reinterpret_cast<const char*>(numbers.data),
                              numbers.total() * numbers.elemSize());
  return std::string("\x93NUMPY\x01\x00\x76\x00", 10) + header + std::string(data);
}

TEST_F(ProgramFolder, MayHoldDepthAsNumpyArrays) {
  for (int i = 0; i < 3; ++i) write_color(fmt::format("rgb/{}.png", i));
  write("depth/0.npy", npy("<f4", "(48, 64)", cv::Mat(48, 64, CV_32FC1, 2.0)));
  write("depth/1.npy", npy("<f8", "(48, 64, 1)", cv::Mat(48, 64, CV_64FC1, 2.0)));
  write("depth/2.npy", npy("<u2", "(48, 64)", cv::Mat(48, 64, CV_16UC1, 2000)));
  expect_frames(*open_with_camera(), {0, 1 / 30.0, 2 / 30.0});
}

TEST_F(ProgramFolder, MayHoldArraysOfAnyNumbersAndOrder) {
  cv::Mat1f ramp(2, 3);
  for (int i = 0; i < 6; ++i) ramp(i / 3, i % 3) = static_cast<float>(1 + i);
  const auto decoded = [&](const std::string& type, int opencv, const std::string& shape,
                           const std::function<cv::Mat(cv::Mat)>& stored, bool by_columns) {
    cv::Mat numbers;
    ramp.convertTo(numbers, opencv);
    const std::string file = npy(type, shape, stored(numbers), by_columns);
    cv::Mat image = decode_npy({reinterpret_cast<const unsigned char*>(file.data()), file.size()});
    image.convertTo(image, CV_32F);
    return image;
  };
  const auto as_is = [](const cv::Mat& m) { return m; };
  const auto columns = [](const cv::Mat& m) { return cv::Mat(m.t()); };
  const auto swapped = [](cv::Mat m) {
    for (std::size_t i = 0; i < m.total(); ++i)
      std::reverse(m.data + i * m.elemSize(), m.data + (i + 1) * m.elemSize());
    return m;
  };
  for (const cv::Mat& image : {decoded("<f2", CV_16F, "(2, 3)", as_is, false),
                               decoded("<i4", CV_32S, "(2, 3)", as_is, false),
                               decoded("<i2", CV_16S, "(1, 2, 3)", as_is, false),
                               decoded(">f4", CV_32F, "(2, 3)", swapped, false),
                               decoded(">u2", CV_16U, "(2, 3)", swapped, false),
                               decoded("<f8", CV_64F, "(2, 3)", columns, true)}) {
    ASSERT_EQ(image.size(), ramp.size());
    EXPECT_EQ(cv::norm(image, ramp, cv::NORM_INF), 0) << image;
  }
}

TEST_F(ProgramFolder, ToldWhatIsWrongWithArrays) {
  const std::string good = npy("<f4", "(48, 64)", cv::Mat(48, 64, CV_32FC1, 2.0));
  const auto problem = [&](const std::string& bytes) {
    write("0.npy", bytes);
    const HeaderRead read = read_image_header(sequence_.path("0.npy"));
    return read.problem.empty() ? depth_problem(read.header) : read.problem;
  };
  EXPECT_EQ(problem(good), "");
  EXPECT_THAT(problem(good.substr(0, good.size() - 1)), HasSubstr("is truncated"));
  EXPECT_THAT(problem(good.substr(0, 50)), HasSubstr("is no array"));
  EXPECT_THAT(problem(npy("<f4", "(48, 64, 3)", cv::Mat(48, 64, CV_32FC3))),
              HasSubstr("is no array"));
  EXPECT_THAT(problem(npy("<i8", "(24, 64)", cv::Mat(48, 64, CV_32SC1))), HasSubstr("(signed)"));
}

/// Writes an OpenEXR file whose only channel is a ramp from left to right [m].
void write_exr(const fs::path& file, cv::Size size, Imf::PixelType type,
               Imf::Compression compression) {
  Imf::Header header(size.width, size.height);
  header.compression() = compression;
  header.channels().insert("R", Imf::Channel(type));
  cv::Mat ramp(size, CV_32FC1);
  for (int x = 0; x < size.width; ++x) ramp.col(x) = 1 + 0.25F * static_cast<float>(x);
  cv::Mat pixels = ramp;
  if (type == Imf::HALF) ramp.convertTo(pixels, CV_16F);
  Imf::FrameBuffer buffer;
  buffer.insert(
      "R", Imf::Slice(type, reinterpret_cast<char*>(pixels.data), pixels.elemSize(), pixels.step));
  Imf::OutputFile out(file.c_str(), header);
  out.setFrameBuffer(buffer);
  out.writePixels(size.height);
}

TEST_F(ProgramFolder, ReadsDepthOfOpenExr) {
  for (const auto type : {Imf::HALF, Imf::FLOAT}) {
    for (const auto compression :
         {Imf::NO_COMPRESSION, Imf::RLE_COMPRESSION, Imf::ZIP_COMPRESSION, Imf::PIZ_COMPRESSION}) {
      const fs::path file = sequence_.path("ramp.exr");
      write_exr(file, {64, 48}, type, compression);
      const ImageRead read = read_depth_image(file, {64, 48});
      ASSERT_EQ(read.problem, "");
      EXPECT_EQ(read.image.at<float>(0, 0), 1);
      EXPECT_EQ(read.image.at<float>(47, 63), 16.75F);
    }
  }
}

TEST_F(ProgramFolder, TellsWhatIsWrongWithOpenExr) {
  const fs::path file = sequence_.path("0.exr");
  write_exr(file, {64, 24}, Imf::FLOAT, Imf::NO_COMPRESSION);
  EXPECT_THAT(read_depth_image(file, {64, 48}).problem, HasSubstr("is 64 x 24 pixels"));
  write_exr(file, {64, 48}, Imf::FLOAT, Imf::ZIP_COMPRESSION);
  const auto whole = fs::file_size(file);
  for (const auto bytes : {whole - 1, whole / 2, std::uintmax_t{40}}) {
    fs::resize_file(file, bytes);
    EXPECT_THAT(read_depth_image(file, {64, 48}).problem, HasSubstr("damaged"));
  }
}

// ---- lists

TEST(Lists, MayBeUtf16AndNameFilesWithBlanks) {
  const TestSequence sequence(2);
  for (const char* folder : {"rgb", "depth"}) {
    for (const char* number : {"0", "1"})
      fs::rename(sequence.path(fmt::format("{}/{}.png", folder, number)),
                 sequence.path(fmt::format("{}/my image {}.png", folder, number)));
    std::string list = "\xFF\xFE";
    for (const char c :
         fmt::format("0.0 {0}/my image 0.png\r\n0.1 \"{0}/my image 1.png\"\r\n", folder))
      list += {c, '\0'};
    sequence.write(fmt::format("{}.txt", folder), list);
  }
  SourceOptions options;
  options.recorded = TestSequence::camera();
  const auto frames = all_frames(*make_source(sequence.folder().string(), options));
  ASSERT_THAT(frames, SizeIs(2));
  EXPECT_GT(cv::countNonZero(frames[1]->depth), 0);
  EXPECT_EQ(frames[1]->name, "my image 1");
}

TEST(Lists, OfPairsMayNameFilesWithBlanks) {
  const TestSequence sequence(1);
  for (const char* name : {"rgb.txt", "depth.txt"}) fs::remove(sequence.path(name));
  for (const char* folder : {"rgb", "depth"})
    fs::rename(sequence.path(fmt::format("{}/0.png", folder)),
               sequence.path(fmt::format("{}/a 2 b.png", folder)));
  sequence.write("associations.txt", "1.5 rgb/a 2 b.png 1.51 depth/a 2 b.png\n");
  SourceOptions options;
  options.recorded = TestSequence::camera();
  const auto frames = all_frames(*make_source(sequence.folder().string(), options));
  ASSERT_THAT(frames, SizeIs(1));
  EXPECT_NEAR(frames[0]->depth_delay, 0.01, 1e-9);
}

}  // namespace
}  // namespace stillmap
