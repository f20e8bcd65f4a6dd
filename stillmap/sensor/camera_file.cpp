// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/sensor/camera_formats.hpp"
#include "stillmap/sensor/camera_values.hpp"
#include "stillmap/sensor/lens.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

Camera make_preset(const std::string& name, std::array<double, 4> intrinsics,
                   std::array<double, 5> distortion) {
  Camera camera;
  camera.name = name;
  std::tie(camera.fx, camera.fy, camera.cx, camera.cy) = std::tuple_cat(intrinsics);
  camera.distortion = Eigen::Map<const Eigen::Matrix<double, 5, 1>>(distortion.data());
  return camera;
}

/// Returns the Intel RealSense D435i: color of 1280 x 720 with a field of view of 69.4 by 42.5
/// degrees (D400 series datasheet), depth registered to it in millimeters.
Camera realsense_d435i() {
  Camera camera = make_preset("realsense_d435i", {924.3, 925.6, 639.5, 359.5}, {});
  camera.width = 1280;
  camera.height = 720;
  camera.depth_factor = 1000;
  camera.depth_sensor = find_depth_sensor("realsense_d435i");
  camera.baseline = camera.depth_sensor.baseline;
  return camera;
}

const std::vector<Camera>& presets() {
  static const std::vector<Camera> cameras{
      make_preset("tum_fr1", {517.3, 516.5, 318.6, 255.3},
                  {0.2624, -0.9531, -0.0054, 0.0026, 1.1633}),
      make_preset("tum_fr2", {520.9, 521.0, 325.1, 249.7},
                  {0.2312, -0.7849, -0.0033, -0.0001, 0.9172}),
      make_preset("tum_fr3", {535.4, 539.2, 320.1, 247.6}, {}),
      make_preset("kitchen", {528, 528, 321, 239.5}, {}),
      make_preset("bonn", {542.822841, 542.576870, 315.593520, 237.756098},
                  {0.039903, -0.099343, -0.000730, -0.000144, 0}),
      make_preset("icl_nuim", {481.2, 480, 319.5, 239.5}, {}),
      make_preset("seven_scenes", {585, 585, 320, 240}, {}),
      realsense_d435i()};
  return cameras;
}

// The unit of the depth images of 7-Scenes is the millimeter; the other data sets use that of TUM.
Camera with_unit(Camera camera) {
  if (camera.name == "seven_scenes") camera.depth_factor = 1000;
  return camera;
}

// ORB-SLAM's names of its settings files.
std::string preset_name(const std::string& name) {
  for (const char* number : {"1", "2", "3"}) {
    if (name == std::string("TUM") + number) return std::string("tum_fr") + number;
  }
  return name;
}

/// Returns the distortion of a camera, to whose lens Brown's model with five coefficients is fitted
/// if it has another one. Throws Error (naming `where`) if that differs by more than a fraction of
/// the error of a keypoint.
Eigen::Matrix<double, 5, 1> distortion_of(const FileCamera& camera, const std::string& where) {
  constexpr double kLargestError = 0.25;  // pixels
  const auto& [model, coefficients] = camera.lens;
  Eigen::Matrix<double, 5, 1> distortion = Eigen::Matrix<double, 5, 1>::Zero();
  if (model == LensDistortion::Model::kBrown && coefficients.size() <= 5) {
    std::copy(coefficients.begin(), coefficients.end(), distortion.begin());
    return distortion;
  }
  const BrownFit fit = fit_brown(camera, camera.lens);
  if (fit.error <= kLargestError) return fit.coefficients;
  const char* name = model == LensDistortion::Model::kFisheye        ? "fisheye"
                     : model == LensDistortion::Model::kInverseBrown ? "inverse"
                                                                     : "rational";
  throw Error(fmt::format("the lens has a {} model, from which Brown's with k1 k2 p1 p2 k3 differs "
                          "by {:.2g} pixels; at most {:g} are accepted",
                          name, fit.error, kLargestError),
              where, "rectify the images, and give the camera of the rectified ones");
}

Camera camera_in(const fs::path& file, const ImageSize& image_size) {
  FileCamera camera;
  try {
    camera = read_camera_format(file);
  } catch (const YAML::Exception& e) {
    throw Error("is no camera file: " + e.msg, file.string(), kCameraFix);
  }
  if (camera.name == Camera().name) camera.name = file.stem().string();
  if (camera.width == 0) {
    const std::optional<cv::Size> size = image_size ? image_size() : std::nullopt;
    if (!size) {
      throw Error(
          "does not contain the size of the images", file.string(),
          "add lines 'image_width: VALUE' and 'image_height: VALUE', or write the camera in "
          "our own format");
    }
    camera.width = size->width, camera.height = size->height;
  }
  check_camera(camera, file.string());
  camera.distortion = distortion_of(camera, file.string());
  check_camera(camera, file.string());
  return camera;
}

