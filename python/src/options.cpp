// SPDX-License-Identifier: Apache-2.0
#include "stillmap/options.hpp"

#include "stillmap/base/error.hpp"

#include <pybind11/stl.h>
#include <pybind11/stl/filesystem.h>

#include "bindings.hpp"

namespace stillmap::python {
namespace {

namespace py = pybind11;

/// Returns a Python value as the text that `--set` takes.
std::string text_of(const py::handle& value) {
  if (py::isinstance<py::bool_>(value)) return value.cast<bool>() ? "true" : "false";
  if (!py::isinstance<py::list>(value) && !py::isinstance<py::tuple>(value)) return py::str(value);
  std::string items;
  for (const py::handle& item : value) items += (items.empty() ? "" : ", ") + text_of(item);
  return "[" + items + "]";
}

/// Throws Error for an option that concerns files which the module does not write.
void refuse_outputs(const std::string& name) {
  if (!name.starts_with("outputs.")) return;
  throw Error(
      "option " + name + " has no effect: write() makes neither meshes nor files for planners",
      "options",
      "leave it out, and make these files from the results: stillmap dense FOLDER --planner --mesh "
      "--set " +
          name + "=VALUE");
}

/// Assigns one option, or the options of a group: {"network": {"every": 3}}.
void assign(const std::string& name, const py::handle& value, Options& options) {
  if (!py::isinstance<py::dict>(value)) {
    set_option(name + "=" + text_of(value), options);
    return refuse_outputs(name);
  }
  for (const auto& [key, inner] : value.cast<py::dict>())
    assign(name + "." + std::string(py::str(key)), inner, options);
}

void assign_all(const py::dict& values, Options& options) {
  for (const auto& [name, value] : values) assign(py::str(name), value, options);
}

}  // namespace

Options options_of(const py::object& values, const std::string& preset, const py::kwargs& groups) {
  const bool given = py::isinstance<Options>(values);
  if (given && !preset.empty()) {
    throw Error("both options and a preset are given", "preset",
                "give the preset where the options are made: Options(preset=...)");
  }
  if (!given && !values.is_none() && !py::isinstance<py::dict>(values)) {
    throw Error("options are a " + std::string(py::str(py::type::of(values).attr("__name__"))),
                "options", "give a dict such as {\"network.model\": FILE}, or stillmap.Options");
  }
  Options options = given ? values.cast<Options>() : read_options(preset);
  if (!given && !values.is_none()) assign_all(values.cast<py::dict>(), options);
  assign_all(groups, options);
  return options;
}

void bind_options(py::module_& module) {
  py::class_<Options>(module, "Options",
                      "All options of a run. Their names, units and ranges are those of the "
                      "command: docs/options.md, or str(Options()).")
      .def(py::init([](const py::object& values, const std::string& preset,
                       const std::optional<std::filesystem::path>& file, const py::kwargs& groups) {
             if (!file) return options_of(values, preset, groups);
             Options options = read_options(preset, *file);
             if (!values.is_none()) assign_all(values.cast<py::dict>(), options);
             assign_all(groups, options);
             return options;
           }),
           py::arg("values") = py::none(), py::kw_only(), py::arg("preset") = "",
           py::arg("file") = py::none(),
           "Options of a preset and a YAML file, overridden by a dict of option names, "
           "{\"network.model\": FILE}, or by groups as keywords, network={\"model\": FILE}.")
      .def(
          "__setitem__",
          [](Options& options, const std::string& name, const py::object& value) {
            assign(name, value, options);
          },
          py::arg("name"), py::arg("value"), "Overrides one option by its name.")
      .def_property_readonly("preset", &Options::preset, "Name of the preset.")
      .def("__str__", &options_yaml, "All options as YAML, with unit, range and default of each.")
      .def("__repr__",
           [](const Options& o) { return "stillmap.Options(preset='" + o.preset() + "')"; });

  module.def(
      "presets",
      [] {
        py::dict found;
        for (const Preset& preset : presets()) found[py::str(preset.name)] = preset.description;
        return found;
      },
      "Names and descriptions of all presets.");
}

}  // namespace stillmap::python
