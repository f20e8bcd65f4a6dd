// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/onnxruntime_library.hpp"

#include <algorithm>
#include <cstdint>
#include <cstdlib>
#include <dlfcn.h>
#include <elf.h>
#include <fstream>
#include <optional>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

constexpr const char* kSystemLibrary = "libonnxruntime.so.1";

/// Returns the entries of a folder whose names begin with `prefix`, by name; none if it cannot be
/// read.
std::vector<fs::path> entries(const fs::path& folder, const std::string& prefix = "") {
  std::vector<fs::path> found;
  std::error_code error;
  for (fs::directory_iterator i(folder, error), end; !error && i != end; i.increment(error)) {
    if (i->path().filename().string().starts_with(prefix)) found.push_back(i->path());
  }
  std::sort(found.begin(), found.end());
  return found;
}

void append(const std::vector<fs::path>& more, std::vector<fs::path>& files) {
  files.insert(files.end(), more.begin(), more.end());
}

/// Returns the libraries of the package onnxruntime in a folder of Python packages.
std::vector<fs::path> files_in(const fs::path& packages) {
  return entries(packages / "onnxruntime" / "capi", "libonnxruntime.so");
}

/// Returns the libraries in the Python packages below PREFIX/lib.
std::vector<fs::path> packaged_files(const fs::path& prefix) {
  std::vector<fs::path> files;
  if (prefix.empty()) return files;
  for (const fs::path& python : entries(prefix / "lib", "python3")) {
    for (const char* packages : {"site-packages", "dist-packages"})
      append(files_in(python / packages), files);
  }
  return files;
}

/// Returns the libraries in the environment into which pip installed this program: it is
/// PREFIX/bin/stillmap, or, in published wheels, PACKAGES/stillmap.scripts/stillmap.
std::vector<fs::path> files_beside_program() {
  std::error_code error;
  const fs::path folder = fs::read_symlink("/proc/self/exe", error).parent_path();
  if (error) return {};
  std::vector<fs::path> files = packaged_files(folder.parent_path());
  append(files_in(folder.parent_path()), files);
  return files;
}

bool has_cuda(const fs::path& file) {
  return fs::exists(file.parent_path() / "libonnxruntime_providers_cuda.so");
}

/// Returns the value of an environment variable; empty if it is not set.
std::string environment(const char* variable) {
  const char* value = std::getenv(variable);
  return value == nullptr ? "" : value;
}

/// Returns the start of an ELF file (a program or library of Linux); none if it is not one. The
/// fields up to e_machine are the same in 32-bit files.
std::optional<Elf64_Ehdr> elf_header(const fs::path& file) {
  std::ifstream in(file, std::ios::binary);
  Elf64_Ehdr header{};
  if (!in.read(reinterpret_cast<char*>(&header), sizeof(header))) return std::nullopt;
  if (!std::equal(header.e_ident, header.e_ident + SELFMAG, ELFMAG)) return std::nullopt;
  return header;
}

std::string processor_name(const Elf64_Ehdr& header) {
  switch (header.e_machine) {
    case EM_386:
      return "32-bit x86";
    case EM_X86_64:
      return "x86-64";
    case EM_ARM:
      return "32-bit ARM";
    case EM_AARCH64:
      return "64-bit ARM (aarch64)";
    default:
      return fmt::format("ELF machine {}", header.e_machine);
  }
}

/// Returns why the loader must not open a file; empty if it may. The loader calls a library for
/// another processor missing, and opening an incomplete one would end the program with a bus error.
std::string file_problem(const fs::path& file) {
  const std::optional<Elf64_Ehdr> found = elf_header(file);
  if (!found) return {};
  const Elf64_Ehdr& header = *found;
  const std::optional<Elf64_Ehdr> own = elf_header("/proc/self/exe");
  if (own && header.e_machine != own->e_machine) {
    return fmt::format("{} is a library for {} processors; this program runs on {}", file.string(),
                       processor_name(header), processor_name(*own));
  }
  std::uintmax_t needed = header.e_shoff;
  needed += std::uintmax_t{header.e_shnum} * header.e_shentsize;
  std::error_code error;
  const std::uintmax_t size = fs::file_size(file, error);
  if (error || size >= needed) return {};
  return fmt::format("{} is incomplete: it has {} of {} bytes", file.string(), size, needed);
}

