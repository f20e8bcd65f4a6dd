// SPDX-License-Identifier: Apache-2.0
#include "stillmap/slam.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.hpp"
#include <fmt/format.h>

namespace stillmap::python {

namespace py = pybind11;

void bind_saved_maps(py::module_& module) {
  py::class_<MergedPair>(module, "MergedPair", "Two maps of a merge.")
      .def_readonly("a", &MergedPair::a, "File of one of the maps.")
      .def_readonly("b", &MergedPair::b, "File of the other one.")
      .def_readonly("places", &MergedPair::places,
                    "Number of keyframes whose place is known in the other map.")
      .def_readonly("connected", &MergedPair::connected,
                    "They lie in one world, through these places or other maps.")
      .def_readonly("reason", &MergedPair::reason,
                    "Without places: 'connected by other maps', or the test that the most similar "
                    "keyframes failed.")
      .def("__repr__", [](const MergedPair& pair) {
        return fmt::format("<stillmap.MergedPair: {} and {}, {}>", pair.a.string(), pair.b.string(),
                           pair.connected ? "connected" : "not connected");
      });
  module.def(
      "merge_maps",
      [](const std::vector<std::filesystem::path>& maps, const std::filesystem::path& out) {
        return merge_saved_maps(maps, out);
      },
      py::arg("maps"), py::arg("out"), py::call_guard<py::gil_scoped_release>(),
      "Merges saved maps, or those of folders of runs, in one file, as `stillmap map merge`. "
      "Returns "
      "a MergedPair for all pairs of them.");
  module.def(
      "compare_maps",
      [](const std::filesystem::path& before, const std::filesystem::path& after) {
        return compare_saved_maps(before, after);
      },
      py::arg("before"), py::arg("after"), py::call_guard<py::gil_scoped_release>(),
      "Returns what changed between the maps of two visits (ObjectChange), in the world of the "
      "older "
      "one, as `stillmap map changes`.");
}

}  // namespace stillmap::python