/// Returns the lines of a key with a rigid motion.
std::string motion_text(const char* key, const Pose& T) {
  const Eigen::Matrix3d R = T.rotation();
  const Eigen::Vector3d& t = T.translation();
  std::string text = fmt::format("{}:  # rotation and translation [m], row by row\n  [", key);
  for (Eigen::Index i = 0; i < 3; ++i)
    text += fmt::format("{}, {}, {}, {},\n   ", R(i, 0), R(i, 1), R(i, 2), t(i));
  return text + "0, 0, 0, 1]\n";
}

/// Returns the lines of the noise that is not that of the IMU's name.
std::string noise_text(const Imu& imu) {
  const Imu known = find_imu(imu.name);
  std::string text;
  for (const auto& [key, value] : kImuNoiseKeys) {
    if (imu.*value != known.*value) text += fmt::format("{}: {}\n", key, imu.*value);
  }
  return text;
}

}  // namespace

const std::vector<std::string>& camera_presets() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> all;
    for (const auto& camera : presets()) all.push_back(camera.name);
    return all;
  }();
  return names;
}

Camera read_camera(const std::string& name_or_file) { return read_camera(name_or_file, {}); }

Camera read_camera(const std::string& name_or_file, const ImageSize& image_size) {
  for (const auto& camera : presets()) {
    if (camera.name == preset_name(name_or_file)) return with_unit(camera);
  }
  std::error_code ignored;
  if (fs::is_directory(name_or_file, ignored)) {
    throw Error("is a folder, not a camera", name_or_file,
                "name the camera file itself, such as " +
                    (fs::path(name_or_file) / "camera.yaml").string());
  }
  if (!fs::exists(name_or_file, ignored)) {
    const std::string stem = preset_name(fs::path(name_or_file).stem().string());
    const Keys& known = camera_presets();
    if (std::find(known.begin(), known.end(), stem) != known.end()) {
      throw Error("does not exist", name_or_file,
                  fmt::format("its camera is known by name: --camera {}", stem));
    }
    throw Error(
        "is neither a known camera nor a file", "camera '" + name_or_file + "'",
        "give the path of a camera file or a name: " + suggestion(name_or_file, camera_presets()));
  }
  return camera_in(name_or_file, image_size);
}

std::string camera_of_dataset(const fs::path& folder) {
  std::error_code ignored;
  const std::string path = fs::absolute(folder, ignored).lexically_normal().string();
  const std::pair<const char*, const char*> datasets[] = {
      {"rgbd_dataset_freiburg1", "tum_fr1"}, {"rgbd_dataset_freiburg2", "tum_fr2"},
      {"rgbd_dataset_freiburg3", "tum_fr3"}, {"rgbd_bonn_", "bonn"},
      {"living_room_traj", "icl_nuim"},      {"office_room_traj", "icl_nuim"},
      {"traj0_frei_png", "icl_nuim"},        {"traj1_frei_png", "icl_nuim"},
      {"traj2_frei_png", "icl_nuim"},        {"traj3_frei_png", "icl_nuim"}};
  for (const auto& [part, camera] : datasets) {
    if (path.find(part) != std::string::npos) return camera;
  }
  return "";
}

void write_camera(const fs::path& file, const Camera& camera) {
  YAML::Emitter name;
  name << YAML::DoubleQuoted << camera.name;
  std::string text = fmt::format("name: {}\n", name.c_str());
  text += fmt::format("width: {}  # pixels\nheight: {}\n", camera.width, camera.height);
  text += fmt::format("fx: {}  # pixels\nfy: {}\ncx: {}\ncy: {}\n", camera.fx, camera.fy, camera.cx,
                      camera.cy);
  const auto& d = camera.distortion;
  text += fmt::format("distortion: [{}, {}, {}, {}, {}]  # k1 k2 p1 p2 k3\n", d(0), d(1), d(2),
                      d(3), d(4));
  text += fmt::format("depth_factor: {}  # raw depth units per meter\n", camera.depth_factor);
  text += fmt::format("fps: {}  # Hz\n", camera.fps);
  text += fmt::format("baseline: {}  # meters, of the virtual second camera\n", camera.baseline);
  text += fmt::format("sensor: {}\n", camera.depth_sensor.name);
  if (camera.shutter) {
    text += fmt::format("readout: {}  # seconds from the first to the last row\n",
                        camera.shutter->readout);
    text += fmt::format("depth_delay: {}  # seconds after the timestamps of the depth images\n",
                        camera.shutter->depth_delay);
  }
  if (camera.disparity_bias != DisparityBias{}) {
    text += fmt::format("disparity_offset: {}  # 1/m, 1 / measured depth - 1 / depth\n",
                        camera.disparity_bias.offset);
    text += fmt::format("disparity_bow: {}  # 1/m, the same in the corners of the image\n",
                        camera.disparity_bias.bow);
  }
  if (camera.imu) {
    text += fmt::format("imu: {}\n", camera.imu->name) + noise_text(*camera.imu) +
            motion_text("T_camera_imu", camera.imu->T_camera_imu);
    text += fmt::format(
        "imu_time_offset: {}  # seconds, stamp of a sample minus time of an image of the same "
        "moment\n",
        camera.imu->time_offset);
  }
  if (camera.wheels) text += motion_text("T_camera_base", camera.wheels->T_camera_base);
  if (!camera.ignore.empty()) {
    YAML::Emitter ignore;
    ignore << YAML::DoubleQuoted
           << fs::proximate(camera.ignore, fs::absolute(file).parent_path()).string();
    text += fmt::format(
        "ignore: {}  # mask of the robot itself: pixels that are not black are ignored\n",
        ignore.c_str());
  }
  write_file(file, text);
}

