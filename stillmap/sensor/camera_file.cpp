// SPDX-License-Identifier: Apache-2.0
#include "stillmap/sensor/camera_file.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/base/file.hpp"
#include "stillmap/base/nearest_name.hpp"
#include "stillmap/sensor/printable.hpp"

#include <algorithm>
#include <array>
#include <cctype>
#include <cmath>
#include <optional>
#include <set>
#include <sstream>
#include <tuple>

#include <fmt/format.h>
#include <fmt/ranges.h>
#include <yaml-cpp/yaml.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;
using Keys = std::vector<std::string>;  // Accepted names of one value, ours or the usual one first.

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

// A flat view of the top level of a YAML file with error messages.
class CameraYaml {
 public:
  explicit CameraYaml(const fs::path& file) : CameraYaml(file, parse(file)) {}
  CameraYaml(const fs::path& file, const YAML::Node& root) : file_(file), root_(root) {
    if (!root_.IsMap()) {
      throw Error("is not a camera file: expected lines like 'fx: 535.4'", file_.string(), kFix);
    }
    std::set<std::string> seen;
    for (const auto& entry : root_) {
      keys_.push_back(entry.first.as<std::string>(""));
      if (!seen.insert(keys_.back()).second) {
        throw Error("is given twice", where(keys_.back()), "keep only the valid one");
      }
    }
  }

  const Keys& keys() const { return keys_; }
  /// Returns the values below a key.
  CameraYaml below(const std::string& key) const { return {file_, root_[key]}; }
  std::string where(const std::string& key) const {
    return fmt::format("{}, key '{}'", file_.string(), printable(key));
  }
  std::optional<std::string> find(const Keys& names) const {
    for (const auto& name : names) {
      if (std::find(keys_.begin(), keys_.end(), name) != keys_.end()) return name;
    }
    return std::nullopt;
  }
  std::string text(const std::string& key) const {
    const YAML::Node node = root_[key];
    if (!node.IsScalar()) throw Error("expected a name", where(key), "write it as one word");
    return node.Scalar();
  }
  double number(const Keys& names) const {
    const auto key = find(names);
    if (!key) throw missing(names);
    return to_number(root_[*key], *key);
  }
  double number_or(const Keys& names, double otherwise) const {
    const auto key = find(names);
    return key ? to_number(root_[*key], *key) : otherwise;
  }
  int whole(const Keys& names) const {
    const double value = number(names);
    if (value != std::round(value) || std::abs(value) > 1e6) {
      throw Error(fmt::format("expected a whole number, found {}", value), where(*find(names)),
                  "give the image size in pixels");
    }
    return static_cast<int>(value);
  }
  std::vector<double> numbers(const std::string& key) const {
    const YAML::Node node = root_[key];
    if (!node.IsSequence()) {
      throw Error("expected a list of numbers", where(key), "write it as [k1, k2, p1, p2, k3]");
    }
    std::vector<double> values;
    for (const auto& item : node) values.push_back(to_number(item, key));
    return values;
  }
  /// Returns the numbers of `key`, or of its subkey `data`, as ROS and OpenCV write matrices.
  std::vector<double> matrix(const std::string& key, std::size_t size) const {
    const YAML::Node node = root_[key];
    const YAML::Node list = node.IsMap() ? node["data"] : node;
    std::vector<double> values;
    if (list.IsDefined() && list.IsSequence()) {
      for (const auto& item : list) values.push_back(to_number(item, key));
    }
    if (size > 0 && values.size() != size) {
      throw Error(fmt::format("expected {} numbers, found {}", size, values.size()), where(key),
                  "write the file again with the program that made it");
    }
    return values;
  }
  Error missing(const Keys& names) const {
    return Error(fmt::format("the key '{}' is missing", names.front()), file_.string(),
                 fmt::format("add a line '{}: VALUE'", fmt::join(names, ": VALUE' or '")));
  }

  // Maximum file size [bytes]; settings files have a few thousand.
  static constexpr std::size_t kLargestFile = 1 << 20;
  static constexpr const char* kFix =
      "give a camera file with width, height, fx, fy, cx, cy, depth_factor, or a preset's name";

