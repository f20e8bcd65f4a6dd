// SPDX-License-Identifier: Apache-2.0
#pragma once
#include <filesystem>
#include <string>

namespace stillmap {

/// The folder of TensorRT's engine and timing cache for one network on one GPU. Building them takes
/// minutes, so they are kept in the folder NETWORK.onnx.tensorrt, next to the network, for later
/// runs. The content of that file, the GPU and the versions of the libraries select a folder in it.
///
/// A folder is built under another name and renamed when it is complete, so that a run that is
/// killed leaves no part of an engine. A lock, which ends with the process, lets other processes
/// wait for the one that builds.
class TensorRtCache {
 public:
  /// Finds the folder or begins a new one; waits while another process builds one for this file.
  /// Warns if a new one is built in this run, or in every run because nothing can be written.
  /// @param network path of the .onnx file
  /// @param versions GPU and versions of the libraries, as a text
  TensorRtCache(const std::filesystem::path& network, const std::string& versions);
  /// Deletes a new folder without commit().
  ~TensorRtCache();
  TensorRtCache(const TensorRtCache&) = delete;
  TensorRtCache& operator=(const TensorRtCache&) = delete;

  /// Returns the folder that the execution provider uses; empty if it cannot be written.
  const std::filesystem::path& folder() const { return folder_; }
  /// Returns whether the folder holds an engine of an earlier run.
  bool complete() const { return complete_; }
  /// Keeps the new folder for later runs. Call after the first run of the network.
  void commit();
  /// Deletes an engine that cannot be read, and begins a new folder.
  void rebuild();

 private:
  void lock();
  void unlock();
  void find_or_begin();

  std::filesystem::path parent_, final_, folder_;
  bool complete_ = false;
  int lock_ = -1;  ///< Descriptor of the locked file; -1 without.
};

}  // namespace stillmap
