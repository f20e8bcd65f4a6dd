// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_formats.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/base/number.hpp"
#include "stillmap/geometry/rigid_motion.hpp"
#include "stillmap/sensor/camera_values.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <span>
#include <sstream>
#include <string>
#include <vector>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

/// Depth factor of files that contain none [1/m]: most drivers write millimeters.
constexpr double kMillimeters = 1000;

// ---- parts of several formats

/// Returns a camera without intrinsics; its size is 0 if the file has none of these keys.
FileCamera camera_of_size(const CameraValues& values, const Keys& width, const Keys& height) {
  FileCamera camera;
  camera.width = camera.height = 0;
  if (!values.has(width) && !values.has(height)) return camera;
  camera.width = values.whole(width);
  camera.height = values.whole(height);
  return camera;
}

void set_size(Camera& camera, double width, double height) {
  const auto pixels = [](double value) { return static_cast<int>(std::clamp(value, 0.0, 1e6)); };
  camera.width = pixels(width), camera.height = pixels(height);
}

void set_intrinsics(Camera& camera, double fx, double fy, double cx, double cy) {
  camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
}

/// Sets the intrinsics from the keys fx, fy, cx and cy with a prefix.
void set_intrinsics(Camera& camera, const CameraValues& values, const std::string& prefix) {
  set_intrinsics(camera, values.number({prefix + "fx"}), values.number({prefix + "fy"}),
                 values.number({prefix + "cx"}), values.number({prefix + "cy"}));
}

/// Returns the text of a key; empty if the file does not have it.
std::string text_or_none(const CameraValues& values, const std::string& key) {
  return values.has({key}) ? values.text(key) : "";
}

/// Throws Error if the key names an unknown model of cameras.
void require_model(const CameraValues& values, const std::string& key) {
  const std::string model = text_or_none(values, key);
  if (lens_model(model)) return;
  throw Error(fmt::format("the camera model '{}' is not supported", printable(model)),
              values.where(key),
              "rectify the images to a pinhole camera first and give its parameters");
}

/// Returns the lens with the coefficients k1, k2, p1, p2 and k3 to k6 with a prefix, of which
/// missing ones are 0, or of k1, which is needed, to k4 of a fisheye model.
LensDistortion lens_by_keys(const CameraValues& values, const std::string& model,
                            const std::string& prefix) {
  std::vector<double> coefficients;
  if (lens_model(model) == LensDistortion::Model::kFisheye) {
    coefficients.push_back(values.number({prefix + "k1"}));
    for (const char* key : {"k2", "k3", "k4"})
      coefficients.push_back(values.number_or({prefix + key}, 0));
  } else {
    for (const char* key : {"k1", "k2", "p1", "p2", "k3", "k4", "k5", "k6"})
      coefficients.push_back(values.number_or({prefix + key}, 0));
  }
  return lens_of(printable(model), coefficients, values.file().string());
}

/// Returns the lens with the coefficients of a list, if there is one.
LensDistortion lens_of_list(const CameraValues& values, const std::string& model,
                            const std::string& key) {
  if (!values.has({key})) return {};
  return lens_of(printable(model), values.matrix(key, 0), values.where(key));
}

// ---- our own format

void refuse_unknown_keys(const CameraValues& values) {
  Keys known{"name",
             "width",
             "height",
             "fx",
             "fy",
             "cx",
             "cy",
             "distortion",
             "depth_factor",
             "fps",
             "baseline",
             "sensor",
             "readout",
             "depth_delay",
             "disparity_offset",
             "disparity_bow",
             "ignore",
             "imu",
             "T_camera_imu",
             "T_camera_base",
             "imu_time_offset"};
  for (const auto& noise : kImuNoiseKeys) known.emplace_back(noise.key);
  for (const auto& key : values.keys()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    throw Error("is not a key of a camera file", values.where(key), suggestion(key, known));
  }
}

DepthSensor sensor_of(const CameraValues& values, const Camera& camera) {
  const std::string name = values.text("sensor");
  const auto& known = depth_sensor_names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    throw Error(fmt::format("'{}' is no known depth sensor", printable(name)),
                values.where("sensor"), suggestion(name, known));
  }
  return depth_sensor_of(name, camera.fx, values.number_or({"baseline"}, camera.baseline));
}

