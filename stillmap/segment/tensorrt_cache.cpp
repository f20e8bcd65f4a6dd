// SPDX-License-Identifier: Apache-2.0
#include "stillmap/segment/tensorrt_cache.hpp"

#include "stillmap/base/file.hpp"
#include "stillmap/base/fnv1a.hpp"
#include "stillmap/base/warning.hpp"
#include "stillmap/segment/onnx_info.hpp"

#include <cerrno>
#include <fcntl.h>
#include <sys/file.h>
#include <system_error>
#include <unistd.h>

#include <fmt/format.h>

namespace stillmap {
namespace {

namespace fs = std::filesystem;

/// Returns why a folder cannot be created or written; empty if it can.
std::string problem_of(const fs::path& folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (!error && ::access(folder.c_str(), W_OK) != 0)
    error = std::error_code(errno, std::generic_category());
  return error ? error.message() : "";
}

}  // namespace

TensorRtCache::TensorRtCache(const fs::path& network, const std::string& versions)
    : parent_(network.string() + ".tensorrt"),
      final_(parent_ /
             fmt::format("{:016x}", fnv1a(versions, fnv1a(read_file(network, kLargestNetwork))))) {
  find_or_begin();
}

TensorRtCache::~TensorRtCache() {
  std::error_code error;
  if (!complete_ && !folder_.empty()) fs::remove_all(folder_, error);
  unlock();
}

void TensorRtCache::find_or_begin() {
  complete_ = fs::is_directory(final_);
  folder_ = final_;
  if (complete_) return;
  const std::string problem = problem_of(parent_);
  if (!problem.empty()) {
    warn(fmt::format("TensorRT builds its engine in every run, which takes minutes, since {} "
                     "cannot be written ({})",
                     parent_.string(), problem),
         "copy the network to a folder that can be written");
    folder_.clear();
    return;
  }
  lock();
  complete_ = fs::is_directory(final_);  // built by the process that held the lock
  if (complete_) return unlock();
  warn(fmt::format("TensorRT builds its engine for this network, which takes minutes, once; it is "
                   "kept in {}",
                   final_.string()),
       "");
  folder_ += ".building";
  std::error_code error;
  fs::remove_all(folder_, error);  // of a process that was killed
  fs::create_directory(folder_, error);
}

void TensorRtCache::commit() {
  if (complete_ || folder_.empty()) return;
  std::error_code error;
  fs::rename(folder_, final_, error);
  complete_ = !error;
  if (complete_) folder_ = final_;
  unlock();
}

void TensorRtCache::rebuild() {
  std::error_code error;
  fs::remove_all(final_, error);
  if (error) {
    complete_ = false;
    folder_.clear();
  } else {
    find_or_begin();
  }
}

void TensorRtCache::lock() {
  const fs::path file = parent_ / "lock";
  lock_ = ::open(file.c_str(), O_RDWR | O_CREAT | O_CLOEXEC, 0666);
  if (lock_ < 0 || ::flock(lock_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  warn("another run builds TensorRT's engine for this network; this run waits for it", "");
  while (::flock(lock_, LOCK_EX) != 0 && errno == EINTR) {
  }
}

void TensorRtCache::unlock() {
  if (lock_ >= 0) ::close(lock_);
  lock_ = -1;
}

}  // namespace stillmap