std::string loader_problem() {
  const char* problem = dlerror();
  return problem != nullptr ? problem : "unknown problem of the dynamic loader";
}

}  // namespace

OnnxRuntimeLibrary::OnnxRuntimeLibrary(const std::vector<fs::path>& files) {
  for (const fs::path& file : files) {
    const std::string problem = open(file);
    if (loaded()) {
      problem_.clear();
      return;
    }
    if (problem_.empty() || fs::exists(file)) problem_ = problem;  // a file rather than the loader
  }
}

std::string OnnxRuntimeLibrary::open(const fs::path& file) {
  if (std::string problem = file_problem(file); !problem.empty()) return problem;
  void* library = dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL);
  if (library == nullptr) return loader_problem();
  const auto base = reinterpret_cast<const ort::ApiBase* (*)()>(dlsym(library, "OrtGetApiBase"));
  if (base == nullptr) return loader_problem();
  version_ = base()->version();
  Dl_info place{};
  if (dladdr(reinterpret_cast<void*>(base), &place) != 0)
    folder_ = fs::weakly_canonical(place.dli_fname).parent_path();
  api_ = base()->api(ort::kApiVersion);
  if (api_ != nullptr) return {};
  return fmt::format("{} is ONNX Runtime {}, which is older than 1.{}", file.string(), version_,
                     ort::kApiVersion);
}

const OnnxRuntimeLibrary& OnnxRuntimeLibrary::instance() {
  static const OnnxRuntimeLibrary library(onnxruntime_files());
  return library;
}

fs::path given_onnxruntime() { return environment(kOnnxRuntimeVariable); }

std::vector<fs::path> onnxruntime_files() {
  if (const fs::path given = given_onnxruntime(); !given.empty()) {
    if (!fs::is_directory(given)) return {given};
    std::vector<fs::path> inside = entries(given, "libonnxruntime.so");
    append(entries(given / "capi", "libonnxruntime.so"), inside);
    append(packaged_files(given), inside);
    return inside.empty() ? std::vector<fs::path>{given / kSystemLibrary} : inside;
  }
  std::vector<fs::path> files = packaged_files(environment("VIRTUAL_ENV"));
  append(packaged_files(environment("CONDA_PREFIX")), files);
  append(files_beside_program(), files);
  files.emplace_back(kSystemLibrary);
  append(packaged_files(environment("HOME") + "/.local"), files);
  append(packaged_files("/usr/local"), files);
  append(packaged_files("/usr"), files);
  std::stable_partition(files.begin(), files.end(), has_cuda);
  return files;
}

void open_nvidia_packages(const OnnxRuntimeLibrary& library) {
  const fs::path packages = library.folder() / ".." / "..";
  std::vector<fs::path> folders = {packages / "tensorrt_libs"};
  for (const fs::path& package : entries(packages / "nvidia")) folders.push_back(package / "lib");
  // A library follows those that it depends on.
  for (const char* name : {"libcudart.so", "libcublasLt.so", "libcublas.so", "libnvrtc.so",
                           "libcurand.so", "libcufft.so", "libcudnn.so", "libnvinfer.so",
                           "libnvinfer_plugin.so", "libnvonnxparser.so"}) {
    for (const fs::path& folder : folders) {
      for (const fs::path& file : entries(folder, name))
        dlopen(file.c_str(), RTLD_LAZY | RTLD_GLOBAL);
    }
  }
}

}  // namespace stillmap