/// Returns the rigid motion of a key.
Pose motion_of(const CameraValues& values, const std::string& key) {
  const std::vector<double> v = values.matrix(key, 16);
  const auto T = rigid_motion(std::span(v).first<16>());
  if (T) return *T;
  throw Error("is no rigid motion", values.where(key),
              "give a rotation and a translation [m] as a 4 x 4 matrix, row by row");
}

/// Sets the noise for which the file has keys.
void set_noise(Imu& imu, const CameraValues& values) {
  for (const auto& [key, value] : kImuNoiseKeys) {
    imu.*value = values.number_or({key}, imu.*value);
    if (!(imu.*value > 0 && std::isfinite(imu.*value)))
      throw Error(fmt::format("is {}, not positive", imu.*value), values.where(key),
                  "give the standard deviation per root of hertz, or leave the line out");
  }
}

std::optional<Imu> imu_of(const CameraValues& values) {
  if (!values.has({"imu"})) {
    Keys of_imu{"T_camera_imu", "imu_time_offset"};
    for (const auto& noise : kImuNoiseKeys) of_imu.emplace_back(noise.key);
    if (const auto key = values.find(of_imu))
      throw Error(
          "is given without an imu", values.where(*key),
          fmt::format("add the line 'imu: NAME' with one of {}", fmt::join(imu_names(), ", ")));
    return std::nullopt;
  }
  Imu imu = find_imu(values.text("imu"));
  set_noise(imu, values);
  imu.time_offset = values.number_or({"imu_time_offset"}, 0);
  if (values.has({"T_camera_imu"})) imu.T_camera_imu = motion_of(values, "T_camera_imu");
  return imu;
}

FileCamera from_our_own(const CameraValues& values) {
  refuse_unknown_keys(values);
  FileCamera camera;
  camera.width = values.whole({"width"});
  camera.height = values.whole({"height"});
  set_intrinsics(camera, values, "");
  camera.depth_factor = values.number({"depth_factor"});
  camera.fps = values.number_or({"fps"}, camera.fps);
  if (values.has({"sensor"})) camera.depth_sensor = sensor_of(values, camera);
  if (camera.depth_sensor.baseline > 0) camera.baseline = camera.depth_sensor.baseline;
  camera.baseline = values.number_or({"baseline"}, camera.baseline);
  if (values.has({"readout", "depth_delay"})) {
    camera.shutter = {.readout = values.number_or({"readout"}, 0),
                      .depth_delay = values.number_or({"depth_delay"}, 0)};
  }
  camera.disparity_bias = {.offset = values.number_or({"disparity_offset"}, 0),
                           .bow = values.number_or({"disparity_bow"}, 0)};
  camera.imu = imu_of(values);
  if (values.has({"T_camera_base"}))
    camera.wheels = Wheels{.T_camera_base = motion_of(values, "T_camera_base")};
  if (values.has({"ignore"})) camera.ignore = values.file().parent_path() / values.text("ignore");
  if (values.has({"name"})) camera.name = values.text("name");
  if (values.has({"distortion"}))
    camera.lens = lens_of("", values.numbers("distortion"), values.where("distortion"));
  return camera;
}

// ---- settings of ORB-SLAM and stella_vslam

bool is_settings_file(const CameraValues& values) {
  return std::any_of(values.keys().begin(), values.keys().end(), [](const std::string& key) {
    return key == "Camera" || key.starts_with("Camera.") || key.starts_with("Camera1.");
  });
}

