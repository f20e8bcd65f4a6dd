// SPDX-License-Identifier: Apache-2.0
#pragma once
#include "stillmap/segment/onnxruntime_api.hpp"

#include <filesystem>
#include <string>
#include <vector>

namespace stillmap {

/// The library of ONNX Runtime, opened at run time. Once opened, it stays open.
class OnnxRuntimeLibrary {
 public:
  /// Opens the first of onnxruntime_files() at the first call. Thread-safe.
  static const OnnxRuntimeLibrary& instance();

  /// Opens the first file that is a usable library; see problem() if there is none.
  explicit OnnxRuntimeLibrary(const std::vector<std::filesystem::path>& files);

  bool loaded() const { return api_ != nullptr; }
  /// Returns why none of the files can be used; empty if loaded.
  const std::string& problem() const { return problem_; }
  /// Returns the functions of the library; only if loaded.
  const ort::Api& api() const { return *api_; }
  /// Returns the version of the library, such as "1.31.1"; only if loaded.
  const std::string& version() const { return version_; }
  /// Returns the folder of the library, which also holds its execution providers; only if loaded.
  const std::filesystem::path& folder() const { return folder_; }

 private:
  /// Opens one file; returns the reason if it is not usable.
  std::string open(const std::filesystem::path& file);

  const ort::Api* api_ = nullptr;
  std::string version_, problem_;
  std::filesystem::path folder_;
};

/// Environment variable that names the library, its folder, its Python package or a Python
/// environment.
constexpr const char* kOnnxRuntimeVariable = "STILLMAP_ONNXRUNTIME";

/// Returns the value of that variable; empty if it is not set.
std::filesystem::path given_onnxruntime();

/// Returns the files that may be the library, in the order in which they are tried. If the
/// environment variable is set, these are the ones that it names; otherwise the Python packages
/// onnxruntime and onnxruntime-gpu of the active environment (VIRTUAL_ENV, CONDA_PREFIX) and of
/// that into which pip installed this program, the search path of the dynamic loader, and the
/// Python packages of the user and of the system.
/// Libraries with CUDA come first.
std::vector<std::filesystem::path> onnxruntime_files();

/// Opens the libraries of CUDA, cuDNN and TensorRT in the Python environment of ONNX Runtime, which
/// the dynamic loader would not find itself. Missing ones are skipped; ONNX Runtime names them
/// later.
void open_nvidia_packages(const OnnxRuntimeLibrary& library);

}  // namespace stillmap
