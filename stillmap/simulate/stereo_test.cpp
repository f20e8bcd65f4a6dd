// SPDX-License-Identifier: Apache-2.0
// Depth from rendered pairs of cameras, compared with the exact depth.
#include "stillmap/base/file.hpp"
#include "stillmap/base/test_error.hpp"
#include "stillmap/base/test_path.hpp"
#include "stillmap/sensor/image_file.hpp"
#include "stillmap/sensor/make_source.hpp"
#include "stillmap/sensor/stereo_folder.hpp"
#include "stillmap/simulate/renderer.hpp"
#include "stillmap/simulate/simulated_sequence.hpp"

#include <cmath>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <opencv2/calib3d.hpp>
#include <opencv2/imgproc.hpp>

namespace stillmap {
namespace {

using test::error_of;
using ::testing::HasSubstr;
using ::testing::SizeIs;

namespace fs = std::filesystem;

constexpr double kBaseline = 0.12;  // meters
constexpr int kFrames = 3;

Camera pinhole() {
  Camera camera;
  camera.width = 640;
  camera.height = 480;
  camera.fx = camera.fy = 450;
  camera.cx = 319.5;
  camera.cy = 239.5;
  camera.fps = 10;
  camera.depth_sensor = stereo_sensor(camera.fx, kBaseline);
  camera.baseline = kBaseline;
  return camera;
}

// An office without people, seen by a camera that moves.
class Office {
 public:
  Office() : sequence_({.people = 0, .camera = "xyz", .frames = kFrames}, pinhole()) {}

  // Renders a camera at a pose in the frame of the camera of a frame.
  simulate::Rendering view(int frame, const Pose& T_left_camera) const {
    const simulate::Mesh& room = sequence_.scene().statics;
    const simulate::Mesh* const meshes[] = {&room};
    const Pose T_world_camera =
        sequence_.T_world_camera(static_cast<std::size_t>(frame)) * T_left_camera;
    return simulate::render(pinhole(), T_world_camera, meshes, sequence_.scene().textures,
                            {.threads = 2});
  }