/// ORB-SLAM2 and 3 write Camera.fx or Camera1.fx; OpenVSLAM and stella_vslam write fx below Camera
/// or Camera.fx, with other names for the size, the baseline and the depth factor.
FileCamera from_settings(const CameraValues& values) {
  const std::string model_key = values.has({"Camera.type"}) ? "Camera.type" : "Camera.model";
  require_model(values, model_key);
  const auto names = [](const std::string& key) -> Keys {
    return {"Camera." + key, "Camera1." + key};
  };
  FileCamera camera =
      camera_of_size(values, {"Camera.width", "Camera.cols"}, {"Camera.height", "Camera.rows"});
  set_intrinsics(camera, values.number(names("fx")), values.number(names("fy")),
                 values.number(names("cx")), values.number(names("cy")));
  camera.lens = lens_by_keys(values, text_or_none(values, model_key),
                             values.has({"Camera1.fx"}) ? "Camera1." : "Camera.");
  camera.fps = values.number_or({"Camera.fps"}, camera.fps);
  camera.depth_factor = values.number({"DepthMapFactor", "RGBD.DepthMapFactor",
                                       "Preprocessing.depthmap_factor", "depthmap_factor"});
  // Camera.bf is the focal length times the baseline [pixels * m], Stereo.b the baseline [m].
  camera.baseline = values.number_or({"Camera.bf", "Camera1.bf", "Camera.focal_x_baseline"},
                                     camera.baseline * camera.fx) /
                    camera.fx;
  camera.baseline = values.number_or({"Stereo.b"}, camera.baseline);
  return camera;
}

// ---- a matrix and coefficients: camera_info of ROS, FileStorage of OpenCV, RTAB-Map

const Keys kMatrix{"cameramatrix", "k", "m1", "mtx"},
    kDistortion{"distortioncoefficients", "distcoeffs", "d", "d1", "dist"},
    kProjection{"projectionmatrix", "p", "p1"};

/// Returns a camera with the size from the two keys of camera_calibration, RTAB-Map and OpenCV's
/// sample, from those of a printed message, or from the list that FileStorage writes for cv::Size.
FileCamera camera_of_matrix_size(const CameraValues& values) {
  if (const auto size = values.find_alike({"imagesize", "size"})) {
    const auto numbers = values.matrix(*size, 2);
    FileCamera camera;
    set_size(camera, numbers[0], numbers[1]);
    return camera;
  }
  const auto width = values.find_alike({"imagewidth", "width"}),
             height = values.find_alike({"imageheight", "height"});
  return camera_of_size(values, {width.value_or("image_width")}, {height.value_or("image_height")});
}

/// The matrix belongs to the images as recorded; rectification_matrix and projection_matrix belong
/// to a stereo pair. Old files of RTAB-Map have a camera_matrix that is truncated from 3 x 4
/// numbers: it ends with 0, and the projection matrix has the right values.
FileCamera from_matrix(const CameraValues& values) {
  FileCamera camera = camera_of_matrix_size(values);
  const auto k = values.matrix(*values.find_alike(kMatrix), 9);
  set_intrinsics(camera, k[0], k[4], k[2], k[5]);
  if (const auto key = values.find_alike(kProjection); key && k[8] == 0) {
    const auto p = values.matrix(*key, 12);
    set_intrinsics(camera, p[0], p[5], p[2], p[6]);
  }
  std::string model =
      text_or_none(values, values.has({"distortion_model"}) ? "distortion_model" : "camera_model");
  if (values.number_or({"fisheye_model"}, 0) != 0) model = "fisheye";
  if (const auto key = values.find_alike(kDistortion))
    camera.lens = lens_of_list(values, model, *key);
  camera.depth_factor = values.number_or({"depth_factor"}, kMillimeters);
  return camera;
}

// ---- the others

/// PinholeCameraIntrinsic of Open3D, alone or in PinholeCameraParameters: the matrix is
/// column-major, but often row-major if written by hand.
FileCamera from_open3d(const CameraValues& values) {
  const std::string group = values.has({"intrinsic.intrinsic_matrix"}) ? "intrinsic." : "";
  FileCamera camera = camera_of_size(values, {group + "width"}, {group + "height"});
  const auto k = values.matrix(group + "intrinsic_matrix", 9);
  const bool by_rows = k[6] == 0 && k[7] == 0;
  set_intrinsics(camera, k[0], k[4], k[by_rows ? 2 : 6], k[by_rows ? 5 : 7]);
  camera.depth_factor = values.number_or({"depth_scale", "depth_factor"}, kMillimeters);
  return camera;
}

