// SPDX-License-Identifier: Apache-2.0
#include "arguments.hpp"

#include "stillmap/base/error.hpp"

#include <algorithm>
#include <map>

namespace stillmap::python {
namespace {

namespace py = pybind11;

/// Returns the arguments by their names. Throws Error for too many, and for an unknown or repeated
/// name.
std::map<std::string, py::handle> named_arguments(const Signature& signature, const py::args& args,
                                                  const py::kwargs& keywords) {
  std::map<std::string, py::handle> named;
  if (args.size() > signature.positional) {
    throw Error("there are " + std::to_string(args.size()) + " arguments without a keyword: " +
                    std::to_string(signature.positional) + " are expected",
                signature.function, signature.fix);
  }
  for (std::size_t i = 0; i < args.size(); ++i) named[signature.parameters[i].name] = args[i];
  for (const auto& [key, value] : keywords) {
    const std::string name = py::str(key);
    const bool known =
        std::any_of(signature.parameters.begin(), signature.parameters.end(),
                    [&](const Parameter& parameter) { return parameter.name == name; });
    if (!known && signature.groups) continue;
    if (!known)
      throw Error("there is no argument '" + name + "'", signature.function, signature.fix);
    if (!named.emplace(name, value).second)
      throw Error("'" + name + "' is given twice", signature.function, signature.fix);
  }
  return named;
}

}  // namespace

std::string kind_of(py::handle object) {
  if (object.is_none()) return "None";
  const std::string name = py::str(py::type::handle_of(object).attr("__name__"));
  const bool has_size = !py::isinstance<py::str>(object) && py::hasattr(object, "__len__");
  const py::ssize_t size = has_size ? PyObject_Size(object.ptr()) : -1;
  PyErr_Clear();  // an array of no dimension has no size
  return size < 0 ? name : name + " of " + std::to_string(size) + " values";
}

void refuse_call(const Signature& signature, const py::args& args, const py::kwargs& keywords) {
  const auto named = named_arguments(signature, args, keywords);
  for (const Parameter& parameter : signature.parameters) {
    const auto found = named.find(parameter.name);
    if (found == named.end()) {
      if (!parameter.required) continue;
      throw Error(parameter.name + " is missing: " + parameter.expected + " is expected",
                  signature.function, signature.fix);
    }
    if (parameter.fits(found->second)) continue;
    throw Error(parameter.name + " is of the type " + kind_of(found->second) + ": " +
                    parameter.expected + " is expected",
                signature.function, parameter.fix.empty() ? signature.fix : parameter.fix);
  }
  throw py::reference_cast_error();
}

}  // namespace stillmap::python