 private:
  static YAML::Node parse(const fs::path& file) {
    const std::string text = read_file(file);
    if (text.size() > kLargestFile) throw Error("is too large for a camera", file.string(), kFix);
    if (text.find('\0') != std::string::npos) {
      throw Error("is not a camera file: it is not text", file.string(), kFix);
    }
    try {
      return YAML::Load(as_standard_yaml(text));
    } catch (const YAML::Exception& e) {
      const std::string line = e.mark.is_null() ? "" : fmt::format(":{}", e.mark.line + 1);
      throw Error("is not YAML: " + e.msg, file.string() + line, "write one 'key: value' a line");
    }
  }

  // OpenCV accepts more than the YAML standard, and settings files rely on it: tabs, no blank after
  // a colon, the header '%YAML:1.0' (kept as a comment, so that line numbers stay valid).
  static std::string as_standard_yaml(std::string text) {
    if (const auto at = text.find("%YAML"); at < 4) text[at] = '#';
    std::replace(text.begin(), text.end(), '\t', ' ');
    std::istringstream lines(text);
    std::string standard;
    for (std::string line; std::getline(lines, line); standard += line + '\n') {
      const auto key_ends = std::find_if_not(line.begin(), line.end(), is_key_letter);
      if (key_ends != line.end() && *key_ends == ':') line.insert(key_ends + 1, ' ');
    }
    return standard;
  }
  static bool is_key_letter(char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || c == '_' || c == '.' || c == ' ';
  }

  double to_number(const YAML::Node& node, const std::string& key) const {
    double value = 0;
    if (!node.IsScalar() || !YAML::convert<double>::decode(node, value)) {
      throw Error(
          fmt::format("expected a number, found {}",
                      node.IsScalar() ? "'" + printable(node.Scalar()) + "'" : "something else"),
          where(key), "write a decimal number");
    }
    if (!std::isfinite(value)) {
      throw Error(fmt::format("'{}' is not finite", printable(node.Scalar())), where(key),
                  "write a number");
    }
    return value;
  }

  fs::path file_;
  YAML::Node root_;
  Keys keys_;
};

bool is_settings_file(const CameraYaml& yaml) {
  return std::any_of(yaml.keys().begin(), yaml.keys().end(), [](const std::string& key) {
    return key.starts_with("Camera.") || key.starts_with("Camera1.");
  });
}

void refuse_other_models(const CameraYaml& yaml) {
  if (!yaml.find({"Camera.type"})) return;
  const std::string type = yaml.text("Camera.type");
  if (type == "PinHole" || type == "Rectified") return;
  throw Error(fmt::format("the camera model '{}' is not supported", printable(type)),
              yaml.where("Camera.type"),
              "rectify the images to a pinhole camera first and give its parameters");
}

Camera from_settings(const CameraYaml& yaml) {
  refuse_other_models(yaml);
  const auto names = [](const std::string& key) -> Keys {
    return {"Camera." + key, "Camera1." + key};
  };
  Camera camera;
  camera.width = yaml.whole(names("width"));
  camera.height = yaml.whole(names("height"));
  camera.fx = yaml.number(names("fx"));
  camera.fy = yaml.number(names("fy"));
  camera.cx = yaml.number(names("cx"));
  camera.cy = yaml.number(names("cy"));
  int i = 0;
  for (const char* key : {"k1", "k2", "p1", "p2", "k3"}) {
    camera.distortion(i++) = yaml.number_or(names(key), 0);
  }
  camera.fps = yaml.number_or(names("fps"), camera.fps);
  camera.depth_factor = yaml.number({"DepthMapFactor", "RGBD.DepthMapFactor"});
  // Camera.bf is the focal length times the baseline [pixels * m], Stereo.b the baseline [m].
  camera.baseline = yaml.number_or(names("bf"), camera.baseline * camera.fx) / camera.fx;
  camera.baseline = yaml.number_or({"Stereo.b"}, camera.baseline);
  return camera;
}

void refuse_unknown_keys(const CameraYaml& yaml) {
  const Keys known{"name",         "width",  "height",     "fx",           "fy",
                   "cx",           "cy",     "distortion", "depth_factor", "fps",
                   "baseline",     "sensor", "readout",    "depth_delay",  "disparity_offset",
                   "disparity_bow"};
  for (const auto& key : yaml.keys()) {
    if (std::find(known.begin(), known.end(), key) != known.end()) continue;
    throw Error("is not a key of a camera file", yaml.where(key), suggestion(key, known));
  }
}