/// rs2_intrinsics of librealsense, as scripts write them.
FileCamera from_realsense(const CameraValues& values) {
  FileCamera camera = camera_of_size(values, {"width"}, {"height"});
  set_intrinsics(camera, values.number({"fx"}), values.number({"fy"}), values.number({"ppx"}),
                 values.number({"ppy"}));
  camera.lens = lens_of_list(values, text_or_none(values, "model"), "coeffs");
  camera.depth_factor = 1 / values.number_or({"depth_units", "depth_scale"}, 1 / kMillimeters);
  camera.depth_sensor = find_depth_sensor("realsense_d435i");
  camera.baseline = camera.depth_sensor.baseline;
  return camera;
}

/// The IMU of a camera of Kalibr's camera chain; its noise is in the same file if the user has
/// added the lines of imu.yaml.
std::optional<Imu> kalibr_imu(const CameraValues& values, const std::string& prefix) {
  if (!values.has({prefix + "T_cam_imu"})) return std::nullopt;
  Imu imu;
  set_noise(imu, values);
  imu.T_camera_imu = motion_of(values, prefix + "T_cam_imu");
  imu.time_offset = values.number_or({prefix + "timeshift_cam_imu"}, 0);
  return imu;
}

/// The first camera of a camera chain of Kalibr (cam0), or sensor.yaml of EuRoC (no prefix).
FileCamera from_kalibr(const CameraValues& values, const std::string& prefix) {
  require_model(values, prefix + "camera_model");
  const auto size = values.matrix(prefix + "resolution", 2),
             k = values.matrix(prefix + "intrinsics", 4);
  FileCamera camera;
  set_size(camera, size[0], size[1]);
  set_intrinsics(camera, k[0], k[1], k[2], k[3]);
  camera.lens =
      lens_of_list(values, text_or_none(values, prefix + "distortion_model"),
                   prefix + (prefix.empty() ? "distortion_coefficients" : "distortion_coeffs"));
  if (prefix.empty()) camera.fps = values.number_or({"rate_hz"}, camera.fps);  // else of the IMU
  camera.depth_factor = values.number_or({"depth_factor", prefix + "depth_factor"}, kMillimeters);
  camera.imu = kalibr_imu(values, prefix);
  return camera;
}

/// camera_models of VINS-Mono and VINS-Fusion.
FileCamera from_vins(const CameraValues& values) {
  require_model(values, "model_type");
  FileCamera camera = camera_of_size(values, {"image_width"}, {"image_height"});
  set_intrinsics(camera, values, "projection_parameters.");
  camera.lens = lens_by_keys(values, "", "distortion_parameters.");
  camera.depth_factor = values.number_or({"depth_factor"}, kMillimeters);
  return camera;
}

const Keys kNeuralSlamGroups{"cam.", "camera.", "camera_params.", "dataset.Calibration.",
                             "Dataset.Calibration."};

/// Returns the group of keys with fx in settings of NICE-SLAM and its successors; none in other
/// files.
std::optional<std::string> neural_slam_group(const CameraValues& values) {
  const auto group =
      std::find_if(kNeuralSlamGroups.begin(), kNeuralSlamGroups.end(),
                   [&](const std::string& prefix) { return values.has({prefix + "fx"}); });
  return group == kNeuralSlamGroups.end() ? std::nullopt : std::optional(*group);
}

/// NICE-SLAM's `cam`, the `camera` of its Replica data (cam_params.json), SplaTAM's
/// `camera_params`, and MonoGS's `Calibration`.
FileCamera from_neural_slam(const CameraValues& values) {
  const std::string group = *neural_slam_group(values);
  FileCamera camera =
      camera_of_size(values, {group + "W", group + "w", group + "image_width", group + "width"},
                     {group + "H", group + "h", group + "image_height", group + "height"});
  set_intrinsics(camera, values, group);
  camera.lens = values.has({group + "distortion"}) ? lens_of_list(values, "", group + "distortion")
                                                   : lens_by_keys(values, "", group);
  camera.depth_factor =
      values.number({group + "png_depth_scale", group + "scale", group + "depth_scale"});
  return camera;
}

