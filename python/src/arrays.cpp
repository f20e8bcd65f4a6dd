// SPDX-License-Identifier: Apache-2.0
#include "arrays.hpp"

#include "stillmap/base/error.hpp"
#include "stillmap/geometry/rigid_motion.hpp"

#include <algorithm>
#include <array>
#include <bit>
#include <cmath>
#include <cstdint>
#include <cstring>
#include <pybind11/stl/filesystem.h>

#include <opencv2/imgproc.hpp>

namespace stillmap::python {
namespace {

namespace py = pybind11;

constexpr py::ssize_t kTumColumns = 8;
constexpr const char* kWhere = "push";

/// Returns a shape in Python's notation, such as "(480, 640)".
std::string text_of(const std::vector<py::ssize_t>& shape) {
  std::string text = "(";
  for (std::size_t i = 0; i < shape.size(); ++i)
    text += (i == 0 ? "" : ", ") + std::to_string(shape[i]);
  return text + (shape.size() == 1 ? ",)" : ")");
}

/// Returns the name of an object's element type, such as "float64".
std::string type_of(const py::object& object) {
  return py::hasattr(object, "dtype") ? std::string(py::str(object.attr("dtype")))
                                      : std::string(py::str(py::type::of(object).attr("__name__")));
}

/// Returns the format without the sign of the native byte order.
std::string native_format(std::string format) {
  const char native = std::endian::native == std::endian::little ? '<' : '>';
  if (!format.empty() && (format[0] == '@' || format[0] == '=' || format[0] == native))
    format.erase(0, 1);
  return format;
}

[[noreturn]] void refuse_type(const py::object& object, const std::string& name,
                              const std::string& wanted) {
  throw Error(name + " is of type " + type_of(object) + ": " + wanted + " is expected", kWhere,
              "convert it, such as with " + name + ".astype(numpy." +
                  wanted.substr(0, wanted.find(' ')) + ")");
}

/// Throws Error for a depth image of another type. Integers are raw units: converted to float32
/// they would be taken as meters.
[[noreturn]] void refuse_depth_type(const py::object& object) {
  const std::string kind =
      py::hasattr(object, "dtype") ? py::str(object.attr("dtype").attr("kind")) : py::str();
  const bool whole = kind == "i" || kind == "u";
  throw Error("depth is of type " + type_of(object) +
                  ": float32 [m], or uint16 in units of 1 / camera.depth_factor meters, is "
                  "expected",
              kWhere,
              whole ? "convert raw units with depth.astype(numpy.uint16), and whole meters with "
                      "depth.astype(numpy.float32)"
                    : "convert meters with depth.astype(numpy.float32)");
}

[[noreturn]] void refuse_shape(const py::buffer_info& info, const std::string& name,
                               const std::string& wanted) {
  throw Error(name + " has the shape " + text_of(info.shape) + ": " + wanted + " is expected",
              kWhere, "give one image of the camera");
}

py::buffer_info buffer_of(const py::object& object, const std::string& name, const char* where) {
  if (PyObject_CheckBuffer(object.ptr()) == 0) {
    throw Error(name + " is a " + type_of(object) + ": a NumPy array is expected", where,
                "convert it, such as with numpy.asarray(" + name + ")");
  }
  return py::reinterpret_borrow<py::buffer>(object).request();
}

/// Returns whether OpenCV can address rows of pixels with these strides.
bool has_mat_layout(const py::buffer_info& info, py::ssize_t pixel) {
  const py::ssize_t row = info.strides[0];
  const auto address = reinterpret_cast<std::uintptr_t>(info.ptr);
  const auto item = static_cast<std::uintptr_t>(info.itemsize);
  return info.strides[1] == pixel && row >= pixel * info.shape[1] && row % info.itemsize == 0 &&
         address % item == 0;
}

/// Returns a copy of a lent image of any strides, with the order of its channels reversed: RGB
/// becomes BGR.
cv::Mat reversed_copy(const py::buffer_info& info, int type) {
  cv::Mat image(static_cast<int>(info.shape[0]), static_cast<int>(info.shape[1]), type);
  const py::ssize_t channels = image.channels();
  const auto item = static_cast<std::size_t>(info.itemsize);
  for (py::ssize_t y = 0; y < info.shape[0]; ++y) {
    std::uint8_t* to = image.ptr(static_cast<int>(y));
    const std::uint8_t* row = static_cast<const std::uint8_t*>(info.ptr) + y * info.strides[0];
    for (py::ssize_t x = 0; x < info.shape[1]; ++x) {
      const std::uint8_t* pixel = row + x * info.strides[1];
      for (py::ssize_t c = channels - 1; c >= 0; --c, to += item)
        std::memcpy(to, pixel + (channels > 1 ? c * info.strides[2] : 0), item);
    }
  }
  return image;
}

Trajectory trajectory_of_rows(const py::object& object, const char* name) {
  const py::object numpy = py::module_::import("numpy");
  const py::object rows =
      numpy.attr("ascontiguousarray")(object, py::arg("dtype") = numpy.attr("float64"));
  const py::buffer_info info = buffer_of(rows, name, "");
  if (info.ndim != 2 || info.shape[1] != kTumColumns) {
    throw Error(
        std::string(name) + " has the shape " + text_of(info.shape) + ": (N, 8) is expected", "",
        "give rows of timestamp tx ty tz qx qy qz qw");
  }
  Trajectory trajectory;
  const auto* v = static_cast<const double*>(info.ptr);
  for (py::ssize_t i = 0; i < info.shape[0]; ++i, v += kTumColumns) {
    const bool finite = std::all_of(v, v + kTumColumns, [](double x) { return std::isfinite(x); });
    const Eigen::Quaterniond q(v[7], v[4], v[5], v[6]);
    if (!finite || q.norm() == 0) {
      throw Error(std::string(name) + " has a pose in row " + std::to_string(i) +
                      " that is not finite or has a zero quaternion",
                  "", "leave out frames without a pose");
    }
    trajectory.push_back({v[0], Pose(q, {v[1], v[2], v[3]})});
  }
  std::stable_sort(trajectory.begin(), trajectory.end(),
                   [](const auto& a, const auto& b) { return a.timestamp < b.timestamp; });
  return trajectory;
}

}  // namespace

void bind_memory(py::module_& module) {
  py::class_<Memory>(module, "_Memory", py::buffer_protocol()).def_buffer([](Memory& memory) {
    return py::buffer_info(const_cast<void*>(memory.data), memory.item_size, memory.format,
                           static_cast<py::ssize_t>(memory.shape.size()), memory.shape,
                           memory.strides, memory.read_only);
  });
}

py::object array_of(Memory memory) {
  return py::module_::import("numpy").attr("asarray")(py::cast(std::move(memory)));
}

py::object array_of(std::vector<double> values, std::vector<py::ssize_t> shape) {
  constexpr py::ssize_t kItem = sizeof(double);
  auto owner = std::make_shared<std::vector<double>>(std::move(values));
  if (owner->empty()) owner->reserve(1);  // an address even of no element
  std::vector<py::ssize_t> strides(shape.size(), kItem);
  for (std::size_t i = shape.size() - 1; i > 0; --i) strides[i - 1] = strides[i] * shape[i];
  return array_of(Memory{owner, owner->data(), py::format_descriptor<double>::format(), kItem,
                         std::move(shape), std::move(strides), false});
}

Pose motion_of(const Matrix4& matrix, const char* argument) {
  std::array<double, 16> numbers{};
  for (std::size_t i = 0; i < numbers.size(); ++i) numbers[i] = matrix[i / 4][i % 4];
  if (const auto T = rigid_motion(numbers)) return *T;
  throw Error(std::string(argument) + " is no rigid motion", "stillmap",
              "give a rotation and a translation [m] as a 4 x 4 matrix");
}

Pose motion_of(const MatrixOrNumbers& motion, const char* argument) {
  if (const auto* matrix = std::get_if<Matrix4>(&motion)) return motion_of(*matrix, argument);
  const auto& [x, y, z, qx, qy, qz, qw] = std::get<1>(motion);
  const Eigen::Quaterniond q(qw, qx, qy, qz);
  const Eigen::Vector3d t(x, y, z);
  constexpr double kRounded = 1e-3;
  if (t.allFinite() && std::abs(q.norm() - 1) < kRounded) return {q.normalized(), t};
  throw Error(std::string(argument) + " is no rigid motion", "stillmap",
              "give a translation [m] and a quaternion of length 1 as x y z qx qy qz qw");
}

py::object matrix_of(const Pose& T_a_b) {
  std::vector<double> values(16, 0.0);
  Eigen::Map<Eigen::Matrix<double, 4, 4, Eigen::RowMajor>> matrix(values.data());
  matrix.topLeftCorner<3, 3>() = T_a_b.rotation();
  matrix.topRightCorner<3, 1>() = T_a_b.translation();
  matrix(3, 3) = 1;
  return array_of(std::move(values), {4, 4});
}

py::object rows_of(const Trajectory& trajectory) {
  std::vector<double> values;
  for (const StampedPose& pose : trajectory) {
    const Eigen::Vector3d& t = pose.T_world_camera.translation();
    const Eigen::Quaterniond& q = pose.T_world_camera.quaternion();
    values.insert(values.end(), {pose.timestamp, t.x(), t.y(), t.z(), q.x(), q.y(), q.z(), q.w()});
  }
  const auto rows = static_cast<py::ssize_t>(trajectory.size());
  return array_of(std::move(values), {rows, kTumColumns})
      .attr("view")(py::module_::import("stillmap.trajectory").attr("Trajectory"));
}

Trajectory trajectory_of(const py::object& rows_or_file, const char* name) {
  const bool path =
      py::isinstance<py::str>(rows_or_file) || py::hasattr(rows_or_file, "__fspath__");
  return path ? read_trajectory(rows_or_file.cast<std::filesystem::path>())
              : trajectory_of_rows(rows_or_file, name);
}

py::object view_of(const cv::Mat& image, const std::shared_ptr<const void>& owner) {
  const auto row = static_cast<py::ssize_t>(image.step[0]);
  const py::ssize_t height = image.rows, width = image.cols;
  switch (image.type()) {
    case CV_8UC3:  // from the last byte of a BGR pixel backwards: RGB
      return array_of(Memory{owner, image.data + 2, "B", 1, {height, width, 3}, {row, 3, -1}});
    case CV_8UC1:
      return array_of(Memory{owner, image.data, "B", 1, {height, width}, {row, 1}});
    case CV_8SC1:
      return array_of(Memory{owner, image.data, "b", 1, {height, width}, {row, 1}});
    case CV_32FC1:
      return array_of(Memory{owner, image.data, "f", 4, {height, width}, {row, 4}});
    default:
      throw Error("an image of this type cannot be shown as an array", "Frame", "");
  }
}

LentImage::LentImage(const py::object& object, const char* name)
    : info_(buffer_of(object, name, kWhere)) {
  if (info_.size == 0) refuse_shape(info_, name, "an image of the camera's size");
}

LentImage LentImage::color(const py::object& object) {
  LentImage image(object, "rgb");
  const py::buffer_info& info = image.info_;
  if (native_format(info.format) != "B") refuse_type(object, "rgb", "uint8");
  if (info.ndim != 2 && (info.ndim != 3 || info.shape[2] != 3))
    refuse_shape(info, "rgb", "(height, width, 3), or (height, width) for gray,");
  image.type_ = info.ndim == 3 ? CV_8UC3 : CV_8UC1;
  return image;
}

LentImage LentImage::depth(const py::object& object) {
  LentImage image(object, "depth");
  const std::string format = native_format(image.info_.format);
  if (format != "H" && format != "f") refuse_depth_type(object);
  if (image.info_.ndim != 2) refuse_shape(image.info_, "depth", "(height, width)");
  image.type_ = format == "H" ? CV_16UC1 : CV_32FC1;
  return image;
}

LentImage LentImage::mask(const py::object& object) {
  LentImage image(object, "mask");
  const std::string format = native_format(image.info_.format);
  if (format != "?" && format != "B") refuse_type(object, "mask", "uint8 or bool");
  if (image.info_.ndim != 2) refuse_shape(image.info_, "mask", "(height, width)");
  image.type_ = CV_8UC1;
  return image;
}

cv::Mat LentImage::mat() const {
  const int rows = static_cast<int>(info_.shape[0]), columns = static_cast<int>(info_.shape[1]);
  if (type_ != CV_8UC3) {
    if (!has_mat_layout(info_, info_.itemsize)) return reversed_copy(info_, type_);
    return {rows, columns, type_, info_.ptr, static_cast<std::size_t>(info_.strides[0])};
  }
  const bool pixels_follow = has_mat_layout(info_, 3);
  if (pixels_follow && info_.strides[2] == -1) {  // BGR that is shown as RGB
    return {rows, columns, type_, static_cast<std::uint8_t*>(info_.ptr) - 2,
            static_cast<std::size_t>(info_.strides[0])};
  }
  if (!pixels_follow || info_.strides[2] != 1) return reversed_copy(info_, type_);
  cv::Mat bgr;
  cv::cvtColor(cv::Mat(rows, columns, type_, info_.ptr, static_cast<std::size_t>(info_.strides[0])),
               bgr, cv::COLOR_RGB2BGR);
  return bgr;
}

}  // namespace stillmap::python
