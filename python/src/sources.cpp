// SPDX-License-Identifier: Apache-2.0
#include "sources.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/geometry/rigid_motion.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <mutex>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tuple>
#include <variant>

#include "arguments.hpp"
#include "arrays.hpp"
#include "bindings.hpp"

namespace stillmap::python {
namespace {

namespace py = pybind11;
using OptionalPath = std::optional<std::filesystem::path>;
using OptionalCamera = std::optional<std::variant<Camera, std::filesystem::path>>;
using Topics = std::variant<std::string, std::vector<std::string>>;

/// Returns whether Python has a pending exception, such as KeyboardInterrupt: a source that waits
/// for frames ends then.
bool is_interrupted() {
  const py::gil_scoped_acquire acquire;
  return PyErr_Occurred() != nullptr || PyErr_CheckSignals() != 0;
}

/// Throws the pending exception, if there is one.
void throw_pending() {
  if (PyErr_Occurred() != nullptr) throw py::error_already_set();
}

/// Returns how long to wait for frames; none if the source does not grow.
/// @param follow  whether to wait, or the longest time without a frame [s]
std::optional<Following> following_of(const std::string& text,
                                      const std::variant<bool, double>& follow) {
  Following following{.stop = is_interrupted};
  if (const double* seconds = std::get_if<double>(&follow)) {
    following.patience = *seconds;
  } else if (!std::get<bool>(follow) && !names_live_camera(text)) {
    return std::nullopt;
  }
  return following;
}

/// A source of frames as a Python iterator, which any thread may advance.
class Source {
 public:
  explicit Source(std::unique_ptr<FrameSource> source)
      : source_(std::move(source)), camera_(std::make_shared<const Camera>(source_->camera())) {}

  Frame next() {
    RgbdFramePtr frame;
    {
      const Lock lock(mutex_);
      frame = source_->next();
    }
    throw_pending();
    if (!frame) throw py::stop_iteration();
    return {frame, camera_};
  }
  Camera camera() {
    const Lock lock(mutex_);
    return source_->camera();
  }
  std::size_t remaining() {
    const Lock lock(mutex_);
    const auto size = source_->size();
    if (!size) throw py::type_error("the number of remaining frames is not known");
    return *size;
  }
  std::vector<std::tuple<double, std::string>> skipped() {
    const Lock lock(mutex_);
    std::vector<std::tuple<double, std::string>> found;
    for (const SkippedFrame& frame : source_->skipped())
      found.emplace_back(frame.timestamp, frame.reason);
    return found;
  }
  std::vector<std::string> notes() {
    const Lock lock(mutex_);
    return source_->notes();
  }
  std::vector<Finding> findings() {
    const Lock lock(mutex_);
    return source_->findings();
  }

 private:
  /// Holds the mutex and not the GIL, for which a thread may wait that holds the mutex.
  struct Lock {
    explicit Lock(std::mutex& mutex) : held(mutex) {}
    py::gil_scoped_release release;  // first: the GIL is taken again after the mutex is free
    std::scoped_lock<std::mutex> held;
  };

