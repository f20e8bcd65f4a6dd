// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/dense/cloud.hpp"
#include "stillmap/geometry/trajectory.hpp"

#include <array>
#include <cstddef>
#include <memory>
#include <pybind11/pybind11.h>
#include <string>
#include <variant>
#include <vector>

#include <opencv2/core.hpp>

/// NumPy arrays of the library's data. They are made with Python's buffer protocol instead of
/// NumPy's C API, so that one binary works with NumPy 1 and 2.
namespace stillmap::python {

/// Memory that a NumPy array shows without a copy.
struct Memory {
  std::shared_ptr<const void> owner;  ///< Keeps the data alive.
  const void* data = nullptr;         ///< First element.
  std::string format;                 ///< Type of an element, as in Python's module struct.
  pybind11::ssize_t item_size = 0;    ///< Size of an element [bytes].
  std::vector<pybind11::ssize_t> shape;
  std::vector<pybind11::ssize_t> strides;  ///< [bytes]
  bool read_only = true;
};

/// Adds the type of such memory to the module. Called before the functions below are.
void bind_memory(pybind11::module_& module);

/// Returns numpy.asarray() of the memory.
pybind11::object array_of(Memory memory);

/// Returns an array of float64 that Python owns, row by row.
pybind11::object array_of(std::vector<double> values, std::vector<pybind11::ssize_t> shape);

/// Returns a 4x4 matrix T_a_b.
pybind11::object matrix_of(const Pose& T_a_b);

using Matrix4 = std::array<std::array<double, 4>, 4>;
/// Returns the rigid motion in a matrix, row by row. Throws Error with the name of the argument.
Pose motion_of(const Matrix4& matrix, const char* argument);
/// The same, or the seven numbers of files: translation [m] and quaternion, x y z w.
using MatrixOrNumbers = std::variant<Matrix4, std::array<double, 7>>;
Pose motion_of(const MatrixOrNumbers& motion, const char* argument);

/// Returns a stillmap.Trajectory of N x 8 float64: timestamp [s], translation [m], quaternion x y z
/// w of T_world_camera.
pybind11::object rows_of(const Trajectory& trajectory);

/// Returns the trajectory in such an array, or in a file of TUM format that a path names. Throws
/// Error for any other object.
Trajectory trajectory_of(const pybind11::object& rows_or_file, const char* name);

/// Returns a read-only view of an image of 8-bit gray (signed, too), 8-bit BGR (as RGB) or 32-bit
/// float.
pybind11::object view_of(const cv::Mat& image, const std::shared_ptr<const void>& owner);

/// An image that a Python object lends, without a copy where its memory has OpenCV's layout.
/// Construction and destruction need the GIL.
class LentImage {
 public:
  /// @param object  array of uint8, H x W x 3 RGB or H x W gray
  /// Throws Error that names the argument and its type or shape for any other object.
  static LentImage color(const pybind11::object& object);
  /// @param object  array of uint16 or float32, H x W
  static LentImage depth(const pybind11::object& object);
  /// @param object  array of bool or uint8, H x W
  static LentImage mask(const pybind11::object& object);

  /// Returns the image in OpenCV's layout: a header of the lent memory, or a copy if the memory has
  /// another layout (RGB instead of BGR, pixels or rows that do not follow each other). Needs no
  /// GIL. Never written to.
  cv::Mat mat() const;

 private:
  LentImage(const pybind11::object& object, const char* name);

  pybind11::buffer_info info_;
  int type_ = 0;  // OpenCV's type of the image
};

}  // namespace stillmap::python