 private:
  SimulatedSequence sequence_;
};

const Office& office() {
  static const Office instance;
  return instance;
}

// Returns the 8-bit image of a camera with noise, 8UC3.
cv::Mat photo(const simulate::Rendering& view, int seed) {
  cv::Mat noise(view.color.size(), CV_32FC3), image;
  cv::theRNG().state = static_cast<std::uint64_t>(seed);
  cv::randn(noise, cv::Scalar::all(0), cv::Scalar::all(2));
  cv::Mat(view.color + noise).convertTo(image, CV_8UC3);
  return image;
}

cv::Mat gray(const cv::Mat& color) {
  cv::Mat image;
  cv::cvtColor(color, image, cv::COLOR_BGR2GRAY);
  return image;
}

// How well a depth image agrees with the truth.
struct Agreement {
  double density = 0;       // share of the pixels right of the border that have a depth
  double within_pixel = 0;  // share of these whose disparity is right within a pixel
  double sigma = 0;         // standard deviation of their disparities, by the median [pixels]
  double median = 0;        // median error of the disparity [pixels]
};

Agreement agreement(const cv::Mat& depth, const cv::Mat& truth, const Camera& camera) {
  std::vector<double> errors;
  int pixels = 0;
  const int border = static_cast<int>(camera.bf() / camera.depth_sensor.min_depth) + 16;
  for (int y = 0; y < depth.rows; ++y) {
    for (int x = border; x < depth.cols; ++x) {
      if (truth.at<float>(y, x) <= 0) continue;
      ++pixels;
      if (depth.at<float>(y, x) <= 0) continue;
      errors.push_back(camera.bf() / depth.at<float>(y, x) - camera.bf() / truth.at<float>(y, x));
    }
  }
  const auto median_of = [](std::vector<double> values) {
    std::nth_element(values.begin(), values.begin() + values.size() / 2, values.end());
    return values[values.size() / 2];
  };
  Agreement result;
  result.density = static_cast<double>(errors.size()) / pixels;
  result.median = median_of(errors);
  std::vector<double> deviations;
  int near = 0;
  for (const double error : errors) {
    deviations.push_back(std::abs(error - result.median));
    near += std::abs(error) < 1 ? 1 : 0;
  }
  result.within_pixel = static_cast<double>(near) / static_cast<double>(errors.size());
  result.sigma = 1.4826 * median_of(deviations);  // of a normal distribution
  return result;
}

Pose right_of(double baseline) { return {Eigen::Quaterniond::Identity(), {baseline, 0, 0}}; }

TEST(StereoMatcher, MeasuresTheDepthOfARenderedPairWithTheNoiseOfItsModel) {
  StereoMatcher matcher(pinhole());
  for (int frame = 0; frame < kFrames; ++frame) {
    const auto left = office().view(frame, {}), right = office().view(frame, right_of(kBaseline));
    const cv::Mat depth = matcher.depth(gray(photo(left, 1)), gray(photo(right, 2)));
    const Agreement found = agreement(depth, left.depth, pinhole());
    RecordProperty(fmt::format("frame_{}", frame),
                   fmt::format("density {:.2f}, within a pixel {:.3f}, sigma {:.3f}, median {:.3f}",
                               found.density, found.within_pixel, found.sigma, found.median));
    EXPECT_GT(found.density, 0.6);
    EXPECT_GT(found.within_pixel, 0.95);
    EXPECT_LT(found.sigma, 0.3);
    EXPECT_LT(std::abs(found.median), 0.1);
  }
}

TEST(StereoMatcher, RefusesImagesThatAreExchanged) {
  const cv::Mat left = gray(photo(office().view(0, {}), 1)),
                right = gray(photo(office().view(0, right_of(kBaseline)), 2));
  EXPECT_NO_THROW(StereoMatcher(pinhole()).check_order(left, right));
  EXPECT_THAT(test::error_of([&] { StereoMatcher(pinhole()).check_order(right, left); }),
              testing::HasSubstr("are exchanged"));
}

TEST(StereoMatcher, HasNoDepthWhereTheRightCameraSeesAnotherSurface) {
  // A board at 1 m in front of a wall at 3 m: left of the board the right camera does not see the
  // wall, over the difference of the disparities.
  cv::Mat wall(480, 640, CV_8UC1), board(240, 200, CV_8UC1);
  cv::theRNG().state = 3;
  cv::randu(wall, 0, 255);
  cv::randu(board, 0, 255);
  cv::GaussianBlur(wall, wall, {5, 5}, 0);
  cv::GaussianBlur(board, board, {5, 5}, 0);
  const int far = 18, near = 54;  // disparities [pixels]
  cv::Mat left = wall.clone(), right(480, 640, CV_8UC1, cv::Scalar(0));
  wall.colRange(far, 640).copyTo(right.colRange(0, 640 - far));
  board.copyTo(left(cv::Rect(300, 100, 200, 240)));
  board.copyTo(right(cv::Rect(300 - near, 100, 200, 240)));
  const cv::Mat depth = StereoMatcher(pinhole()).depth(left, right);
  EXPECT_NEAR(depth.at<float>(200, 400), 1, 0.01);
  EXPECT_NEAR(depth.at<float>(200, 200), 3, 0.05);
  EXPECT_NEAR(depth.at<float>(200, 560), 3, 0.05);
  const cv::Mat hidden = depth(cv::Rect(300 - (near - far) + 6, 130, near - far - 12, 180));
  EXPECT_LT(cv::countNonZero(hidden), 0.1 * static_cast<double>(hidden.total()));
}

// ---- folders

class TemporaryFolder {
 public:
  TemporaryFolder() : path_(test::own_path("stereo")) {
    fs::remove_all(path_);
    fs::create_directories(path_);
  }
  TemporaryFolder(const TemporaryFolder&) = delete;
  TemporaryFolder& operator=(const TemporaryFolder&) = delete;
  ~TemporaryFolder() { fs::remove_all(path_); }
  void write(const std::string& name, const std::string& text) const {
    fs::create_directories((path_ / name).parent_path());
    write_file(path_ / name, text);
  }
  void write_image(const std::string& name, const cv::Mat& image) const {
    fs::create_directories((path_ / name).parent_path());
    write_png(path_ / name, image);
  }
  std::string path() const { return path_.string(); }