  std::mutex mutex_;
  std::unique_ptr<FrameSource> source_;
  const std::shared_ptr<const Camera> camera_;
};

Camera make_camera(int width, int height, double fx, double fy, double cx, double cy,
                   double depth_factor, const std::array<double, 5>& distortion, double fps,
                   const std::string& sensor, std::optional<double> baseline,
                   const std::string& name) {
  Camera camera;
  camera.name = name;
  camera.width = width;
  camera.height = height;
  camera.fx = fx;
  camera.fy = fy;
  camera.cx = cx;
  camera.cy = cy;
  camera.distortion = Eigen::Map<const Eigen::Matrix<double, 5, 1>>(distortion.data());
  camera.depth_factor = depth_factor;
  camera.fps = fps;
  camera.depth_sensor = depth_sensor_of(sensor, fx, baseline.value_or(camera.baseline));
  if (camera.depth_sensor.baseline > 0) camera.baseline = camera.depth_sensor.baseline;
  if (baseline) camera.baseline = *baseline;
  return camera;
}

/// Returns topics as the command takes them, separated by commas.
std::string joined(const Topics& topics) {
  if (const auto* text = std::get_if<std::string>(&topics)) return *text;
  std::string text;
  for (const std::string& topic : std::get<std::vector<std::string>>(topics))
    text += (text.empty() ? "" : ",") + topic;
  return text;
}

/// Sets the camera of the recorded images, which may be given as one or by its name or file.
void set_camera(const OptionalCamera& camera, SourceOptions& options) {
  if (!camera) return;
  if (const auto* path = std::get_if<std::filesystem::path>(&*camera)) {
    options.camera = path->string();
  } else {
    options.recorded = std::get<Camera>(*camera);
  }
}

std::unique_ptr<Source> open_source(const std::string& text, const SourceOptions& options) {
  try {
    const py::gil_scoped_release release;
    return std::make_unique<Source>(make_source(text, options));
  } catch (const Error&) {
    throw_pending();  // It ended the wait for the first frame.
    throw;
  }
}

py::object intrinsic_matrix(const Camera& c) {
  return array_of({c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1}, {3, 3});
}

std::string description(const Camera& c) {
  return "stillmap.Camera('" + c.name + "', " + std::to_string(c.width) + " x " +
         std::to_string(c.height) + ")";
}

Imu make_imu(const std::string& name, const std::optional<Matrix4>& T_camera_imu,
             double time_offset) {
  Imu imu = find_imu(name);
  imu.time_offset = time_offset;
  if (T_camera_imu) imu.T_camera_imu = motion_of(*T_camera_imu, "T_camera_imu");
  return imu;
}

py::object camera_base(const Camera& camera) {
  if (!camera.wheels) return py::none();
  return matrix_of(camera.wheels->T_camera_base);
}

void set_camera_base(Camera& camera, const std::optional<Matrix4>& T_camera_base) {
  camera.wheels.reset();
  if (T_camera_base)
    camera.wheels = Wheels{.T_camera_base = motion_of(*T_camera_base, "T_camera_base")};
}

Signature camera_signature() {
  const std::string pixels = "a number [pixels]";
  const std::string rectify =
      "rectify the images, with OpenCV or image_proc of ROS, and leave out distortion; `stillmap "
      "run` rectifies recorded files with up to 14 coefficients";
  return {.function = "Camera",
          .parameters = {{"width", "a whole number [pixels]", fits<int>},
                         {"height", "a whole number [pixels]", fits<int>},
                         {"fx", pixels, fits<double>},
                         {"fy", pixels, fits<double>},
                         {"cx", pixels, fits<double>},
                         {"cy", pixels, fits<double>},
                         {"depth_factor", "the number of raw depth units per meter", fits<double>},
                         {"distortion", "a list of k1 k2 p1 p2 k3 (Brown's model)",
                          fits<std::array<double, 5>>, false, rectify},
                         {"fps", "a number [Hz]", fits<double>, false},
                         {"sensor", "a name", fits<std::string>, false},
                         {"baseline", "a number [m]", fits<std::optional<double>>, false},
                         {"name", "a text", fits<std::string>, false}},
          .positional = 6,
          .fix =
              "call Camera(width, height, fx, fy, cx, cy, depth_factor=1000): 1000 for depth in "
              "millimeters, 5000 for recordings of the TUM benchmark; further keywords: "
              "distortion, fps, sensor, baseline, name. Depth as float32 is always in meters"};
}

Signature source_signature() {
  const std::string whole = "a whole number";
  return {
      .function = "source",
      .parameters = {{"text", "the name of a file, folder or camera", fits<std::filesystem::path>},
                     {"camera", "a Camera, or the name of a preset or file", fits<OptionalCamera>,
                      false},
                     {"ignore", "the name of an image file", fits<OptionalPath>, false},
                     {"topics", "'COLOR,DEPTH' or a list of both names", fits<Topics>, false},
                     {"associations", "the name of a file", fits<OptionalPath>, false},
                     {"fps", "a number [Hz]", fits<double>, false},
                     {"follow", "True, False or a time [s]", fits<std::variant<bool, double>>,
                      false},
                     {"first", whole, fits<int>, false},
                     {"count", whole, fits<int>, false},
                     {"stride", whole, fits<int>, false},
                     {"rotate", whole, fits<int>, false},
                     {"half_size", "True or False", fits<bool>, false}},
      .positional = 1,
      .fix =
          "call source(text), with the keywords camera, ignore, topics, associations, fps, follow, "
          "first, count, stride, rotate and half_size as needed"};
}

void bind_camera(py::module_& module) {
  const Camera defaults;
  py::class_<Imu>(module, "Imu", "The inertial measurement unit of a camera: see docs/cameras.md.")
      .def(py::init(&make_imu), py::arg("name") = Imu().name, py::kw_only(),
           py::arg("T_camera_imu") = py::none(), py::arg("time_offset") = 0.0,
           "name: d435i, d455, oak_d, azure_kinect, or other for the noise of a consumer sensor; "
           "T_camera_imu: pose of the unit in the frame of the camera, 4 x 4, by default its axes "
           "are the optical ones; time_offset: stamp of a sample minus that of an image of the "
           "same moment [s].")
      .def_readonly("name", &Imu::name)
      .def_readwrite("time_offset", &Imu::time_offset, "[s]")
      .def_readwrite("gyro_noise", &Imu::gyro_noise, "[rad/s/sqrt(Hz)]")
      .def_readwrite("gyro_walk", &Imu::gyro_walk, "[rad/s^2/sqrt(Hz)]")
      .def_readwrite("gyro_bias", &Imu::gyro_bias, "Standard deviation at the start [rad/s].");
  py::class_<Camera>(module, "Camera",
                     "A pinhole camera: intrinsics [pixels] and distortion of the recorded images. "
                     "Pixel (0, 0) is the center of the upper left pixel; x right, y down, z "
                     "forward.")
      .def(py::init(&make_camera), py::arg("width"), py::arg("height"), py::arg("fx"),
           py::arg("fy"), py::arg("cx"), py::arg("cy"), py::kw_only(), py::arg("depth_factor"),
           py::arg("distortion") = std::array<double, 5>{}, py::arg("fps") = defaults.fps,
           py::arg("sensor") = defaults.depth_sensor.name, py::arg("baseline") = py::none(),
           py::arg("name") = defaults.name,
           "width, height, fx, fy, cx, cy [pixels]; depth_factor: raw depth units per meter of "
           "uint16 images, 1000 for millimeters (float32 images are in meters); distortion k1 k2 "
           "p1 p2 k3 (Brown, in OpenCV's order); fps [Hz]; sensor: kinect_v1, realsense_d435i, "
           "realsense_d455, realsense_d405, azure_kinect, stereo or ideal; baseline [m], that of "
           "the sensor by default.")
      .def(py::init([](const py::args& args, const py::kwargs& keywords) -> Camera {
             refuse_call(camera_signature(), args, keywords);
           }),
           "Any other call raises stillmap.Error, which names the argument.")
      .def_static(
          "read",
          [](const std::filesystem::path& name_or_file) {
            return read_camera(name_or_file.string());
          },
          py::arg("name_or_file"),
          "The camera of a preset (tum_fr1, tum_fr2, tum_fr3, bonn, ...), of a YAML file, or "
          "of a camera file of ORB-SLAM, ROS, Open3D or librealsense.")
      .def_readwrite("name", &Camera::name)
      .def_readwrite("width", &Camera::width, "[pixels]")
      .def_readwrite("height", &Camera::height, "[pixels]")
      .def_readwrite("fx", &Camera::fx, "[pixels]")
      .def_readwrite("fy", &Camera::fy, "[pixels]")
      .def_readwrite("cx", &Camera::cx, "[pixels]")
      .def_readwrite("cy", &Camera::cy, "[pixels]")
      .def_readwrite("depth_factor", &Camera::depth_factor, "Raw depth units per meter [1/m].")
      .def_readwrite("fps", &Camera::fps, "Nominal frame rate [Hz].")
      .def_readwrite("baseline", &Camera::baseline, "[m]")
      .def_property_readonly("distorted", &Camera::distorted)
      .def_readwrite("ignore", &Camera::ignore,
                     "Mask image of the size of the images: pixels that are not black in it, such "
                     "as those of the robot itself, are ignored; empty: all pixels are used.")
      .def_readwrite("imu", &Camera::imu, "Imu of the camera, or None.")
      .def_property("T_camera_base", &camera_base, &set_camera_base,
                    "Pose of the base of a robot with wheels in the frame of the camera, 4 x 4, or "
                    "None without wheels.")
      .def_property_readonly("matrix", &intrinsic_matrix, "Intrinsic matrix, 3x3 float64 [pixels].")
      .def("__repr__", &description);
}

void bind_frame(py::module_& module) {
  py::class_<Frame>(module, "Frame",
                    "A rectified frame of a source. Its arrays are read-only views, not copies.")
      .def_property_readonly("index", [](const Frame& f) { return f.data->index; })
      .def_property_readonly(
          "stamp", [](const Frame& f) { return f.data->timestamp; }, "Time of the color image [s].")
      .def_property_readonly(
          "rgb", [](const Frame& f) { return view_of(f.data->color, f.data); },
          "Color image, H x W x 3 uint8 RGB (a view of BGR memory).")
      .def_property_readonly(
          "gray", [](const Frame& f) { return view_of(f.data->gray, f.data); },
          "Gray image, H x W uint8.")
      .def_property_readonly(
          "depth", [](const Frame& f) { return view_of(f.data->depth, f.data); },
          "Depth along the optical axis, H x W float32 [m]; 0: unknown.");
}

}  // namespace

void bind_sources(py::module_& module) {
  bind_camera(module);
  bind_frame(module);
  py::class_<Source>(module, "Source", "Iterator of the frames of a recording or camera.")
      .def("__iter__", [](const py::object& self) { return self; })
      .def("__next__", &Source::next)
      .def("__len__", &Source::remaining, "Maximum number of remaining frames.")
      .def_property_readonly("camera", &Source::camera, "Camera of the frames, rectified.")
      .def_property_readonly("skipped", &Source::skipped,
                             "Unusable frames so far: list of (timestamp [s], reason).")
      .def_property_readonly("notes", &Source::notes,
                             "Choices and assumptions of the source: list of sentences.")
      .def_property_readonly("findings", &Source::findings,
                             "What looks wrong before a frame is read (Finding).");
  module.def(
      "source",
      [](const std::filesystem::path& text, const OptionalCamera& camera,
         const OptionalPath& ignore, const Topics& topics, const OptionalPath& associations,
         double fps, const std::variant<bool, double>& follow, int first, int count, int stride,
         int rotate, bool half_size) {
        SourceOptions options{.camera = {},
                              .ignore = ignore.value_or("").string(),
                              .topics = joined(topics),
                              .associations = associations.value_or("").string(),
                              .fps = fps,
                              .first = first,
                              .count = count,
                              .stride = stride,
                              .rotate = rotate,
                              .half_size = half_size,
                              .following = following_of(text.string(), follow)};
        set_camera(camera, options);
        return open_source(text.string(), options);
      },
      py::arg("text"), py::kw_only(), py::arg("camera") = py::none(),
      py::arg("ignore") = py::none(), py::arg("topics") = "", py::arg("associations") = py::none(),
      py::arg("fps") = SourceOptions{}.fps, py::arg("follow") = false, py::arg("first") = 0,
      py::arg("count") = 0, py::arg("stride") = 1, py::arg("rotate") = 0,
      py::arg("half_size") = false,
      "The frames of all that the command's `run` maps: a recorded file (.bag, .db3, .mcap), a "
      "folder of images, a folder of a stereo pair, or the camera 'realsense:'. The arguments are "
      "those of the command. camera: Camera, preset or file, instead of the recording's own; "
      "ignore: image whose white pixels (the robot itself) are ignored; topics: 'COLOR,DEPTH' or "
      "'LEFT,RIGHT' of a recorded file, or a list of both; associations: file that pairs color and "
      "depth images; fps: rate [Hz] of images whose names are numbers; follow: the folder still "
      "grows: True, or the longest time without a frame [s], at which the iterator ends; first: "
      "frames skipped; count: maximum number of frames, 0 for all; stride: every n-th frame; "
      "rotate: turns the images clockwise by 90, 180 or 270 degrees; half_size: images of half the "
      "size.");
  module.def(
      "source",
      [](const py::args& args, const py::kwargs& keywords) -> std::unique_ptr<Source> {
        refuse_call(source_signature(), args, keywords);
      },
      "Any other call raises stillmap.Error, which names the argument.");
}

}  // namespace stillmap::python