namespace {

/// Throws Error unless files can name the depth sensor, and its figures are those of a sensor.
void check_depth_sensor(const DepthSensor& sensor, const std::string& where) {
  const auto& known = depth_sensor_names();
  if (std::find(known.begin(), known.end(), sensor.name) == known.end()) {
    throw Error(fmt::format("'{}' is no known depth sensor", printable(sensor.name)), where,
                suggestion(sensor.name, known));
  }
  const bool range = sensor.min_depth >= 0 && sensor.min_depth < sensor.max_depth;
  if (range && sensor.sigma(sensor.min_depth) >= 0 && sensor.sigma(sensor.max_depth) >= 0) return;
  throw Error(fmt::format("the depth sensor measures from {} m to {} m with standard deviations "
                          "from {} m to {} m",
                          sensor.min_depth, sensor.max_depth, sensor.sigma(sensor.min_depth),
                          sensor.sigma(sensor.max_depth)),
              where, fmt::format("take find_depth_sensor() of one of {}", fmt::join(known, ", ")));
}

}  // namespace

void check_camera(const Camera& camera, const std::string& where) {
  check_depth_sensor(camera.depth_sensor, where);
  const auto expect = [&](bool holds, const std::string& key, double found,
                          const std::string& wanted) {
    if (!holds) {
      throw Error(fmt::format("{} is {}", key, found), where, fmt::format("expected {}", wanted));
    }
  };
  for (const int size : {camera.width, camera.height}) {
    expect(size >= 32 && size <= 16384, "the image's width or height", size, "32 to 16384 pixels");
  }
  const double largest = 20.0 * camera.width;
  for (const double f : {camera.fx, camera.fy}) {
    expect(f > 0.05 * camera.width && f < largest, "the focal length fx or fy", f,
           fmt::format("pixels, not millimeters: {:g} to {:g} for this width", 0.05 * camera.width,
                       largest));
  }
  expect(camera.cx >= 0 && camera.cx < camera.width, "cx", camera.cx,
         fmt::format("a pixel of the image, about {:g}", (camera.width - 1) / 2.0));
  expect(camera.cy >= 0 && camera.cy < camera.height, "cy", camera.cy,
         fmt::format("a pixel of the image, about {:g}", (camera.height - 1) / 2.0));
  expect(camera.cx > 0 || camera.cy > 0, "the principal point (cx, cy)", 0,
         "a point near the center of the image, not its corner");
  for (const double k : camera.distortion) {
    expect(std::abs(k) < 100, "a distortion coefficient", k,
           "k1 k2 p1 p2 k3 of normalized coordinates");
  }
  expect(camera.depth_factor >= 1 && camera.depth_factor < 1e6, "the depth factor",
         camera.depth_factor,
         "raw units per meter (5000 for TUM, 1000 for millimeters), not meters per unit");
  expect(camera.fps > 0 && camera.fps <= 1000, "fps", camera.fps, "frames per second, such as 30");
  expect(camera.baseline > 0 && camera.baseline < 10, "the baseline", camera.baseline,
         "meters, such as 0.075 (Camera.bf is fx times that)");
  for (const double error : {camera.disparity_bias.offset, camera.disparity_bias.bow}) {
    expect(std::abs(error) < 0.2, "the disparity offset or bow", error,
           "1/m, such as 0.01: 1 / measured depth minus 1 / depth");
  }
  if (!camera.shutter) return;
  expect(std::abs(camera.shutter->readout) < 0.2, "the readout time", camera.shutter->readout,
         "seconds from the first to the last row, such as 0.027");
  expect(std::abs(camera.shutter->depth_delay) < 0.2, "the depth delay",
         camera.shutter->depth_delay, "seconds, such as -0.015");
}

}  // namespace stillmap