DepthSensor sensor_of(const CameraYaml& yaml, const Camera& camera) {
  const std::string name = yaml.text("sensor");
  const auto& known = depth_sensor_names();
  if (std::find(known.begin(), known.end(), name) == known.end()) {
    throw Error(fmt::format("'{}' is no known depth sensor", printable(name)), yaml.where("sensor"),
                suggestion(name, known));
  }
  return depth_sensor_of(name, camera.fx, yaml.number_or({"baseline"}, camera.baseline));
}

// A camera without intrinsics, whose image size these keys tell.
Camera camera_of_size(const CameraYaml& yaml, const Keys& width, const Keys& height) {
  Camera camera;
  camera.width = yaml.whole(width);
  camera.height = yaml.whole(height);
  return camera;
}

Camera from_our_own(const CameraYaml& yaml, const fs::path& file) {
  refuse_unknown_keys(yaml);
  Camera camera = camera_of_size(yaml, {"width"}, {"height"});
  camera.fx = yaml.number({"fx"});
  camera.fy = yaml.number({"fy"});
  camera.cx = yaml.number({"cx"});
  camera.cy = yaml.number({"cy"});
  camera.depth_factor = yaml.number({"depth_factor"});
  camera.fps = yaml.number_or({"fps"}, camera.fps);
  if (yaml.find({"sensor"})) camera.depth_sensor = sensor_of(yaml, camera);
  if (camera.depth_sensor.baseline > 0) camera.baseline = camera.depth_sensor.baseline;
  camera.baseline = yaml.number_or({"baseline"}, camera.baseline);
  if (yaml.find({"readout"}) || yaml.find({"depth_delay"})) {
    camera.shutter = {.readout = yaml.number_or({"readout"}, 0),
                      .depth_delay = yaml.number_or({"depth_delay"}, 0)};
  }
  camera.disparity_bias = {.offset = yaml.number_or({"disparity_offset"}, 0),
                           .bow = yaml.number_or({"disparity_bow"}, 0)};
  camera.name = yaml.find({"name"}) ? yaml.text("name") : file.stem().string();
  if (yaml.find({"distortion"})) {
    const auto values = yaml.numbers("distortion");
    if (values.size() > 5) {
      throw Error(fmt::format("expected at most 5 numbers, found {}", values.size()),
                  yaml.where("distortion"), "write it as [k1, k2, p1, p2, k3]");
    }
    std::copy(values.begin(), values.end(), camera.distortion.begin());
  }
  return camera;
}

void set_intrinsics(Camera& camera, double fx, double fy, double cx, double cy) {
  camera.fx = fx, camera.fy = fy, camera.cx = cx, camera.cy = cy;
}

// Takes up to five coefficients of Brown's model.
void set_distortion(Camera& camera, const CameraYaml& yaml, const std::string& key) {
  const std::vector<double> values = yaml.matrix(key, 0);
  const bool others = std::any_of(values.begin() + std::min<std::size_t>(5, values.size()),
                                  values.end(), [](double value) { return value != 0; });
  if (others) {
    throw Error("has more than 5 distortion coefficients", yaml.where(key),
                "rectify the images first and give the camera of the rectified images");
  }
  std::copy_n(values.begin(), std::min<std::size_t>(5, values.size()), camera.distortion.begin());
}

// The depth unit of drivers; these files do not tell it.
constexpr double kMillimeters = 1000;  // [1/m]

// camera_info of ROS: as camera_calibration writes it, and as `ros2 topic echo` (k, d) and
// `rostopic echo` (K, D) print the message.
const Keys kRosMatrix{"camera_matrix", "k", "K"},
    kRosDistortion{"distortion_coefficients", "d", "D"};

Camera from_ros(const CameraYaml& yaml) {
  Camera camera = camera_of_size(yaml, {"image_width", "width"}, {"image_height", "height"});
  const auto k = yaml.matrix(*yaml.find(kRosMatrix), 9);
  set_intrinsics(camera, k[0], k[4], k[2], k[5]);
  const std::string model =
      yaml.find({"distortion_model"}) ? yaml.text("distortion_model") : "plumb_bob";
  if (const auto key = yaml.find(kRosDistortion)) set_distortion(camera, yaml, *key);
  if (camera.distorted() && model != "plumb_bob" && model != "rational_polynomial") {
    throw Error(fmt::format("the distortion model '{}' is not supported", printable(model)),
                yaml.where("distortion_model"), "rectify the images to a pinhole camera first");
  }
  camera.depth_factor = yaml.number_or({"depth_factor"}, kMillimeters);
  return camera;
}