 private:
  fs::path path_;
};

void write_kitti(const TemporaryFolder& folder, const std::string& calibration) {
  for (int i = 0; i < kFrames; ++i) {
    folder.write_image(fmt::format("image_2/{:06}.png", i), photo(office().view(i, {}), i));
    folder.write_image(fmt::format("image_3/{:06}.png", i),
                       photo(office().view(i, right_of(kBaseline)), i + 10));
  }
  folder.write("calib.txt", calibration);
}

std::string projection(const std::string& name, double x) {  // of a camera at x [m]
  return fmt::format("{}: 450 0 319.5 {} 0 450 239.5 0.1 0 0 1 0.002\n", name, -450 * x);
}

TEST(StereoFolder, OfKittiGivesTheLeftImagesWithDepth) {
  const TemporaryFolder folder;
  write_kitti(folder, projection("P0", 0) + projection("P1", 0.5) + projection("P2", -0.06) +
                          projection("P3", kBaseline - 0.06));
  folder.write("times.txt", "0.000000e+00\n1.0e-01\n2.0e-01\n");
  const auto source = make_source(folder.path());
  EXPECT_NEAR(source->camera().baseline, kBaseline, 1e-9);
  EXPECT_NEAR(source->camera().fps, 10, 1e-6);
  EXPECT_EQ(source->camera().depth_sensor.name, "stereo");
  EXPECT_EQ(source->camera().shutter, ShutterTiming{});
  EXPECT_THAT(source->notes()[0], HasSubstr("KITTI, image_2 and image_3"));
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = source->next();
    ASSERT_TRUE(frame);
    EXPECT_NEAR(frame->timestamp, 0.1 * i, 1e-9);
    EXPECT_EQ(cv::norm(frame->color, photo(office().view(i, {}), i), cv::NORM_INF), 0);
    const Agreement found = agreement(frame->depth, office().view(i, {}).depth, source->camera());
    EXPECT_GT(found.density, 0.6);
    EXPECT_GT(found.within_pixel, 0.95);
  }
  EXPECT_FALSE(source->next());
}

TEST(StereoFolder, WithoutARightImageAFrameHasNoDepth) {
  const TemporaryFolder folder;
  write_kitti(folder, projection("P2", 0) + projection("P3", kBaseline));
  fs::remove(fs::path(folder.path()) / "image_3/000001.png");
  const auto source = make_source(folder.path());
  source->next();
  EXPECT_EQ(cv::countNonZero(source->next()->depth), 0);
  EXPECT_GT(cv::countNonZero(source->next()->depth), 0);
  ASSERT_THAT(source->skipped(), SizeIs(1));
  EXPECT_THAT(source->skipped()[0].reason, HasSubstr("image_3/000001.png is missing"));
  EXPECT_FALSE(source->skipped()[0].frame_lost);
}

TEST(StereoFolder, AWrongCalibrationIsAnErrorWithAFix) {
  const TemporaryFolder folder;
  const auto open = [&](const std::string& calibration) {
    folder.write("calib.txt", calibration);
    return error_of([&] { make_source(folder.path()); });
  };
  write_kitti(folder, "");
  EXPECT_THAT(open("P2: 1 2 3\n"), HasSubstr("has no line 'P2' with 12 numbers"));
  EXPECT_THAT(open(projection("P2", 0.1) + projection("P3", 0)), HasSubstr("the baseline is -0.1"));
  EXPECT_THAT(open("P2: 0 0 0 0 0 0 0 0 0 0 0 0\n" + projection("P3", 0)),
              HasSubstr("no projection"));
  fs::remove(fs::path(folder.path()) / "calib.txt");
  EXPECT_THAT(error_of([&] { make_source(folder.path()); }), HasSubstr("calib.txt"));
}

// ---- rectification

constexpr std::array<double, 4> kLens{-0.28, 0.07, 0.0002, 0.00002};  // as of EuRoC's cameras

// Returns an image as a camera with distortion records the view of the pinhole camera.
cv::Mat distorted(const cv::Mat& view) {
  const cv::Matx33d K(450, 0, 319.5, 0, 450, 239.5, 0, 0, 1),
      recorded_intrinsics(430, 0, 315, 0, 431, 242, 0, 0, 1);
  cv::Mat pixels(view.rows * view.cols, 1, CV_32FC2), ideal;
  for (int y = 0; y < view.rows; ++y)
    for (int x = 0; x < view.cols; ++x)
      pixels.at<cv::Vec2f>(y * view.cols + x) =
          cv::Vec2f(static_cast<float>(x), static_cast<float>(y));
  const cv::TermCriteria until(cv::TermCriteria::COUNT + cv::TermCriteria::EPS, 50, 1e-10);
  cv::undistortPoints(pixels, ideal, recorded_intrinsics, kLens, cv::noArray(), K, until);
  cv::Mat image;
  cv::remap(view, image, ideal.reshape(2, view.rows), cv::noArray(), cv::INTER_LINEAR);
  return image;
}

std::string sensor_yaml(const Pose& T_body_camera) {
  Eigen::Matrix4d T = Eigen::Matrix4d::Identity();
  T.topLeftCorner<3, 3>() = T_body_camera.rotation();
  T.topRightCorner<3, 1>() = T_body_camera.translation();
  std::vector<double> rows;
  for (int i = 0; i < 16; ++i) rows.push_back(T(i / 4, i % 4));
  return fmt::format(
      "%YAML:1.0\nsensor_type: camera\nT_BS:\n  cols: 4\n  rows: 4\n  data: [{}]\nrate_hz: 20\n"
      "resolution: [640, 480]\ncamera_model: pinhole\nintrinsics: [430, 431, 315, 242]\n"
      "distortion_model: radial-tangential\ndistortion_coefficients: [{}]\n",
      fmt::join(rows, ", "), fmt::join(kLens, ", "));
}

TEST(StereoFolder, OfEurocRectifiesTwoTurnedCamerasWithDistortion) {
  const auto turned = [](double x, double y, double z) {
    return so3_exp(Eigen::Vector3d(x, y, z));
  };
  const Pose T_body_left(turned(0.1, 0.2, 1.5), {0.3, -0.1, 0.2});
  const Pose T_left_right(turned(0.01, -0.015, 0.008), {kBaseline, 0.002, -0.003});
  const TemporaryFolder folder;
  std::string list = "#timestamp [ns],filename\n";
  for (int i = 0; i < kFrames; ++i) {
    const auto name = fmt::format("{}.png", 1403636579763555584 + i * 50'000'000LL);
    folder.write_image("mav0/cam0/data/" + name, gray(distorted(photo(office().view(i, {}), i))));
    folder.write_image("mav0/cam1/data/" + name,
                       gray(distorted(photo(office().view(i, T_left_right), i + 10))));
    list += fmt::format("{},{}\r\n", fs::path(name).stem().string(), name);
  }
  for (const char* camera : {"mav0/cam0", "mav0/cam1"})
    folder.write(std::string(camera) + "/data.csv", list);
  folder.write("mav0/cam0/sensor.yaml", sensor_yaml(T_body_left));
  folder.write("mav0/cam1/sensor.yaml", sensor_yaml(T_body_left * T_left_right));
  // Ignored pixels are given for the recorded left images: here their black border and a stripe.
  cv::Mat stripe = distorted(cv::Mat(480, 640, CV_8UC1, cv::Scalar(255))) == 0;
  stripe.rowRange(400, 480).setTo(255);
  folder.write_image("ignore.png", stripe);
  SourceOptions options;
  options.ignore = folder.path() + "/ignore.png";
  const auto source = make_source(folder.path(), options);
  const Camera& camera = source->camera();
  EXPECT_NEAR(camera.baseline, T_left_right.translation().norm(), 1e-9);
  EXPECT_NEAR(camera.fps, 20, 1e-3);
  // The camera of the frames is the left one, turned: its depth along its own axis is rendered.
  const Eigen::Vector3d x = T_left_right.translation().normalized();
  const Eigen::Vector3d ahead =
      Eigen::Vector3d::UnitZ() + T_left_right.rotation() * Eigen::Vector3d::UnitZ();
  const Eigen::Vector3d y = ahead.cross(x).normalized();
  Eigen::Matrix3d axes;
  axes << x, y, x.cross(y);
  const SimulatedSequence sequence({.people = 0, .camera = "xyz", .frames = kFrames}, camera);
  const simulate::Mesh* const meshes[] = {&sequence.scene().statics};
  for (int i = 0; i < kFrames; ++i) {
    const auto frame = source->next();
    ASSERT_TRUE(frame);
    const Pose T_world_camera = SimulatedSequence({.people = 0, .camera = "xyz", .frames = kFrames},
                                                  pinhole(), sequence.shared_scene())
                                    .T_world_camera(static_cast<std::size_t>(i)) *
                                Pose(axes, Eigen::Vector3d::Zero());
    const auto truth = simulate::render(camera, T_world_camera, meshes, sequence.scene().textures,
                                        {.color = false, .threads = 2});
    // The recorded images are black where the pinhole camera did not see.
    cv::Mat seen = cv::Mat::zeros(truth.depth.size(), CV_32FC1);
    const cv::Rect middle(60, 60, camera.width - 120, camera.height - 120);
    truth.depth(middle).copyTo(seen(middle));
    const Agreement found = agreement(frame->depth, seen, camera);
    EXPECT_GT(found.density, 0.5);
    EXPECT_GT(found.within_pixel, 0.93);
    EXPECT_LT(std::abs(found.median), 0.1);
    EXPECT_EQ(cv::countNonZero(frame->ignored & (frame->depth > 0)), 0);
    EXPECT_NE(frame->ignored.at<uchar>(440, 320), 0);
    EXPECT_EQ(frame->ignored.at<uchar>(240, 320), 0);
  }
}

TEST(StereoRig, TheSecondCameraMustBeRightOfTheFirst) {
  const RecordedCamera camera{
      .width = 640, .height = 480, .fx = 450, .fy = 450, .cx = 320, .cy = 240, .lens = {}};
  EXPECT_THAT(error_of([&] {
                calibrated_rig({camera, right_of(0.1)}, {camera, {}}, 20, "rig");
              }),
              HasSubstr("not to its right"));
  RecordedCamera small = camera;
  small.width = 320;
  EXPECT_THAT(error_of([&] {
                calibrated_rig({camera, {}}, {small, right_of(0.1)}, 20, "rig");
              }),
              HasSubstr("give images of one size"));
}

}  // namespace
}  // namespace stillmap
