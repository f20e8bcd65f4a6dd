// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <pybind11/pybind11.h>
#include <string>
#include <vector>

/// Errors of calls that fit no signature, instead of pybind11's TypeError with C++ types and the
/// values of all arguments.
namespace stillmap::python {

/// A parameter of a function of the module.
struct Parameter {
  std::string name;
  std::string expected;            ///< What a value must be, such as "a number [pixels]".
  bool (*fits)(pybind11::handle);  ///< Returns whether a value can be converted.
  bool required = true;
  std::string fix = {};  ///< Fix for a value of another kind; empty for that of the signature.
};

struct Signature {
  std::string function;
  std::vector<Parameter> parameters;
  std::size_t positional;  ///< Number of parameters that need no keyword.
  std::string fix;         ///< Fix for a missing or unknown argument.
  bool groups = false;     ///< Keywords without a parameter are groups of options.
};

/// Returns whether a value can be converted to a C++ type.
template <typename T>
bool fits(pybind11::handle value) {
  return pybind11::detail::make_caster<T>().load(value, true);
}

inline bool fits_any(pybind11::handle) { return true; }

/// Returns an object's type in words, with its size if it has one, such as "list of 8 values".
std::string kind_of(pybind11::handle object);

/// To be called by an overload that takes any arguments and is defined last. Throws Error that
/// names the first argument that is unknown, missing or of another kind. If all fit, it throws
/// pybind11::reference_cast_error, after which pybind11 tries the other overloads with conversions.
[[noreturn]] void refuse_call(const Signature& signature, const pybind11::args& args,
                              const pybind11::kwargs& keywords);

}  // namespace stillmap::python
