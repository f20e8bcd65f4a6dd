// SPDX-License-Identifier: Apache-2.0
#include "stillmap/base/error.hpp"
#include "stillmap/evaluate.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "arrays.hpp"
#include "bindings.hpp"

namespace stillmap::python {
namespace {

namespace py = pybind11;

RpeDelta delta_of(const std::string& name) {
  if (name == "second") return RpeDelta::kSecond;
  if (name == "frame") return RpeDelta::kFrame;
  throw Error("delta is '" + name + "': second or frame is expected", "rpe", "");
}

AteResult ate(const py::object& truth, const py::object& estimate, bool with_scale) {
  AteOptions options;
  options.with_scale = with_scale;
  return absolute_trajectory_error(trajectory_of(truth, "truth"),
                                   trajectory_of(estimate, "estimate"), options);
}

RpeResult rpe(const py::object& truth, const py::object& estimate, const std::string& delta) {
  return relative_pose_error(trajectory_of(truth, "truth"), trajectory_of(estimate, "estimate"),
                             delta_of(delta));
}

}  // namespace

void bind_evaluation(py::module_& module) {
  py::class_<Statistics>(module, "Statistics", "Statistics of errors, in the unit of the errors.")
      .def_readonly("rmse", &Statistics::rmse)
      .def_readonly("mean", &Statistics::mean)
      .def_readonly("median", &Statistics::median)
      .def_readonly("sd", &Statistics::sd)
      .def_readonly("min", &Statistics::min)
      .def_readonly("max", &Statistics::max)
      .def_readonly("count", &Statistics::count);
  py::class_<AteResult>(module, "AteResult", "Absolute trajectory error.")
      .def_readonly("translation", &AteResult::translation, "Statistics of the errors [m].")
      .def_property_readonly(
          "T_truth_estimate", [](const AteResult& r) { return matrix_of(r.T_truth_estimate); },
          "Transform from the estimate's world to the truth's, 4x4 float64 [m].")
      .def_readonly("scale", &AteResult::scale, "1 unless aligned with scale.");
  py::class_<RpeResult>(module, "RpeResult", "Relative pose error.")
      .def_readonly("translation", &RpeResult::translation, "Statistics [m].")
      .def_readonly("rotation", &RpeResult::rotation, "Statistics [degrees].");

  module.def("ate", &ate, py::arg("truth"), py::arg("estimate"), py::kw_only(),
             py::arg("with_scale") = false,
             "Absolute trajectory error by the rules of the TUM RGB-D benchmark. Trajectories are "
             "N x 8 arrays or files in TUM format.");
  module.def("rpe", &rpe, py::arg("truth"), py::arg("estimate"), py::kw_only(),
             py::arg("delta") = "second",
             "Relative pose error over one second, or from frame to frame (delta=\"frame\").");
  module.def(
      "read_trajectory",
      [](const std::filesystem::path& file) { return rows_of(read_trajectory(file)); },
      py::arg("file"), "Trajectory of a file in TUM format, N x 8.");
  module.def(
      "write_trajectory",
      [](const std::filesystem::path& file, const py::object& trajectory) {
        write_trajectory(file, trajectory_of(trajectory, "trajectory"));
      },
      py::arg("file"), py::arg("trajectory"), "Writes an N x 8 array in TUM format.");
}

}  // namespace stillmap::python