// PinholeCameraIntrinsic of Open3D: the matrix by columns, or by rows, as it is often written by
// hand.
Camera from_open3d(const CameraYaml& yaml) {
  Camera camera = camera_of_size(yaml, {"width"}, {"height"});
  const auto k = yaml.matrix("intrinsic_matrix", 9);
  const bool by_rows = k[6] == 0 && k[7] == 0;
  set_intrinsics(camera, k[0], k[4], k[by_rows ? 2 : 6], k[by_rows ? 5 : 7]);
  camera.depth_factor = yaml.number_or({"depth_scale", "depth_factor"}, kMillimeters);
  return camera;
}

// Refuses coefficients that are not those of Brown's model, such as those of its inverse.
void require_brown(const Camera& camera, const CameraYaml& yaml) {
  if (!camera.distorted() || !yaml.find({"model"})) return;
  const std::string model = yaml.text("model");
  const std::string name = model.substr(model.rfind('.') + 1);  // of distortion.brown_conrady
  if (name == "brown_conrady" || name == "none") return;
  throw Error(
      fmt::format("the distortion model '{}' is not supported", printable(model)),
      yaml.where("model"),
      "rectify the images to a pinhole camera first, and give coefficients of 0; recordings "
      "of librealsense (.bag, .db3) are read with this model");
}

// rs2_intrinsics of librealsense, as scripts write them.
Camera from_realsense(const CameraYaml& yaml) {
  Camera camera = camera_of_size(yaml, {"width"}, {"height"});
  set_intrinsics(camera, yaml.number({"fx"}), yaml.number({"fy"}), yaml.number({"ppx"}),
                 yaml.number({"ppy"}));
  if (yaml.find({"coeffs"})) set_distortion(camera, yaml, "coeffs");
  require_brown(camera, yaml);
  camera.depth_factor = 1 / yaml.number_or({"depth_units", "depth_scale"}, 1 / kMillimeters);
  camera.depth_sensor = find_depth_sensor("realsense_d435i");
  camera.baseline = camera.depth_sensor.baseline;
  return camera;
}

// The first camera of a chain of Kalibr.
Camera from_kalibr(const CameraYaml& yaml) {
  const auto require = [&](const char* key, const Keys& supported) {
    const std::string value = yaml.text(key);
    if (std::find(supported.begin(), supported.end(), value) != supported.end()) return;
    throw Error(fmt::format("'{}' is not supported", printable(value)), yaml.where(key),
                "rectify the images to a pinhole camera first and give its parameters");
  };
  require("camera_model", {"pinhole"});
  const auto size = yaml.matrix("resolution", 2), k = yaml.matrix("intrinsics", 4);
  Camera camera;
  camera.width = static_cast<int>(size[0]), camera.height = static_cast<int>(size[1]);
  set_intrinsics(camera, k[0], k[1], k[2], k[3]);
  if (yaml.find({"distortion_coeffs"})) set_distortion(camera, yaml, "distortion_coeffs");
  if (camera.distorted()) require("distortion_model", {"radtan"});
  camera.depth_factor = kMillimeters;
  return camera;
}

Camera camera_of(const CameraYaml& yaml, const fs::path& file) {
  if (yaml.find({"cam0"})) return from_kalibr(yaml.below("cam0"));
  if (is_settings_file(yaml)) return from_settings(yaml);
  if (yaml.find(kRosMatrix)) return from_ros(yaml);
  if (yaml.find({"intrinsic_matrix"})) return from_open3d(yaml);
  if (yaml.find({"ppx"})) return from_realsense(yaml);
  return from_our_own(yaml, file);
}

Camera camera_in(const fs::path& file) {
  const CameraYaml yaml(file);
  Camera camera;
  try {
    camera = camera_of(yaml, file);
  } catch (const YAML::Exception& e) {
    throw Error("is no camera file: " + e.msg, file.string(), CameraYaml::kFix);
  }
  if (camera.name == Camera().name) camera.name = file.stem().string();
  check_camera(camera, file.string());
  return camera;
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

Camera read_camera(const std::string& name_or_file) {
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
  return camera_in(name_or_file);
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