/// transforms.json of nerfstudio, whose depth images are in millimeters, and of instant-ngp, which
/// states the unit as integer_depth_scale [m].
FileCamera from_nerf(const CameraValues& values) {
  require_model(values, "camera_model");
  const bool is_fisheye = text_or_none(values, "is_fisheye") == "true";
  FileCamera camera = camera_of_size(values, {"w"}, {"h"});
  const double fx = values.number({"fl_x"});
  set_intrinsics(camera, fx, values.number_or({"fl_y"}, fx), values.number({"cx"}),
                 values.number({"cy"}));
  camera.lens =
      lens_by_keys(values, is_fisheye ? "fisheye" : text_or_none(values, "camera_model"), "");
  camera.depth_factor = 1 / values.number_or({"integer_depth_scale"}, 1 / kMillimeters);
  return camera;
}

/// metadata.json of Record3D: column-major matrix of the color images, size w x h of color and
/// dw x dh of depth.
FileCamera from_record3d(const CameraValues& values) {
  FileCamera camera = camera_of_size(values, {"w"}, {"h"});
  const auto k = values.matrix("K", 9);
  set_intrinsics(camera, k[0], k[4], k[6], k[7]);
  camera.fps = values.number_or({"fps"}, camera.fps);
  camera.depth_factor = kMillimeters;
  return camera;
}

/// Camera of one image of Polycam, with its pose (t_00 to t_23).
FileCamera from_polycam(const CameraValues& values) {
  FileCamera camera = camera_of_size(values, {"width"}, {"height"});
  set_intrinsics(camera, values, "");
  camera.depth_factor = kMillimeters;
  return camera;
}

FileCamera camera_of(const CameraValues& values) {
  if (values.has({"cam0.camera_model"})) return from_kalibr(values, "cam0.");
  if (values.has({"resolution"}) && values.has({"intrinsics"})) return from_kalibr(values, "");
  if (is_settings_file(values)) return from_settings(values);
  if (values.has({"projection_parameters"})) return from_vins(values);
  if (values.has({"fl_x", "camera_angle_x", "frames"})) return from_nerf(values);
  if (values.has({"t_00"})) return from_polycam(values);
  if (neural_slam_group(values)) return from_neural_slam(values);
  if (values.has({"intrinsic_matrix", "intrinsic.intrinsic_matrix"})) return from_open3d(values);
  if (values.has({"ppx"})) return from_realsense(values);
  if (values.has({"K"}) && values.has({"dw"})) return from_record3d(values);
  if (values.find_alike(kMatrix)) return from_matrix(values);
  return from_our_own(values);
}

// ---- numbers without keys

/// Returns the words of a text between blanks, commas and line breaks, without comments.
std::vector<std::string> words_of(const fs::path& file) {
  std::istringstream lines(camera_text(file));
  std::vector<std::string> words;
  for (std::string line; std::getline(lines, line);) {
    line.resize(std::min(line.size(), line.find('#')));
    std::replace(line.begin(), line.end(), ',', ' ');
    std::istringstream line_words(line);
    for (std::string word; line_words >> word;) words.push_back(word);
  }
  return words;
}

std::vector<double> numbers_of(std::span<const std::string> words, const fs::path& file,
                               const char* what) {
  std::vector<double> numbers;
  for (const std::string& word : words) {
    const auto number = number_of(word);
    if (!number || !std::isfinite(*number)) {
      throw Error(fmt::format("expected a number, found '{}'", printable(word)), file.string(),
                  fmt::format("write {}", what));
    }
    numbers.push_back(*number);
  }
  return numbers;
}

/// calibration.txt of ETH3D: fx fy cx cy of images whose depth is in fifths of a millimeter.
FileCamera from_eth3d(const std::vector<double>& numbers) {
  FileCamera camera;
  camera.width = camera.height = 0;
  set_intrinsics(camera, numbers[0], numbers[1], numbers[2], numbers[3]);
  camera.depth_factor = 5000;
  return camera;
}

/// Intrinsics of ARKitScenes: width height fx fy cx cy.
FileCamera from_pincam(const std::vector<double>& numbers) {
  FileCamera camera;
  set_size(camera, numbers[0], numbers[1]);
  set_intrinsics(camera, numbers[2], numbers[3], numbers[4], numbers[5]);
  camera.depth_factor = kMillimeters;
  return camera;
}

