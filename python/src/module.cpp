// SPDX-License-Identifier: Apache-2.0
// The Python module stillmap, on the public headers alone. Everything that takes long runs without
// Python's global interpreter lock (GIL).
#include "stillmap/base/error.hpp"

#include <exception>
#include <utility>

#include "arrays.hpp"
#include "bindings.hpp"

namespace stillmap::python {

namespace py = pybind11;

/// stillmap.Error, with the text and the parts of the C++ exception.
void bind_errors(py::module_& module) {
  static const py::handle type =
      PyErr_NewExceptionWithDoc("stillmap.Error",
                                "An error that the user can fix. str() has the text that the "
                                "command prints; the attributes problem, where and fix its parts.",
                                PyExc_RuntimeError, nullptr);
  module.add_object("Error", type);
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      std::rethrow_exception(std::move(thrown));
    } catch (const Error& e) {
      py::object error = py::reinterpret_borrow<py::object>(type)(e.what());
      error.attr("problem") = e.problem();
      error.attr("where") = e.where();
      error.attr("fix") = e.fix();
      PyErr_SetObject(type.ptr(), error.ptr());
    }
  });
}

}  // namespace stillmap::python

PYBIND11_MODULE(_native, module) {
  using namespace stillmap::python;
  module.attr("__version__") = STILLMAP_VERSION;
  bind_errors(module);
  bind_memory(module);
  bind_options(module);
  bind_sources(module);
  bind_results(module);
  bind_slam(module);
  bind_evaluation(module);
  bind_saved_maps(module);
}
