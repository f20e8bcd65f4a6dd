// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/options.hpp"

#include <pybind11/pybind11.h>

/// The parts of the Python module.
namespace stillmap::python {

void bind_errors(pybind11::module_& module);
void bind_options(pybind11::module_& module);
void bind_sources(pybind11::module_& module);
void bind_results(pybind11::module_& module);
void bind_slam(pybind11::module_& module);
void bind_evaluation(pybind11::module_& module);
void bind_saved_maps(pybind11::module_& module);

/// Returns options made of the arguments of stillmap.Options; `values` may also be None or Options.
Options options_of(const pybind11::object& values, const std::string& preset,
                   const pybind11::kwargs& groups);

}  // namespace stillmap::python