/// A matrix row by row: camera_matrix.csv of Stray Scanner (3 x 3), intrinsic_color.txt of ScanNet
/// (4 x 4).
FileCamera from_plain_matrix(const std::vector<double>& k, const fs::path& file) {
  const std::size_t columns = k.size() == 9 ? 3 : 4;
  FileCamera camera;
  camera.width = camera.height = 0;
  set_intrinsics(camera, k[0], k[columns + 1], k[2], k[columns + 2]);
  camera.depth_factor = kMillimeters;
  if (k[2] == 0 && k[2 * columns] != 0)
    throw Error("the camera matrix is transposed", file.string(),
                "write the lines 'fx 0 cx', '0 fy cy', '0 0 1'");
  return camera;
}

FileCamera from_numbers(const fs::path& file) {
  constexpr const char* kWhat =
      "the camera matrix as three lines 'fx 0 cx', '0 fy cy', '0 0 1', or one line 'width height "
      "fx fy cx cy'";
  const auto numbers = numbers_of(words_of(file), file, kWhat);
  if (numbers.size() == 4) return from_eth3d(numbers);
  if (numbers.size() == 6) return from_pincam(numbers);
  if (numbers.size() == 9 || numbers.size() == 16) return from_plain_matrix(numbers, file);
  throw Error(fmt::format("expected 4, 6, 9 or 16 numbers, found {}", numbers.size()),
              file.string(), fmt::format("write {}", kWhat));
}

/// Parameters of a model of COLMAP: focal lengths (1 or 2), cx, cy, and those of the lens.
struct ColmapModel {
  const char* name;
  std::size_t focal_lengths;
  const char* lens;  // as for lens_of()
  std::size_t coefficients;
};

constexpr std::array kColmapModels{
    ColmapModel{"SIMPLE_PINHOLE", 1, "", 0},
    ColmapModel{"PINHOLE", 2, "", 0},
    ColmapModel{"SIMPLE_RADIAL", 1, "", 1},
    ColmapModel{"RADIAL", 1, "", 2},
    ColmapModel{"OPENCV", 2, "", 4},
    ColmapModel{"FULL_OPENCV", 2, "", 8},
    ColmapModel{"OPENCV_FISHEYE", 2, "fisheye", 4},
};

/// cameras.txt of COLMAP, with one camera: CAMERA_ID MODEL WIDTH HEIGHT PARAMETERS. The center of
/// its first pixel is (0.5, 0.5).
FileCamera from_colmap(const std::vector<std::string>& words, const fs::path& file) {
  const auto model =
      std::find_if(kColmapModels.begin(), kColmapModels.end(),
                   [&](const ColmapModel& each) { return each.name == words.at(1); });
  if (model == kColmapModels.end())
    throw Error(fmt::format("the camera model '{}' is not supported", printable(words[1])),
                file.string(), "undistort the images with COLMAP and give their camera");
  constexpr std::size_t kBefore = 4;  // words before the focal lengths
  const std::size_t expected = kBefore + model->focal_lengths + 2 + model->coefficients;
  if (words.size() != expected)
    throw Error(fmt::format("expected one camera with {} values, found {}", expected, words.size()),
                file.string(), "write the line of one camera: CAMERA_ID MODEL WIDTH HEIGHT ...");
  const auto v = numbers_of(std::span(words).subspan(2), file, "numbers after the model");
  FileCamera camera;
  set_size(camera, v[0], v[1]);
  const std::size_t center = 2 + model->focal_lengths;
  set_intrinsics(camera, v[2], v[center - 1], v[center] - 0.5, v[center + 1] - 0.5);
  std::vector<double> coefficients(v.begin() + static_cast<std::ptrdiff_t>(center) + 2, v.end());
  if (!coefficients.empty()) {
    coefficients.resize(std::max<std::size_t>(4, coefficients.size()), 0);
    camera.lens = lens_of(model->lens, coefficients, file.string());
  }
  camera.depth_factor = kMillimeters;
  return camera;
}

}  // namespace

FileCamera read_camera_format(const fs::path& file) {
  const auto words = words_of(file);
  if (words.size() > 1 && number_of(words[0])) {
    const bool has_model = std::isupper(static_cast<unsigned char>(words[1].front())) != 0;
    return has_model ? from_colmap(words, file) : from_numbers(file);
  }
  if (file.extension() == ".csv" || file.extension() == ".pincam") return from_numbers(file);
  return camera_of(CameraValues(file));
}

}  // namespace stillmap
