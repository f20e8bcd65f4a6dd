// SPDX-License-Identifier: Apache-2.0
#include "sources.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/sensor/make_source.hpp"

#include <mutex>
#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>
#include <tuple>
#include <variant>

#include "arrays.hpp"
#include "bindings.hpp"

namespace stillmap::python {
namespace {

namespace py = pybind11;
using OptionalPath = std::optional<std::filesystem::path>;

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
  explicit Source(std::unique_ptr<FrameSource> source) : source_(std::move(source)) {}

  Frame next() {
    RgbdFramePtr frame;
    {
      const Lock lock(mutex_);
      frame = source_->next();
    }
    throw_pending();
    if (!frame) throw py::stop_iteration();
    return {frame};
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

 private:
  /// Holds the mutex and not the GIL, for which a thread may wait that holds the mutex.
  struct Lock {
    explicit Lock(std::mutex& mutex) : held(mutex) {}
    py::gil_scoped_release release;  // first: the GIL is taken again after the mutex is free
    std::scoped_lock<std::mutex> held;
  };

  std::mutex mutex_;
  std::unique_ptr<FrameSource> source_;
};

Camera make_camera(int width, int height, double fx, double fy, double cx, double cy,
                   const std::array<double, 5>& distortion, double depth_factor, double fps,
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

void bind_camera(py::module_& module) {
  const Camera defaults;
  py::class_<Camera>(module, "Camera",
                     "A pinhole camera: intrinsics [pixels] and distortion of the recorded images. "
                     "Pixel (0, 0) is the center of the upper left pixel; x right, y down, z "
                     "forward.")
      .def(py::init(&make_camera), py::arg("width"), py::arg("height"), py::arg("fx"),
           py::arg("fy"), py::arg("cx"), py::arg("cy"), py::kw_only(),
           py::arg("distortion") = std::array<double, 5>{},
           py::arg("depth_factor") = defaults.depth_factor, py::arg("fps") = defaults.fps,
           py::arg("sensor") = defaults.depth_sensor.name, py::arg("baseline") = py::none(),
           py::arg("name") = defaults.name,
           "width, height, fx, fy, cx, cy [pixels]; distortion k1 k2 p1 p2 k3 (Brown, in OpenCV's "
           "order); depth_factor: raw depth units per meter, 1000 for millimeters; fps [Hz]; "
           "sensor: kinect_v1, realsense_d435i, realsense_d455, azure_kinect, stereo or ideal; "
           "baseline "
           "[m], that of the sensor by default.")
      .def_static(
          "read", &read_camera, py::arg("name_or_file"),
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
                             "Choices and assumptions of the source: list of sentences.");
  module.def(
      "source",
      [](const std::filesystem::path& text, const OptionalPath& camera, const std::string& topics,
         const OptionalPath& associations, double fps, const std::variant<bool, double>& follow,
         int first, int count, int stride, bool half_size) {
        return open_source(text.string(), {.camera = camera.value_or("").string(),
                                           .topics = topics,
                                           .associations = associations.value_or("").string(),
                                           .fps = fps,
                                           .first = first,
                                           .count = count,
                                           .stride = stride,
                                           .half_size = half_size,
                                           .following = following_of(text.string(), follow)});
      },
      py::arg("text"), py::kw_only(), py::arg("camera") = py::none(), py::arg("topics") = "",
      py::arg("associations") = py::none(), py::arg("fps") = SourceOptions{}.fps,
      py::arg("follow") = false, py::arg("first") = 0, py::arg("count") = 0, py::arg("stride") = 1,
      py::arg("half_size") = false,
      "The frames of all that the command's `run` maps: a recorded file (.bag, .db3, .mcap), a "
      "folder of images, a folder of a stereo pair, or the camera 'realsense:'. The arguments are "
      "those of the command. camera: preset or file, instead of the recording's own; topics: "
      "'COLOR,DEPTH' or 'LEFT,RIGHT' of a recorded file; associations: file that pairs color and "
      "depth images; fps: rate [Hz] of images whose names are numbers; follow: the folder still "
      "grows: True, or the longest time without a frame [s], at which the iterator ends; first: "
      "frames skipped; count: maximum number of frames, 0 for all; stride: every n-th frame; "
      "half_size: images of half the size.");
}

}  // namespace stillmap::python
